// What is commanded about one axis, and the modes that it makes vibrate.
#include <stdexcept>

#include "server/propagation/modal_basis.hpp"
#include "server/simulation/axis.hpp"

namespace slew {
namespace {

template <typename Poles>
std::vector<VibratingMode> oscillating(const Poles& poles) {
  std::vector<VibratingMode> modes;
  for (const std::complex<double>& pole : poles)
    if (pole.imag() > 0) {
      // Without damping a pole has the real part that rounding gives it, of either sign.
      constexpr double kRounding = 1e-10;
      const double ratio = -pole.real() / std::abs(pole);
      modes.push_back({std::abs(pole), std::abs(ratio) < kRounding ? 0 : ratio});
    }
  return modes;
}

}  // namespace

std::vector<VibratingMode> vibrating_modes(const OnOffAxisSpecification& specification) try {
  if (specification.plant.modes.empty()) return {};
  return oscillating(ModalBasis(specification.plant).lambda());
} catch (const std::domain_error&) {
  return {};
}

std::vector<VibratingMode> vibrating_modes(const LinearAxisSpecification& specification) {
  return oscillating(control_loop(specification).poles(specification.feedback.loop_gain));
}

std::vector<HeldCommand> commanded_torque(const OnOffAxisSpecification& specification) {
  std::vector<HeldCommand> torque;
  for (const ProgrammedFiring& firing : specification.program)
    torque.push_back({firing.from_s, firing.to_s, static_cast<double>(firing.direction)});
  return specification.impulses.empty() ? torque : shaped(torque, specification.impulses);
}

}  // namespace slew
