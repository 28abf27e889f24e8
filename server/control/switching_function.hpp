// Switching functions of an on-off thruster pair,
//   s = (theta - theta_f) + tau omega + gamma_bar I*/(2 N*) omega |omega|,   u = -sgn s outside the dead
//   band.
// Quadratic (tau = 0): Agrawal & Bang 1995, Eq. 19, with its relatives (Eqs. 4, 7, 15, 17), and with
// gamma_bar I*/N* = I/N the minimum-time law of Bryson's Fig. 3.10. Linear (gamma_bar = 0): Bryson's Eq. 3.8;
// with dead band and hysteresis the Schmitt trigger of his Fig. 3.7.
#pragma once

#include <cmath>
#include <optional>

namespace slew {

enum class Deadband { none, double_sided, single_sided };

/// Inside |theta - theta_f| <= angle and |omega| <= rate nothing fires. Not latched.
struct EndBox {
  double angle_rad = 0;
  double rate_rad_s = 0;
};

struct SwitchingFunctionParameters {
  double inertia_kg_m2 = 1;  ///< I*, the law's belief
  double torque_N_m = 1;     ///< N*, the law's belief
  double gamma_bar = 1;      ///< 0: no quadratic term
  double rate_gain_s = 0;    ///< tau; 0: no linear term
  Deadband deadband = Deadband::none;
  double deadband_rad = 0;    ///< epsilon
  double hysteresis_rad = 0;  ///< a firing ends this much later than the edge at which it began
  std::optional<EndBox> end_box;
};

/// Which side of the dead band s is on.
enum class SwitchingSide { below, inside, above };

/// The law for one maneuver: immutable once made.
class SwitchingFunction {
 public:
  /// `direction` is the sign of theta_f - theta_0, which decides where a single-sided band lies.
  SwitchingFunction(const SwitchingFunctionParameters& parameters, double final_angle_rad, int direction);

  /// s in rad. Templated over the scalar: double, dual numbers.
  template <typename Scalar>
  Scalar value(const Scalar& angle_rad, const Scalar& rate_rad_s) const {
    using std::abs;
    return (angle_rad - final_angle_rad_) + rate_gain_ * rate_rad_s +
           curvature_ * rate_rad_s * abs(rate_rad_s);
  }
  /// ds/d omega, which is never negative.
  double rate_slope(double rate_rad_s) const { return rate_gain_ + 2 * curvature_ * std::abs(rate_rad_s); }

  double final_angle_rad() const { return final_angle_rad_; }
  /// tau, s.
  double rate_gain() const { return rate_gain_; }
  /// gamma_bar I*/(2 N*), in rad s^2/rad^2.
  double curvature() const { return curvature_; }
  /// The band is [lower, upper]: [0, 0] without one, [-eps, eps] double-sided (Eq. 15), and on the side the
  /// slew comes from when single-sided. Eq. 19 prints [-eps, 0], which is right for slews towards +theta
  /// only: towards -theta it would bring the spacecraft to rest at an error of -eps. It is mirrored here.
  double lower_rad() const { return lower_rad_; }
  double upper_rad() const { return upper_rad_; }

  /// Where firings begin and end. Without hysteresis these are the edges of the band; with it, firings end
  /// nearer to the other edge, and without a band (a relay) at the other edge itself.
  double enter_above_rad() const { return enter_above_rad_; }
  double leave_above_rad() const { return leave_above_rad_; }
  double enter_below_rad() const { return enter_below_rad_; }
  double leave_below_rad() const { return leave_below_rad_; }
  SwitchingSide beyond_above() const {
    return leave_above_rad_ <= enter_below_rad_ ? SwitchingSide::below : SwitchingSide::inside;
  }
  SwitchingSide beyond_below() const {
    return leave_below_rad_ >= enter_above_rad_ ? SwitchingSide::above : SwitchingSide::inside;
  }
  bool has_hysteresis() const { return leave_above_rad_ != enter_above_rad_; }
  bool is_a_line() const { return lower_rad_ == upper_rad_; }

  /// Eq. 19 includes both ends of the band (Eq. 17 prints s < 0 for its upper end; the difference has measure
  /// zero). What came before matters within the hysteresis only; a relay that starts there takes the nearer
  /// side.
  SwitchingSide side(double s_rad, SwitchingSide before = SwitchingSide::inside) const {
    if (s_rad > (before == SwitchingSide::above ? leave_above_rad_ : enter_above_rad_))
      return SwitchingSide::above;
    if (s_rad < (before == SwitchingSide::below ? leave_below_rad_ : enter_below_rad_))
      return SwitchingSide::below;
    if (is_a_line() && has_hysteresis()) return s_rad >= 0 ? SwitchingSide::above : SwitchingSide::below;
    return SwitchingSide::inside;
  }

  /// The firing asked for on a side: u = -sgn s outside the band, 0 inside.
  static int demand(SwitchingSide side) {
    return side == SwitchingSide::above ? -1 : side == SwitchingSide::below ? 1 : 0;
  }

  const std::optional<EndBox>& end_box() const { return end_box_; }
  bool in_end_box(double angle_rad, double rate_rad_s) const {
    return end_box_ && std::abs(angle_rad - final_angle_rad_) <= end_box_->angle_rad &&
           std::abs(rate_rad_s) <= end_box_->rate_rad_s;
  }

 private:
  double final_angle_rad_;
  double rate_gain_;
  double curvature_;
  double lower_rad_ = 0;
  double upper_rad_ = 0;
  double enter_above_rad_, leave_above_rad_, enter_below_rad_, leave_below_rad_;
  std::optional<EndBox> end_box_;
};

}  // namespace slew
