// What is measured on a single-axis trajectory, exactly, arc by arc: independent of telemetry and of slices.
#pragma once

#include <array>
#include <optional>

#include "server/simulation/axis.hpp"
#include "server/simulation/axis_channels.hpp"
#include "server/simulation/axis_dynamics.hpp"
#include "server/simulation/metrics.hpp"

namespace slew {

/// Fed with the arcs and mode changes of a run in the order of time. Never allocates after construction.
class AxisMetrics {
 public:
  /// Of the peak rate. Far above what 1e8 steps round, far below what the shortest firing changes.
  static constexpr double kRestFraction = 1e-10;

  /// `direction` is the sign of the slew.
  AxisMetrics(const OnOffAxisSpecification& specification, int direction);
  AxisMetrics(const LinearAxisSpecification& specification, int direction);

  /// The firing changes at t; before the arc that starts there.
  void firing(double t_s, int from, int to);
  /// The torque is against the slew from t on.
  void brake(double t_s);
  /// Proportional thrusters: what they did beside their on-times.
  void thrust(double angular_impulse_N_m_s, double effort_N2_m2_s) {
    angular_impulse_N_m_s_ += angular_impulse_N_m_s;
    effort_N2_m2_s_ += effort_N2_m2_s;
  }
  /// Thrusters chatter from t on between `least` and `most`, sliding or at rest.
  void chatter(double t_s, int least, int most, bool is_rest);
  void no_chatter() { metrics_.rest_s.reset(); }
  void end_box(double t_s, bool inside);
  /// One piece of length h that starts at t, and how long either thruster is on in it.
  template <typename Piece>
  void arc(double t_s, const Piece& piece, const AxisOnTimes& on, double h);
  /// Firings too short to be told apart.
  void impulse(const AxisOnTimes& on) { add(on, 1); }
  void slid(double h) { metrics_.sliding_s += h; }
  /// The first time that the rate along the slew is no longer positive after braking has begun, where the
  /// loop has located it itself; of an on-off law found in arc() otherwise.
  void first_rest(double t_s, double angle_rad);

  double peak_rate_rad_s() const { return metrics_.peak_rate_rad_s; }
  bool braking_has_begun() const { return switch_on_s_.has_value(); }
  /// No longer moving along the slew, to rounding: from rest, as many sampled firings back as forth leave a
  /// rate of exactly 0 and its rounding, of either sign, and inside the dead band nothing would take it away.
  bool is_at_rest(double rate_rad_s) const {
    return direction_ * rate_rad_s <= kRestFraction * metrics_.peak_rate_rad_s;
  }

  /// The metrics at the end, or so far.
  Metrics finish(double t_s, double angle_rad, double rate_rad_s) const;

 private:
  enum class Part { accelerating, coasting, braking, after };
  struct Turn {
    double t_s;
    double error_rad;
    double peak_rate_rad_s;  ///< largest |rate| since the turn before
  };

  AxisMetrics(const AxisSpecification& specification, const OnOffPairParameters& actuator, int direction,
              bool finds_rest);
  void on_time(double t_s, double h, const AxisOnTimes& on);
  void add(const AxisOnTimes& on, double share_in_part);
  void turn(double t_s, double error_rad);
  template <typename Piece>
  void settle(double t_s, const Piece& piece, const AxisMotion& end, double h);
  template <typename T>
  BySign<T>* tally_of(ThrusterTally<T>& tally);
  std::optional<LimitCycle> limit_cycle() const;

  const OnOffPairParameters actuator_;  ///< of proportional thrusters without a torque
  const bool finds_rest_;
  const double final_angle_rad_;
  const int direction_;
  const double settling_rad_;

  Metrics metrics_;
  Part part_ = Part::accelerating;
  std::optional<double> accelerated_until_s_;
  std::optional<double> switch_on_s_;
  std::optional<double> braked_until_s_;
  std::optional<double> box_entry_s_;
  bool in_box_ = false;
  double last_outside_s_ = -1;
  int motion_ = 0;  ///< sign of the rate before the present arc
  double peak_since_turn_ = 0;
  std::array<Turn, 4> turns_{};  ///< the latest, newest last
  std::size_t turn_count_ = 0;
  std::optional<double> first_overshoot_rad_;
  // Of the firings: when the latest of either sign began, when the latest ended.
  std::optional<double> positive_since_s_, negative_since_s_, fired_until_s_, firing_since_s_;
  double last_coast_s_ = 0;
  double last_firing_s_ = 0;
  double angular_impulse_N_m_s_ = 0;
  double effort_N2_m2_s_ = 0;
};

}  // namespace slew
