// The disturbance-accommodating observer of a sampled law: Eq. 35 of Kim & Crassidis 1998 over one period,
// without approximation, for an input that is held.
#pragma once

#include "server/estimation/disturbance_observer.hpp"

namespace slew {

/// Immutable; the caller keeps Q, which begins as initial_observer_state says.
class SampledDisturbanceObserver {
 public:
  SampledDisturbanceObserver(const DisturbanceObserver& observer, double period_s);

  /// z^ of a sample: N m, N m/s, N m/s^2. Its first vector is the estimated disturbance.
  ObserverState<double> estimate(const ObserverState<double>& q, const Eigen::Vector3d& surface_rad_s) const {
    return estimated_disturbance(observer_, q, surface_rad_s);
  }

  /// Q of the next sample, from this one's Q, s and input. What moves s meanwhile counts as a disturbance:
  /// the estimate is off by about 1.5 a T of a constant input.
  ObserverState<double> step(const ObserverState<double>& q, const Eigen::Vector3d& surface_rad_s,
                             const Eigen::Vector3d& input_N_m) const;

  /// The same once s of the next sample is known: straight in between, as a constant torque and a constant
  /// disturbance make it. Nothing is off then.
  ObserverState<double> step(const ObserverState<double>& q, const Eigen::Vector3d& surface_rad_s,
                             const Eigen::Vector3d& next_surface_rad_s,
                             const Eigen::Vector3d& input_N_m) const;

 private:
  /// What z^ grows by over a period in which z^' = M (z^ + (held, 0, 0)).
  ObserverState<double> growth(const ObserverState<double>& z, const Eigen::Vector3d& held_N_m) const;

  DisturbanceObserver observer_;
  double period_s_;
  Eigen::Matrix3d increment_;  ///< exp(M T) - 1 of one axis, M = D - l H
};

}  // namespace slew
