// The disturbance-accommodating observer of Kim & Crassidis 1998, Eqs. 28-40: what disturbs the sliding
// function is taken for a polynomial 1, t, t^2 in each axis, and estimated from s.
//   K0 = -l H,   K1 = l J^ (Eq. 34),   Q' = (D + K0)(Q + K1 s) - K1 J^-1 u_in (Eq. 35),   z^ = Q + K1 s
// with l = (3a, 3a^2, a^3): all poles at -a.
#pragma once

#include <array>

#include "server/attitude/mrp.hpp"

namespace slew {

/// What the observer takes for the torque that drives s.
enum class ObserverFeeding {
  applied_minus_equivalent,  ///< T - u_eq: sound also where the actuator saturates
  applied_total,             ///< T: then u_eq counts as a disturbance, and the law brakes earlier
  commanded,                 ///< u_cr + u_dac, Eq. 35 as printed: winds up where the actuator saturates
};

struct DisturbanceObserver {
  double pole_rad_s = 10;                                       ///< a
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Identity();  ///< J^, the law's belief
  ObserverFeeding feeding = ObserverFeeding::applied_minus_equivalent;
};

/// Q, a vector for each of 1, t, t^2: N m, N m/s, N m/s^2.
template <typename Scalar>
using ObserverState = std::array<Vector3<Scalar>, 3>;

inline std::array<double, 3> observer_gains(double pole_rad_s) {
  return {3 * pole_rad_s, 3 * pole_rad_s * pole_rad_s, pole_rad_s * pole_rad_s * pole_rad_s};
}

/// z^ = Q + K1 s (Eq. 38); its first vector is the estimated disturbance (Eq. 39), N m.
template <typename Scalar>
ObserverState<Scalar> estimated_disturbance(const DisturbanceObserver& observer,
                                            const ObserverState<Scalar>& q,
                                            const Vector3<Scalar>& surface_rad_s) {
  const std::array<double, 3> l = observer_gains(observer.pole_rad_s);
  const Vector3<Scalar> momentum = observer.inertia_kg_m2 * surface_rad_s;
  return {q[0] + l[0] * momentum, q[1] + l[1] * momentum, q[2] + l[2] * momentum};
}

/// Q' (Eq. 35).
template <typename Scalar>
ObserverState<Scalar> observer_slope(const DisturbanceObserver& observer, const ObserverState<Scalar>& z,
                                     const Vector3<Scalar>& input_N_m) {
  const std::array<double, 3> l = observer_gains(observer.pole_rad_s);
  const Vector3<Scalar> moving = z[0] + input_N_m;
  return {z[1] - l[0] * moving, z[2] - l[1] * moving, -l[2] * moving};
}

/// Q(0) = -K1 s(0): nothing is estimated yet.
template <typename Scalar>
ObserverState<Scalar> initial_observer_state(const DisturbanceObserver& observer,
                                             const Vector3<Scalar>& surface_rad_s) {
  const ObserverState<Scalar> zero{Vector3<Scalar>::Zero(), Vector3<Scalar>::Zero(), Vector3<Scalar>::Zero()};
  const ObserverState<Scalar> gained = estimated_disturbance(observer, zero, surface_rad_s);
  return {-gained[0], -gained[1], -gained[2]};
}

}  // namespace slew
