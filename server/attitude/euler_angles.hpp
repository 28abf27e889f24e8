// Euler angles 1-2-3 (yaw about axis 1, pitch about 2, roll about 3, each about axes that the ones before
// have turned) and Euler parameters, scalar first: q = q1(yaw) q2(pitch) q3(roll).
#pragma once

#include <cmath>

#include "server/attitude/euler_parameters.hpp"

namespace slew {

/// The product of Euler parameters: first a, then b about axes that a has turned.
template <typename Scalar>
Vector4<Scalar> euler_parameter_product(const Vector4<Scalar>& a, const Vector4<Scalar>& b) {
  const Vector3<Scalar> u = a.template tail<3>(), v = b.template tail<3>();
  Vector4<Scalar> product;
  product[0] = a[0] * b[0] - u.dot(v);
  product.template tail<3>() = a[0] * v + b[0] * u + u.cross(v);
  return product;
}

template <typename Scalar>
Vector4<Scalar> euler_parameter_conjugate(const Vector4<Scalar>& q) {
  return {q[0], -q[1], -q[2], -q[3]};
}

/// C(q) with C' = -[w x] C: takes components in the frame of reference into body axes. Expects norm 1.
template <typename Scalar>
Eigen::Matrix<Scalar, 3, 3> rotation_matrix_of(const Vector4<Scalar>& q) {
  const Scalar &a = q[0], &b = q[1], &c = q[2], &d = q[3];
  Eigen::Matrix<Scalar, 3, 3> m;
  m << a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c),  //
      2 * (b * c - a * d), a * a - b * b + c * c - d * d, 2 * (c * d + a * b),   //
      2 * (b * d + a * c), 2 * (c * d - a * b), a * a - b * b - c * c + d * d;
  return m;
}

/// theta about n of length 1.
inline Vector4<double> euler_parameters_about(const Vector3<double>& axis, double angle_rad) {
  Vector4<double> q;
  q[0] = std::cos(0.5 * angle_rad);
  q.tail<3>() = std::sin(0.5 * angle_rad) * axis;
  return q;
}

inline Vector4<double> euler_parameters_of_angles(const Vector3<double>& yaw_pitch_roll_rad) {
  const Vector4<double> yaw = euler_parameters_about(Vector3<double>::UnitX(), yaw_pitch_roll_rad[0]);
  const Vector4<double> pitch = euler_parameters_about(Vector3<double>::UnitY(), yaw_pitch_roll_rad[1]);
  const Vector4<double> roll = euler_parameters_about(Vector3<double>::UnitZ(), yaw_pitch_roll_rad[2]);
  return euler_parameter_product<double>(euler_parameter_product<double>(yaw, pitch), roll);
}

/// Pitch in [-pi/2, pi/2], the others in (-pi, pi]. Yaw and roll are not told apart where pitch is +-pi/2.
template <typename Scalar>
Vector3<Scalar> euler_angles_123(const Vector4<Scalar>& q) {
  using std::atan2;
  using std::sqrt;
  const Eigen::Matrix<Scalar, 3, 3> c = rotation_matrix_of(q);
  return {atan2(-c(2, 1), c(2, 2)), atan2(c(2, 0), sqrt(c(0, 0) * c(0, 0) + c(1, 0) * c(1, 0))),
          atan2(-c(1, 0), c(0, 0))};
}

}  // namespace slew
