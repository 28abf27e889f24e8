// What holds a body that stands on the ground (Vadali, Singh & Carter 1993, Eqs. 3-5): a pivot beside its
// mass centre, and a pedestal with springs.
#pragma once

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

/// M_g + M_s, N m, body axes; q from the frame whose axis 1 is the vertical.
template <typename Scalar>
Vector3<Scalar> pedestal_moment(const std::optional<PivotWeight>& weight,
                                const std::optional<PedestalSprings>& springs, const Vector4<Scalar>& q) {
  using std::cos;
  using std::sin;
  Vector3<Scalar> moment = Vector3<Scalar>::Constant(Scalar(0));
  if (weight) {
    const Scalar &a = q[0], &b = q[1], &c = q[2], &d = q[3];
    const Vector3<Scalar> vertical(a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c));
    const Vector3<Scalar> arm = weight->centre_m.cast<Scalar>();
    const Scalar newtons(weight->mass_kg * weight->gravity_m_s2);
    const Vector3<Scalar> turning = arm.cross(vertical);
    for (int i = 0; i < 3; ++i) moment[i] -= newtons * turning[i];
  }
  if (springs) {
    const Vector3<Scalar> angles = euler_angles_123<Scalar>(q);
    const Scalar pitch = springs->pitch_N_m_rad * (angles[1] - springs->pitch_at_rest_rad);
    moment[0] -= pitch * sin(angles[2]);
    moment[1] -= pitch * cos(angles[2]);
    moment[2] -= springs->roll_N_m_rad * angles[2];
  }
  return moment;
}

}  // namespace slew
