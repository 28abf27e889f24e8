// The hub on a path that is known beforehand: a parabola (sliding on a quadratic switching curve; at rest) or
// an exponential approach omega_0 exp(-tau/T) (sliding on a linear switching line; Bryson 1994, after
// Eq. 3.12).
#pragma once

#include <cmath>
#include <optional>

#include "server/propagation/quadratic_arc.hpp"

namespace slew {

/// Asked like a QuadraticArc.
struct HubPath {
  double angle_rad = 0;            ///< at tau = 0
  double rate_rad_s = 0;           ///< at tau = 0
  double acceleration_rad_s2 = 0;  ///< of a parabola
  double decay_s = 0;              ///< T; 0: a parabola

  bool is_parabola() const { return decay_s == 0; }
  double angle_at(double tau) const {
    if (is_parabola()) return angle_rad + tau * (rate_rad_s + 0.5 * acceleration_rad_s2 * tau);
    return angle_rad - rate_rad_s * decay_s * std::expm1(-tau / decay_s);
  }
  double rate_at(double tau) const {
    if (is_parabola()) return rate_rad_s + acceleration_rad_s2 * tau;
    return rate_rad_s * std::exp(-tau / decay_s);
  }
  double acceleration_at(double tau) const {
    return is_parabola() ? acceleration_rad_s2 : -rate_at(tau) / decay_s;
  }

  /// Calls `each` with the times at which angle or rate have a value, also negative ones.
  template <typename Function>
  void each_time_at_angle(double angle, Function&& each) const {
    if (is_parabola()) {
      const auto roots = quadratic_roots(angle_rad - angle, rate_rad_s, 0.5 * acceleration_rad_s2);
      for (int i = 0; i < roots.count; ++i) each(roots.tau[static_cast<std::size_t>(i)]);
    } else if (const double left = 1 - (angle - angle_rad) / (rate_rad_s * decay_s); left > 0) {
      each(-decay_s * std::log(left));
    }
  }
  template <typename Function>
  void each_time_at_rate(double rate, Function&& each) const {
    if (is_parabola()) {
      if (acceleration_rad_s2 != 0) each((rate - rate_rad_s) / acceleration_rad_s2);
    } else if (const double left = rate / rate_rad_s; left > 0) {
      each(-decay_s * std::log(left));
    }
  }
};

/// When the rate passes through zero, if that is in (0, h].
inline std::optional<double> rest_time(const HubPath& path, double h) {
  if (!path.is_parabola()) return std::nullopt;
  return rest_time(QuadraticArc<double>{path.angle_rad, path.rate_rad_s, path.acceleration_rad_s2}, h);
}

}  // namespace slew
