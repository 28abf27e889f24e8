// Rotations one after the other, and rotation vectors theta n, for modified Rodrigues parameters.
#pragma once

#include <cmath>

#include "server/attitude/mrp.hpp"

namespace slew {

/// The attitude p turned further by s, which is told in body axes: the product of their Euler parameters; to
/// first order in s it is p + 4 F(p) s. As s goes to zero it is p, also for |p| > 1: never the shadow.
template <typename Scalar>
Vector3<Scalar> turned_further(const Vector3<Scalar>& p, const Vector3<Scalar>& s) {
  const Scalar p_square = p.squaredNorm(), s_square = s.squaredNorm();
  return ((1 - s_square) * p + (1 - p_square) * s + 2 * p.cross(s)) /
         (1 + p_square * s_square - 2 * p.dot(s));
}

/// theta n of p = n tan(theta/4), in rad: shorter than 2 pi, longer than pi where |p| > 1.
template <typename Scalar>
Vector3<Scalar> rotation_vector(const Vector3<Scalar>& p) {
  using std::atan;
  const Scalar size = p.norm();
  return size > 0 ? Vector3<Scalar>(4 * atan(size) / size * p) : Vector3<Scalar>(4 * p);
}

/// n tan(theta/4). Expects a vector shorter than 2 pi.
template <typename Scalar>
Vector3<Scalar> mrp_of_rotation_vector(const Vector3<Scalar>& theta_rad) {
  using std::tan;
  const Scalar angle = theta_rad.norm();
  return angle > 0 ? Vector3<Scalar>(tan(0.25 * angle) / angle * theta_rad)
                   : Vector3<Scalar>(0.25 * theta_rad);
}

}  // namespace slew
