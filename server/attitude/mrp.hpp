// Modified Rodrigues parameters p = n tan(theta/4) (Kim & Crassidis 1998, Eq. 1).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

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

/// [a x], so that [a x] b = a x b (Kim & Crassidis 1998, Eq. 3).
template <typename Scalar>
Eigen::Matrix<Scalar, 3, 3> cross_matrix(const Vector3<Scalar>& a) {
  Eigen::Matrix<Scalar, 3, 3> matrix;
  matrix << Scalar(0), -a[2], a[1], a[2], Scalar(0), -a[0], -a[1], a[0], Scalar(0);
  return matrix;
}

/// C = 1 + (8 [p x]^2 - 4 (1 - p.p) [p x]) / (1 + p.p)^2: takes components in the frame of reference into
/// body axes, C' = -[w x] C.
template <typename Scalar>
Eigen::Matrix<Scalar, 3, 3> rotation_matrix(const Vector3<Scalar>& p) {
  const Scalar square = p.squaredNorm();
  const Scalar factor = 4 / ((1 + square) * (1 + square));
  const Eigen::Matrix<Scalar, 3, 3> cross = cross_matrix(p);
  return Eigen::Matrix<Scalar, 3, 3>::Identity() + factor * (2 * (cross * cross) - (1 - square) * cross);
}

/// One rotation after another, the second about axes that the first has turned: C = C(second) C(first).
/// Expects that they do not make a full turn together.
template <typename Scalar>
Vector3<Scalar> mrp_product(const Vector3<Scalar>& first, const Vector3<Scalar>& second) {
  const Scalar a = first.squaredNorm(), b = second.squaredNorm();
  return ((1 - a) * second + (1 - b) * first + 2 * first.cross(second)) / (1 + a * b - 2 * first.dot(second));
}

/// The angle of the rotation, the shorter way round: 0 to pi.
inline double rotation_angle_rad(const Vector3<double>& p) {
  const double norm = p.norm();
  return 4 * std::atan(norm <= 1 ? norm : 1 / norm);
}

}  // namespace slew
