// Euler parameters q = (cos(theta/2), n sin(theta/2)), scalar first, and what they have to do with modified
// Rodrigues parameters.
#pragma once

#include "server/attitude/mrp.hpp"

namespace slew {

template <typename Scalar>
using Vector4 = Eigen::Matrix<Scalar, 4, 1>;

/// q' = 1/2 (-qv.w, q0 w + qv x w), 1/s.
template <typename Scalar>
Vector4<Scalar> euler_parameter_rate(const Vector4<Scalar>& q, const Vector3<Scalar>& rate_rad_s) {
  const Vector3<Scalar> v = q.template tail<3>();
  Vector4<Scalar> rate;
  rate[0] = -0.5 * v.dot(rate_rad_s);
  rate.template tail<3>() = 0.5 * (q[0] * rate_rad_s + v.cross(rate_rad_s));
  return rate;
}

/// Of norm 1.
template <typename Scalar>
Vector4<Scalar> euler_parameters(const Vector3<Scalar>& p) {
  const Scalar square = p.squaredNorm();
  Vector4<Scalar> q;
  q[0] = (1 - square) / (1 + square);
  q.template tail<3>() = 2 / (1 + square) * p;
  return q;
}

/// qv / (|q| + q0): |p| <= 1 where q0 >= 0, and beyond 1 where q0 < 0. Expects q0 > -|q|.
template <typename Scalar>
Vector3<Scalar> mrp(const Vector4<Scalar>& q) {
  using std::sqrt;
  const Scalar norm = sqrt(q.squaredNorm());
  return q.template tail<3>() / (norm + q[0]);
}

}  // namespace slew
