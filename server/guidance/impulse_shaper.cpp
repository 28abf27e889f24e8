#include "server/guidance/impulse_shaper.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>
#include <string>

namespace slew {

std::vector<Impulse> zero_vibration(double frequency_rad_s, double damping_ratio) {
  const double root = std::sqrt(1 - damping_ratio * damping_ratio);
  const double k = std::exp(-damping_ratio * std::numbers::pi / root);
  return {{0, 1 / (1 + k)}, {std::numbers::pi / (frequency_rad_s * root), k / (1 + k)}};
}

std::vector<Impulse> zero_vibration_and_derivative(double frequency_rad_s, double damping_ratio) {
  const auto once = zero_vibration(frequency_rad_s, damping_ratio);
  return {{0, once[0].amplitude * once[0].amplitude},
          {once[1].time_s, 2 * once[0].amplitude * once[1].amplitude},
          {2 * once[1].time_s, once[1].amplitude * once[1].amplitude}};
}

std::vector<Impulse> convolved(const std::vector<Impulse>& a, const std::vector<Impulse>& b) {
  std::vector<Impulse> out;
  for (const Impulse& first : a)
    for (const Impulse& second : b)
      out.push_back({first.time_s + second.time_s, first.amplitude * second.amplitude});
  std::stable_sort(out.begin(), out.end(),
                   [](const Impulse& x, const Impulse& y) { return x.time_s < y.time_s; });
  return out;
}

double residual_vibration(const std::vector<Impulse>& impulses, double frequency_rad_s,
                          double damping_ratio) {
  const double decay = damping_ratio * frequency_rad_s;
  const double damped = frequency_rad_s * std::sqrt(1 - damping_ratio * damping_ratio);
  std::complex<double> sum = 0;
  for (const Impulse& impulse : impulses)
    sum += impulse.amplitude *
           std::exp(std::complex<double>(decay, damped) * (impulse.time_s - impulses.back().time_s));
  return std::abs(sum);
}

double ImpulseShaper::impulse_count() const {
  const double each = type == ShaperType::none ? 1 : type == ShaperType::zero_vibration ? 2 : 3;
  return std::pow(each, static_cast<double>(modes.size() + known_modes.size()));
}

std::vector<VibratingMode> shaped_modes(const ImpulseShaper& shaper, std::span<const VibratingMode> own) {
  std::vector<VibratingMode> all;
  if (!shaper.is_there()) return all;
  for (const std::size_t mode : shaper.modes) {
    if (mode >= own.size())
      throw std::invalid_argument(own.empty() ? "no mode of what is commanded oscillates"
                                              : "what is commanded has only " + std::to_string(own.size()) +
                                                    (own.size() == 1 ? " mode" : " modes") + " to shape for");
    all.push_back(own[mode]);
  }
  all.insert(all.end(), shaper.known_modes.begin(), shaper.known_modes.end());
  for (const VibratingMode& mode : all) {
    if (!(mode.damping_ratio < 1))
      throw std::invalid_argument(
          "a mode that does not oscillate cannot be shaped for: its damping ratio is " +
          std::to_string(mode.damping_ratio));
    if (mode.damping_ratio < 0)
      throw std::invalid_argument(
          "a mode that grows by itself vibrates whatever is commanded: its damping ratio is " +
          std::to_string(mode.damping_ratio));
  }
  return all;
}

std::vector<Impulse> impulses_of(const ImpulseShaper& shaper, std::span<const VibratingMode> own) {
  const std::vector<VibratingMode> modes = shaped_modes(shaper, own);
  if (const double count = shaper.impulse_count(); count > kMostImpulses)
    throw std::invalid_argument("the shaper would have " + std::to_string(static_cast<long long>(count)) +
                                " impulses");
  std::vector<Impulse> all;
  for (const VibratingMode& mode : modes) {
    const auto impulses = shaper.type == ShaperType::zero_vibration
                              ? zero_vibration(mode.frequency_rad_s, mode.damping_ratio)
                              : zero_vibration_and_derivative(mode.frequency_rad_s, mode.damping_ratio);
    all = all.empty() ? impulses : convolved(all, impulses);
  }
  return all;
}

std::vector<HeldCommand> shaped(std::span<const HeldCommand> command, std::span<const Impulse> impulses) {
  std::vector<double> edges_s;
  for (const Impulse& impulse : impulses)
    for (const HeldCommand& piece : command)
      for (const double edge_s : {piece.from_s, piece.to_s}) edges_s.push_back(edge_s + impulse.time_s);
  std::sort(edges_s.begin(), edges_s.end());
  constexpr double kRounding = 1e-12;
  const double apart_s = edges_s.empty() ? 0 : kRounding * edges_s.back();
  const auto same = [&](double a, double b) { return b - a <= apart_s; };
  edges_s.erase(std::unique(edges_s.begin(), edges_s.end(), same), edges_s.end());

  // In the middle between two edges rounding has no say in which pieces hold.
  const auto value_at = [&](double t_s) {
    double sum = 0;
    for (const Impulse& impulse : impulses) {
      const double at_s = t_s - impulse.time_s;
      const auto after =
          std::upper_bound(command.begin(), command.end(), at_s,
                           [](double t, const HeldCommand& piece) { return t < piece.from_s; });
      if (after != command.begin() && at_s < (after - 1)->to_s) sum += impulse.amplitude * (after - 1)->value;
    }
    return sum;
  };
  std::vector<HeldCommand> out;
  for (std::size_t i = 0; i + 1 < edges_s.size(); ++i) {
    const double value = value_at(0.5 * (edges_s[i] + edges_s[i + 1]));
    if (!out.empty() && out.back().to_s == edges_s[i] && out.back().value == value)
      out.back().to_s = edges_s[i + 1];
    else if (value != 0)
      out.push_back({edges_s[i], edges_s[i + 1], value});
  }
  return out;
}

}  // namespace slew
