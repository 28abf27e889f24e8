// A rigid body that is to be maneuvered: I w' = -w x I w + B u + M, q' = q w / 2 (Vadali, Singh & Carter
// 1993, Eqs. 1, 2, 5). Each u_i is bounded; M may hold a weight that hangs beside the pivot and a pedestal's
// springs.
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <optional>

#include "server/attitude/euler_angles.hpp"

namespace slew {

/// M_g = r x (-m g C1) (Eq. 3), where C1 is the vertical, axis 1 of the frame of reference, in body axes.
struct PivotWeight {
  double mass_kg = 0;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< r, from the pivot, body axes
  double gravity_m_s2 = 9.81;                          ///< not printed
};

/// M_s = -k_p (sin th3, cos th3, 0) (th2 - rest) - k_r (0, 0, 1) th3 (Eq. 4), th2 pitch and th3 roll of
/// Euler angles 1-2-3. Printed in N m; they are N m/rad. As printed it is not the gradient of an energy
/// unless k_r = 0.
struct PedestalSprings {
  double pitch_N_m_rad = 0;
  double roll_N_m_rad = 0;
  double pitch_at_rest_rad = -std::numbers::pi / 6;
};

struct RigidManeuverPlant {
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Identity();  ///< body axes; products with their minus
  /// B: column i is the torque at u_i = 1.
  Eigen::Matrix3Xd influence_N_m = Eigen::Matrix3d::Identity();
  Eigen::VectorXd least_control = Eigen::Vector3d::Constant(-1);
  Eigen::VectorXd most_control = Eigen::Vector3d::Constant(1);
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
  using std::cos;
  using std::sin;
  Vector3<Scalar> moment = Vector3<Scalar>::Constant(Scalar(0));
  if (plant.weight) {
    const Scalar &a = q[0], &b = q[1], &c = q[2], &d = q[3];
    const Vector3<Scalar> vertical(a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c));
    const Vector3<Scalar> arm = plant.weight->centre_m.cast<Scalar>();
    const Scalar weight(plant.weight->mass_kg * plant.weight->gravity_m_s2);
    const Vector3<Scalar> turning = arm.cross(vertical);
    for (int i = 0; i < 3; ++i) moment[i] -= weight * turning[i];
  }
  if (plant.springs) {
    const Vector3<Scalar> angles = euler_angles_123<Scalar>(q);
    const Scalar pitch = plant.springs->pitch_N_m_rad * (angles[1] - plant.springs->pitch_at_rest_rad);
    moment[0] -= pitch * sin(angles[2]);
    moment[1] -= pitch * cos(angles[2]);
    moment[2] -= plant.springs->roll_N_m_rad * angles[2];
  }
  return moment;
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
