// A rigid body that is to be maneuvered: I w' = -w x I w + B u + M, q' = q w / 2 (Vadali, Singh & Carter
// 1993, Eqs. 1, 2, 5). Each u_i is bounded; M may hold a weight that hangs beside the pivot and a pedestal's
// springs.
#pragma once

#include <Eigen/LU>

#include "server/plant/pedestal.hpp"

namespace slew {

struct RigidManeuverPlant {
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Identity();  ///< body axes; products with their minus
  /// B: column i is the torque at u_i = 1.
  Eigen::Matrix3Xd influence_N_m = Eigen::Matrix3d::Identity();
  Eigen::VectorXd least_control = Eigen::Vector3d::Constant(-1);
  Eigen::VectorXd most_control = Eigen::Vector3d::Constant(1);
  /// Controls are least, zero or most, as thrusters are; else they may be throttled.
  bool is_on_off = false;
  /// What |u_i| = 1 consumes per second, in the unit of the limit on it. Empty: nothing.
  Eigen::VectorXd consumption_1_s;
  std::optional<PivotWeight> weight;
  std::optional<PedestalSprings> springs;

  Eigen::Index controls() const { return influence_N_m.cols(); }
  bool is_free() const { return !weight && !springs; }
  double consumption(Eigen::Index i) const { return i < consumption_1_s.size() ? consumption_1_s[i] : 0; }
};

/// M_g + M_s, N m.
template <typename Scalar>
Vector3<Scalar> external_moment(const RigidManeuverPlant& plant, const Vector4<Scalar>& q) {
  return pedestal_moment(plant.weight, plant.springs, q);
}

/// q' and w' together.
template <typename Scalar>
struct RigidRate {
  Vector4<Scalar> attitude_1_s;
  Vector3<Scalar> acceleration_rad_s2;
};

/// Of the plant under the torque B u. `inverse` is I^-1.
template <typename Scalar>
RigidRate<Scalar> rigid_rate(const RigidManeuverPlant& plant, const Eigen::Matrix3d& inverse,
                             const Vector4<Scalar>& q, const Vector3<Scalar>& rate_rad_s,
                             const Vector3<Scalar>& torque_N_m) {
  const Vector3<Scalar> momentum = plant.inertia_kg_m2.cast<Scalar>() * rate_rad_s;
  Vector3<Scalar> moment = torque_N_m + momentum.cross(rate_rad_s);
  if (!plant.is_free()) moment += external_moment(plant, q);
  return {euler_parameter_rate(q, rate_rad_s), inverse.cast<Scalar>() * moment};
}

}  // namespace slew
