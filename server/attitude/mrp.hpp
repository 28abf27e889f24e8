// Modified Rodrigues parameters p = n tan(theta/4) (Kim & Crassidis 1998, Eq. 1).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace slew {

template <typename Scalar>
using Vector3 = Eigen::Matrix<Scalar, 3, 1>;

/// p' = F(p) w with F = 1/4 {(1 - p.p) 1 + 2 [p x] + 2 p p^T} (Kim & Crassidis 1998, Eq. 2), 1/s.
template <typename Scalar>
Vector3<Scalar> mrp_rate(const Vector3<Scalar>& p, const Vector3<Scalar>& rate_rad_s) {
  const Scalar along = p.dot(rate_rad_s);
  return 0.25 * ((1 - p.squaredNorm()) * rate_rad_s + 2 * (p.cross(rate_rad_s) + along * p));
}

/// F^-1(p) v = 16 F^T v / (1 + p.p)^2: the rate that gives p' = v.
template <typename Scalar>
Vector3<Scalar> rate_of_mrp_rate(const Vector3<Scalar>& p, const Vector3<Scalar>& v) {
  const Scalar square = p.squaredNorm();
  const Scalar factor = 4 / ((1 + square) * (1 + square));
  return factor * ((1 - square) * v - 2 * p.cross(v) + 2 * p.dot(v) * p);
}

/// The other p of the same attitude: the rotation the long way round. Expects a p that is not zero.
template <typename Scalar>
Vector3<Scalar> mrp_shadow(const Vector3<Scalar>& p) {
  return -p / p.squaredNorm();
}

}  // namespace slew
