// What is measured on a three-axis trajectory, step by step: independent of telemetry and of slices.
#pragma once

#include <array>

#include "server/actuator/thruster_bank.hpp"
#include "server/simulation/attitude.hpp"
#include "server/simulation/metrics.hpp"

namespace slew {

/// Fed with the steps of a run in the order of time. Never allocates.
class AttitudeMetrics {
 public:
  explicit AttitudeMetrics(const AttitudeSpecification& specification);

  /// p at 0, 1/4, 1/2, 3/4 and 1 of a step.
  void step(double t_s, double h, const std::array<Eigen::Vector3d, 5>& mrp);
  /// A step from one p to another on which |p'| stays below a bound: true where that alone tells.
  bool step(double t_s, double h, const Eigen::Vector3d& begin, const Eigen::Vector3d& end, double bound_1_s);
  void rate(const Eigen::Vector3d& rate_rad_s) { rate_square(rate_rad_s.squaredNorm()); }
  void rate_square(double square) { peak_rate_square_ = std::max(peak_rate_square_, square); }
  /// What a torque that may be any did.
  void effort(double angular_impulse_N_m_s, double effort_N2_m2_s, double gas_m3) {
    angular_impulse_N_m_s_ += angular_impulse_N_m_s;
    effort_N2_m2_s_ += effort_N2_m2_s;
    gas_volume_m3_ += gas_m3;
  }
  double gas_volume_m3() const { return gas_volume_m3_; }

  /// All but what the thrusters tell themselves.
  Metrics finish(double t_s, const Eigen::Vector3d& mrp, const Eigen::Vector3d& rate_rad_s) const;

 private:
  double quantity(const Eigen::Vector3d& mrp) const;

  const AttitudeQuantity quantity_;
  double tolerance_;
  double last_outside_s_ = -1;
  bool is_inside_ = true;
  double peak_rate_square_ = 0;
  double angular_impulse_N_m_s_ = 0, effort_N2_m2_s_ = 0, gas_volume_m3_ = 0;
};

/// What the thrusters tell of themselves up to t. By sign only where they stand in pairs: the first, third,
/// ... of six without position push towards +.
void add_thrusters(const ThrusterBank& bank, const AttitudeActuator& actuator, double t_s, Metrics& metrics);

}  // namespace slew
