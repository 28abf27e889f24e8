// A rigid spacecraft in three axes: J w' = -w x J w + T (Kim & Crassidis 1998, Eq. 4, whose [J w x] w is
// -w x J w), its attitude in modified Rodrigues parameters or in Euler parameters.
#pragma once

#include <optional>

#include "server/plant/pedestal.hpp"

namespace slew {

enum class AttitudeParameters { mrp, euler_parameters };

struct RigidBodyPlant {
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Identity();  ///< about the centre of mass, body axes
  AttitudeParameters attitude = AttitudeParameters::mrp;
  /// Modified Rodrigues parameters are replaced by their shadow where |p| grows beyond this; empty: never.
  /// More than 1, so that a rotation of exactly 180 deg does not flip at once.
  std::optional<double> shadow_switch_norm;
  std::optional<PivotWeight> weight;  ///< then the inertia is about the pivot
  std::optional<PedestalSprings> springs;

  bool is_free() const { return !weight && !springs; }
  /// External moments let the body swing no faster than that, rad/s.
  double fastest_swing_rad_s() const {
    double stiffness = 0;
    if (weight) stiffness += std::abs(weight->mass_kg * weight->gravity_m_s2) * weight->centre_m.norm();
    if (springs) stiffness += std::abs(springs->pitch_N_m_rad) + std::abs(springs->roll_N_m_rad);
    return std::sqrt(stiffness * inertia_kg_m2.inverse().norm());
  }
};

/// w', rad/s^2. `inverse` is J^-1.
template <typename Scalar>
Vector3<Scalar> angular_acceleration(const Eigen::Matrix3d& inertia, const Eigen::Matrix3d& inverse,
                                     const Vector3<Scalar>& rate_rad_s, const Vector3<Scalar>& torque_N_m) {
  const Vector3<Scalar> momentum = inertia * rate_rad_s;
  return inverse * (torque_N_m + momentum.cross(rate_rad_s));
}

}  // namespace slew
