#include "server/control/mrp_trajectory.hpp"

#include <algorithm>
#include <cmath>

namespace slew {
namespace {

MrpReference<double> reference_at(const FinalAttitude&, double, double) {
  return {};
}

MrpReference<double> reference_at(const MrpSinusoids& sinusoids, double t_s, double) {
  const auto frequency = sinusoids.frequency_rad_s.array();
  const auto amplitude = sinusoids.amplitude.array();
  const Eigen::Array3d phase = frequency * t_s + sinusoids.phase_rad.array();
  MrpReference<double> reference;
  reference.mrp = amplitude * phase.sin();
  reference.rate_1_s = amplitude * frequency * phase.cos();
  reference.acceleration_1_s2 = -amplitude * frequency.square() * phase.sin();
  return reference;
}

MrpReference<double> reference_at(const EigenaxisRotation& rotation, double t_s, double) {
  const double x = std::clamp((t_s - rotation.from_s) / rotation.duration_s, 0.0, 1.0);
  const double span = rotation.final_angle_rad - rotation.initial_angle_rad;
  const double angle = rotation.initial_angle_rad + span * x * x * x * (10 + x * (-15 + 6 * x));
  const double rate = span * 30 * x * x * (1 - x) * (1 - x) / rotation.duration_s;
  const double acceleration =
      span * 60 * x * (1 - x) * (1 - 2 * x) / (rotation.duration_s * rotation.duration_s);

  // p_d along the axis, tan(theta/4), has the derivatives (1 + p^2) theta'/4 and
  // (1 + p^2) (theta''/4 + 2 p (theta'/4)^2).
  const double p = std::tan(angle / 4);
  MrpReference<double> reference;
  reference.mrp = p * rotation.axis;
  reference.rate_1_s = (1 + p * p) * rate / 4 * rotation.axis;
  reference.acceleration_1_s2 = (1 + p * p) * (acceleration / 4 + p * rate * rate / 8) * rotation.axis;
  return reference;
}

MrpReference<double> reference_at(const PlannedMotion& motion, double t_s, double step_began_s) {
  return motion.table ? motion.table->at(t_s, step_began_s) : MrpReference<double>{};
}

double change_after(const PlannedMotion& motion, double t_s) {
  return motion.table ? motion.table->next_jump_s(t_s) : std::numeric_limits<double>::infinity();
}
double change_after(const FinalAttitude&, double) {
  return std::numeric_limits<double>::infinity();
}
double change_after(const MrpSinusoids&, double) {
  return std::numeric_limits<double>::infinity();
}

double change_after(const EigenaxisRotation& rotation, double t_s) {
  const double end_s = rotation.from_s + rotation.duration_s;
  if (t_s < rotation.from_s) return rotation.from_s;
  return t_s < end_s ? end_s : std::numeric_limits<double>::infinity();
}

}  // namespace

MrpReference<double> MrpTrajectory::at(double t_s, double step_began_s) const {
  return std::visit([&](const auto& held) { return reference_at(held, t_s, step_began_s); }, shape);
}

double MrpTrajectory::next_change_s(double t_s) const {
  return std::visit([&](const auto& held) { return change_after(held, t_s); }, shape);
}

}  // namespace slew
