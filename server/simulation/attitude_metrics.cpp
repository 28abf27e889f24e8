#include "server/simulation/attitude_metrics.hpp"

#include <algorithm>
#include <cmath>

#include "server/propagation/quartic.hpp"
#include "server/simulation/attitude_loop.hpp"

namespace slew {
namespace {

// |p| of the shorter way round.
double shorter(double norm) {
  return norm > 1 ? 1 / norm : norm;
}

bool is_component(AttitudeQuantity quantity) {
  return quantity == AttitudeQuantity::mrp_1 || quantity == AttitudeQuantity::mrp_2 ||
         quantity == AttitudeQuantity::mrp_3;
}

}  // namespace

// The angle is measured as |p| of the shorter way, whose tolerance is tan(angle/4).
AttitudeMetrics::AttitudeMetrics(const AttitudeSpecification& specification)
    : quantity_(specification.settling.quantity), tolerance_(specification.settling.tolerance) {
  const Eigen::Vector3d& p = specification.maneuver.initial_mrp;
  const bool is_angle = quantity_ == AttitudeQuantity::angle;
  if (specification.settling.is_fraction_of_initial)
    tolerance_ *= is_angle ? 4 * std::atan(shorter(p.norm())) : std::abs(quantity(p));
  if (is_angle) tolerance_ = std::tan(tolerance_ / 4);
  is_inside_ = std::abs(quantity(p)) <= tolerance_;
  if (!is_inside_) last_outside_s_ = 0;
  rate(specification.maneuver.initial_rate_rad_s);
}

double AttitudeMetrics::quantity(const Eigen::Vector3d& mrp) const {
  switch (quantity_) {
    case AttitudeQuantity::mrp_1:
      return mrp[0];
    case AttitudeQuantity::mrp_2:
      return mrp[1];
    case AttitudeQuantity::mrp_3:
      return mrp[2];
    case AttitudeQuantity::mrp_norm:
      return mrp.norm();
    case AttitudeQuantity::angle:
      return shorter(mrp.norm());
  }
  return 0;
}

bool AttitudeMetrics::step(double t_s, double h, const Eigen::Vector3d& begin, const Eigen::Vector3d& end,
                           double bound_1_s) {
  const double from = std::abs(quantity(begin)), to = std::abs(quantity(end));
  if (to > tolerance_) {
    is_inside_ = false;
    last_outside_s_ = t_s + h;
    return true;
  }
  if (from > tolerance_ || std::max(from, to) + 0.5 * h * bound_1_s > tolerance_) return false;
  is_inside_ = true;
  return true;
}

void AttitudeMetrics::step(double t_s, double h, const std::array<Eigen::Vector3d, 5>& mrp) {
  std::array<double, 5> values;
  for (std::size_t i = 0; i < 5; ++i) values[i] = quantity(mrp[i]);
  is_inside_ = std::abs(values[4]) <= tolerance_;
  if (!is_inside_) {
    last_outside_s_ = t_s + h;
    return;
  }
  // |p| itself has a corner at 0.
  const double limit = is_component(quantity_) ? tolerance_ : tolerance_ * tolerance_;
  if (!is_component(quantity_))
    for (double& value : values) value *= value;
  const Quartic curve = Quartic::through(values).reversed();
  for (const double sign : {1.0, -1.0})
    if (const auto x = curve.shifted(sign, sign * limit).first_positive())
      last_outside_s_ = std::max(last_outside_s_, t_s + (1 - *x) * h);
}

Metrics AttitudeMetrics::finish(double t_s, const Eigen::Vector3d& mrp,
                                const Eigen::Vector3d& rate_rad_s) const {
  Metrics metrics;
  metrics.end_time_s = t_s;
  metrics.final_error_rad = 4 * std::atan(shorter(mrp.norm()));
  metrics.residual_rate_rad_s = rate_rad_s.norm();
  metrics.peak_rate_rad_s = std::sqrt(peak_rate_square_);
  if (is_inside_) metrics.settling_time_s = std::max(0.0, last_outside_s_);
  metrics.angular_impulse_N_m_s = angular_impulse_N_m_s_;
  metrics.control_effort_N2_m2_s = effort_N2_m2_s_;
  return metrics;
}

void add_thrusters(const ThrusterBank& bank, const AttitudeActuator& actuator, double t_s, Metrics& metrics) {
  ThrusterTally<double>& on = metrics.thruster_on_time_s;
  ThrusterTally<std::uint64_t>& firings = metrics.firings;
  for (std::size_t j = 0; j < bank.size(); ++j) {
    on.per_thruster.push_back(bank.on_time_s(j, t_s));
    firings.per_thruster.push_back(bank.firings(j));
    on.total += on.per_thruster.back();
    firings.total += firings.per_thruster.back();
    if (!bank.thruster(j).couple_N_m) continue;
    const bool is_positive = j % 2 == 0;
    (is_positive ? on.by_sign.positive : on.by_sign.negative) += on.per_thruster.back();
    (is_positive ? firings.by_sign.positive : firings.by_sign.negative) += firings.per_thruster.back();
  }
  metrics.propellant_kg = bank.propellant_kg(t_s);
  if (const auto& density_kg_m3 = propellant_of(actuator)->gas_density_kg_m3;
      metrics.propellant_kg && density_kg_m3)
    metrics.gas_volume_m3 = *metrics.propellant_kg / *density_kg_m3;
  if (const auto* pairs = std::get_if<AxisThrusters>(&actuator); pairs && pairs->gas_flow_m3_s) {
    metrics.gas_volume_m3 = 0;
    for (std::size_t j = 0; j < bank.size(); ++j)
      *metrics.gas_volume_m3 +=
          (*pairs->gas_flow_m3_s)[static_cast<Eigen::Index>(j / 2)] * on.per_thruster[j];
  }
}

}  // namespace slew
