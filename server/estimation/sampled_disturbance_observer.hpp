// The disturbance-accommodating observer of a sampled law: Eq. 35 of Kim & Crassidis 1998 over one period
// in which the input is held, without approximation.
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

  /// Q of the next sample, from this one's Q, s of both, and the input. In between s is taken for straight,
  /// as a constant torque and a constant disturbance make it; held, it would count the torque as a
  /// disturbance, by about 1.5 a T of it.
  ObserverState<double> step(const ObserverState<double>& q, const Eigen::Vector3d& surface_rad_s,
                             const Eigen::Vector3d& next_surface_rad_s,
                             const Eigen::Vector3d& input_N_m) const;

 private:
  DisturbanceObserver observer_;
  double period_s_;
  Eigen::Matrix3d increment_;  ///< exp(M T) - 1 of one axis, M = D - l H
};

}  // namespace slew
