#include "server/simulation/axis_metrics.hpp"

#include <algorithm>
#include <cmath>

namespace slew {
namespace {

constexpr std::size_t kReportedExtrema = 32;

int sign_of(double value) {
  return value > 0 ? 1 : value < 0 ? -1 : 0;
}

double settling_tolerance(const AxisSpecification& specification) {
  const auto& maneuver = specification.maneuver;
  const double initial = std::abs(maneuver.initial_angle_rad - maneuver.final_angle_rad);
  return specification.settling.kind == SettlingTolerance::absolute
             ? specification.settling.tolerance
             : specification.settling.tolerance * initial;
}

}  // namespace

AxisMetrics::AxisMetrics(const OnOffAxisSpecification& specification, int direction)
    : AxisMetrics(specification, specification.actuator, direction, true) {}

// A motion that dies out smoothly comes to rest nowhere, whatever its rate has fallen to.
AxisMetrics::AxisMetrics(const LinearAxisSpecification& specification, int direction)
    : AxisMetrics(specification,
                  {.torque_N_m = 0,
                   .lever_arm_m = specification.actuator.lever_arm_m,
                   .specific_impulse_s = specification.actuator.specific_impulse_s,
                   .gas_density_kg_m3 = specification.actuator.gas_density_kg_m3},
                  direction, false) {}

AxisMetrics::AxisMetrics(const AxisSpecification& specification, const OnOffPairParameters& actuator,
                         int direction, bool finds_rest)
    : actuator_(actuator),
      finds_rest_(finds_rest),
      final_angle_rad_(specification.maneuver.final_angle_rad),
      direction_(direction),
      settling_rad_(settling_tolerance(specification)) {
  metrics_.extrema.reserve(kReportedExtrema);
  metrics_.thruster_on_time_s.per_thruster.assign(2, 0.0);
  metrics_.firings.per_thruster.assign(2, 0);
  if (std::abs(specification.maneuver.initial_angle_rad - final_angle_rad_) > settling_rad_)
    last_outside_s_ = 0;
}

template <typename T>
BySign<T>* AxisMetrics::tally_of(ThrusterTally<T>& tally) {
  switch (part_) {
    case Part::accelerating:
      return &tally.accelerating;
    case Part::coasting:
      return &tally.coasting;
    case Part::braking:
      return &tally.braking;
    case Part::after:
      break;
  }
  return nullptr;
}

void AxisMetrics::brake(double t_s) {
  if (switch_on_s_) return;
  part_ = Part::braking;
  switch_on_s_ = t_s;
  metrics_.switch_on_s = t_s;
  if (accelerated_until_s_) metrics_.coast_s = t_s - *accelerated_until_s_;
}

void AxisMetrics::firing(double t_s, int from, int to) {
  if (part_ == Part::accelerating && from == direction_ && to != direction_) {
    part_ = Part::coasting;
    accelerated_until_s_ = t_s;
  }
  if (from != 0) {
    if (firing_since_s_) last_firing_s_ = t_s - *firing_since_s_;
    fired_until_s_ = t_s;
    firing_since_s_.reset();
  }
  if (to == -direction_) brake(t_s);
  if (to == 0) return;
  last_coast_s_ = t_s - fired_until_s_.value_or(t_s);
  firing_since_s_ = t_s;
  auto& since = to > 0 ? positive_since_s_ : negative_since_s_;
  if (since) metrics_.switching_period_s = t_s - *since;
  since = t_s;
  auto& firings = metrics_.firings;
  ++firings.total;
  ++(to > 0 ? firings.by_sign.positive : firings.by_sign.negative);
  ++firings.per_thruster[to > 0 ? 0 : 1];
  if (auto* part = tally_of(firings)) ++(to > 0 ? part->positive : part->negative);
}

void AxisMetrics::chatter(double t_s, int least, int most, bool is_rest) {
  if (is_rest) metrics_.rest_s = t_s;
  if (least == -direction_ || most == -direction_) brake(t_s);
}

void AxisMetrics::end_box(double t_s, bool inside) {
  in_box_ = inside;
  if (!inside) return;
  box_entry_s_ = t_s;
  if (!metrics_.end_box_entry_s) metrics_.end_box_entry_s = t_s;
}

void AxisMetrics::on_time(double t_s, double h, const AxisOnTimes& on) {
  // Braking may end within the arc.
  add(on, part_ == Part::braking && braked_until_s_ ? (*braked_until_s_ - t_s) / h : 1);
}

void AxisMetrics::add(const AxisOnTimes& on, double share_in_part) {
  auto& times = metrics_.thruster_on_time_s;
  times.total += on.positive_s + on.negative_s;
  times.by_sign.positive += on.positive_s;
  times.by_sign.negative += on.negative_s;
  times.per_thruster[0] += on.positive_s;
  times.per_thruster[1] += on.negative_s;
  if (auto* part = tally_of(times)) {
    part->positive += share_in_part * on.positive_s;
    part->negative += share_in_part * on.negative_s;
  }
}

// The last time at which the error was outside the tolerance.
template <typename Piece>
void AxisMetrics::settle(double t_s, const Piece& piece, const AxisMotion& end, double h) {
  const auto outside = [&](double angle_rad) {
    return std::abs(angle_rad - final_angle_rad_) > settling_rad_;
  };
  if (outside(end.angle_rad)) {
    last_outside_s_ = t_s + h;
    return;
  }
  AscendingTimes<6> times;
  times.add(0);
  for (const double side : {-settling_rad_, settling_rad_})
    piece.each_time_at(final_angle_rad_ + side, [&](double tau) { times.add(tau); });
  for (std::size_t i = times.count(); i-- > 1;)
    if (outside(piece.angle_at(0.5 * (times[i - 1] + times[i])))) {
      last_outside_s_ = t_s + times[i];
      return;
    }
}

template <typename Piece>
void AxisMetrics::arc(double t_s, const Piece& piece, const AxisOnTimes& on, double h) {
  const AxisMotion begin = piece.begin(), end = piece.end();
  const double peak = piece.peak_rate(std::min(metrics_.peak_rate_rad_s, peak_since_turn_));
  metrics_.peak_rate_rad_s = std::max(metrics_.peak_rate_rad_s, peak);
  peak_since_turn_ = std::max(peak_since_turn_, peak);
  const double error = begin.angle_rad - final_angle_rad_;

  if (!metrics_.crossing_s && direction_ * (end.angle_rad - final_angle_rad_) >= 0) {
    const auto reached = direction_ * error >= 0 ? std::optional(0.0) : piece.reach(final_angle_rad_);
    metrics_.crossing_s = t_s + reached.value_or(h);
  }
  // The angle turns where the rate changes its sign, in the piece or where it met the one before.
  const auto rest = begin.rate_rad_s == 0 ? std::nullopt : piece.rest();
  const int before =
      sign_of(begin.rate_rad_s) != 0 ? sign_of(begin.rate_rad_s) : sign_of(begin.acceleration_rad_s2);
  if (motion_ != 0 && before == -motion_) turn(t_s, error);
  if (before != 0) motion_ = before;
  if (rest && *rest < h) {
    turn(t_s + *rest, piece.angle_at(*rest) - final_angle_rad_);
    motion_ = -motion_;
  }
  if (finds_rest_ && switch_on_s_ && is_at_rest(end.rate_rad_s)) {
    const double tau = rest.value_or(direction_ * begin.rate_rad_s <= 0 ? 0.0 : h);
    first_rest(t_s + tau, piece.angle_at(tau));
  }
  if (part_ == Part::braking && (metrics_.crossing_s || metrics_.first_rest_s)) {
    const double crossed = metrics_.crossing_s.value_or(HUGE_VAL);
    braked_until_s_ = std::max(t_s, std::min(crossed, metrics_.first_rest_s.value_or(HUGE_VAL)));
  }
  on_time(t_s, h, on);
  if (part_ == Part::braking && braked_until_s_) part_ = Part::after;
  settle(t_s, piece, end, h);
}

template void AxisMetrics::arc(double, const RigidPiece&, const AxisOnTimes&, double);
template void AxisMetrics::arc(double, const FlexiblePiece&, const AxisOnTimes&, double);
template void AxisMetrics::arc(double, const PathPiece&, const AxisOnTimes&, double);
template void AxisMetrics::arc(double, const TaylorPiece&, const AxisOnTimes&, double);

void AxisMetrics::first_rest(double t_s, double angle_rad) {
  if (metrics_.first_rest_s) return;
  metrics_.first_rest_s = t_s;
  metrics_.rest_error_rad = angle_rad - final_angle_rad_;
}

void AxisMetrics::turn(double t_s, double error_rad) {
  if (metrics_.extrema.size() < kReportedExtrema) metrics_.extrema.push_back({t_s, error_rad});
  if (!first_overshoot_rad_ && direction_ * error_rad > 0) first_overshoot_rad_ = direction_ * error_rad;
  std::rotate(turns_.begin(), turns_.begin() + 1, turns_.end());
  turns_.back() = {t_s, error_rad, peak_since_turn_};
  ++turn_count_;
  peak_since_turn_ = 0;
}

std::optional<LimitCycle> AxisMetrics::limit_cycle() const {
  if (turn_count_ < turns_.size()) return std::nullopt;
  const double period = turns_[3].t_s - turns_[1].t_s;
  const double before = turns_[2].t_s - turns_[0].t_s;
  const double amplitude = 0.5 * std::abs(turns_[3].error_rad - turns_[2].error_rad);
  const double amplitude_before = 0.5 * std::abs(turns_[2].error_rad - turns_[1].error_rad);
  if (std::abs(period - before) > 0.01 * period) return std::nullopt;
  if (std::abs(amplitude - amplitude_before) > 0.01 * amplitude) return std::nullopt;
  return LimitCycle{period, amplitude, std::max(turns_[3].peak_rate_rad_s, turns_[2].peak_rate_rad_s),
                    last_coast_s_, last_firing_s_};
}

Metrics AxisMetrics::finish(double t_s, double angle_rad, double rate_rad_s) const {
  Metrics metrics = metrics_;
  metrics.end_time_s = t_s;
  metrics.final_error_rad = angle_rad - final_angle_rad_;
  metrics.residual_rate_rad_s = rate_rad_s;
  // A run that ends before it turns has gone as far as its end.
  metrics.overshoot_rad = first_overshoot_rad_.value_or(std::max(0.0, direction_ * metrics.final_error_rad));
  if (in_box_) metrics.maneuver_time_s = box_entry_s_;
  if (std::abs(metrics.final_error_rad) <= settling_rad_)
    metrics.settling_time_s = std::max(0.0, last_outside_s_);
  if (switch_on_s_ && metrics.first_rest_s) {
    const double braked =
        std::min(*metrics.first_rest_s, metrics.crossing_s.value_or(HUGE_VAL)) - *switch_on_s_;
    const auto& on = metrics.thruster_on_time_s.braking;
    if (braked > 0 && actuator_.torque_N_m > 0)
      metrics.braking_duty = (direction_ > 0 ? on.negative : on.positive) / braked;
  }
  const double on_s = metrics.thruster_on_time_s.total;
  metrics.angular_impulse_N_m_s = angular_impulse_N_m_s_ + on_s * actuator_.torque_N_m;
  metrics.control_effort_N2_m2_s = effort_N2_m2_s_ + on_s * actuator_.torque_N_m * actuator_.torque_N_m;
  if (actuator_.lever_arm_m) {
    const double force_N = actuator_.torque_N_m / *actuator_.lever_arm_m;
    metrics.control_effort_N2_s =
        effort_N2_m2_s_ / (*actuator_.lever_arm_m * *actuator_.lever_arm_m) + on_s * force_N * force_N;
  }
  metrics.propellant_kg = propellant_kg(actuator_, metrics.angular_impulse_N_m_s);
  if (metrics.propellant_kg && actuator_.gas_density_kg_m3)
    metrics.gas_volume_m3 = *metrics.propellant_kg / *actuator_.gas_density_kg_m3;
  metrics.limit_cycle = limit_cycle();
  return metrics;
}

}  // namespace slew
