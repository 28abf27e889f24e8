// What an attitude law sees, and what it answers. A law is one file: a struct that derives from
// AttitudeLawTraits and has
//   static constexpr const char* kType            the `type` of its block in a request
//   template <typename Fields> void fields(Fields&)    names its parameters: fields("gain_1_s", gain_1_s); a
//                                                 belief of the inertia, which is the plant's where it is
//                                                 left out: fields.inertia("inertia_kg_m2", inertia_kg_m2)
//   template <typename Scalar> AttitudeCommand<Scalar> command(const AttitudeSight<Scalar>&) const
// Parameters are of type double, Eigen::Vector3d or Eigen::Matrix3d, or std::vector<double>.
#pragma once

#include <limits>

#include "server/attitude/mrp.hpp"

namespace slew {

/// A reference p_d(t) with its derivatives. Zero: the final attitude.
template <typename Scalar>
struct MrpReference {
  Vector3<Scalar> mrp = Vector3<Scalar>::Zero();
  Vector3<Scalar> rate_1_s = Vector3<Scalar>::Zero();
  Vector3<Scalar> acceleration_1_s2 = Vector3<Scalar>::Zero();
};

template <typename Scalar>
struct AttitudeSight {
  Vector3<Scalar> mrp;         ///< of the body relative to the final attitude
  Vector3<Scalar> rate_rad_s;  ///< relative to inertial space, body axes
  MrpReference<Scalar> reference;
  /// When the present step of the loop began: laws that change with time change at the beginning of steps
  /// only, at the times that their next_change_s names.
  double step_began_s = 0;
  double t_s = 0;  ///< now
};

template <typename Scalar>
struct AttitudeCommand {
  Vector3<Scalar> torque_N_m = Vector3<Scalar>::Zero();  ///< all of it
  /// The part that keeps the motion on the sliding surface, where the law has one.
  Vector3<Scalar> equivalent_N_m = Vector3<Scalar>::Zero();
  Vector3<Scalar> surface_rad_s = Vector3<Scalar>::Zero();  ///< s, where the law has one
};

/// What most laws are: no surface, no moving reference, no time of their own.
struct AttitudeLawTraits {
  static constexpr bool kHasSurface = false;  ///< an observer of disturbances needs one
  static constexpr bool kTracks = false;      ///< follows a reference that moves
  static constexpr bool kIsProgram = false;   ///< needs no attitude and no sampling
  double next_change_s(double) const { return std::numeric_limits<double>::infinity(); }
};

/// sat(s, eps) (Kim & Crassidis 1998, Eq. 13, whose third case is s < -eps).
template <typename Scalar>
Vector3<Scalar> saturation(const Vector3<Scalar>& s, double boundary_layer) {
  return (s / boundary_layer).cwiseMax(-1.0).cwiseMin(1.0);
}

}  // namespace slew
