// Sliding mode control of attitude (Kim & Crassidis 1998, Eqs. 7-13): on the surface s = w - m(p) = 0 the
// attitude obeys p' = d(p), which is linear; u_eq keeps it there, and u_cr brings it there.
#pragma once

#include "server/control/attitude_sight.hpp"

namespace slew {

struct SlidingMode : AttitudeLawTraits {
  static constexpr const char* kType = "sliding_mode";
  static constexpr bool kHasSurface = true;
  static constexpr bool kTracks = true;

  /// The diagonals of Lambda, negative, and of K, positive, as Eqs. 9 and 12 want them; the text on the
  /// simulations prints the same two numbers as 0.3854 and -0.0421.
  Eigen::Vector3d lambda_1_s = Eigen::Vector3d::Constant(-0.3854);
  Eigen::Vector3d gain_rad_s2 = Eigen::Vector3d::Constant(0.0421);
  double boundary_layer_rad_s = 0.01;                           ///< epsilon, one for all axes
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Identity();  ///< J^, the law's belief

  template <typename Fields>
  void fields(Fields& fields) {
    fields("lambda_1_s", lambda_1_s);
    fields("gain_rad_s2", gain_rad_s2);
    fields("boundary_layer_rad_s", boundary_layer_rad_s);
    fields.inertia("inertia_kg_m2", inertia_kg_m2);
  }

  /// d = Lambda (p - p_d) + p_d', 1/s. Eq. 9 prints no p_d', without which p would lag what moves.
  template <typename Scalar>
  Vector3<Scalar> desired_mrp_rate(const Vector3<Scalar>& p, const MrpReference<Scalar>& reference) const {
    return lambda_1_s.cwiseProduct(p - reference.mrp) + reference.rate_1_s;
  }

  /// m = F^-1 d (Eq. 8), rad/s. With Lambda = lambda 1 and p_d = 0 it is 4 lambda p / (1 + p.p).
  template <typename Scalar>
  Vector3<Scalar> manifold(const Vector3<Scalar>& p, const MrpReference<Scalar>& reference) const {
    return rate_of_mrp_rate(p, desired_mrp_rate(p, reference));
  }

  /// m' along the motion, rad/s^2: what Eq. 11 calls (dm/dp) F (m + s), and what the reference adds to it.
  /// F m = d gives F m' = d' - F' m, and F' comes from p' = F w.
  template <typename Scalar>
  Vector3<Scalar> manifold_rate(const Vector3<Scalar>& p, const Vector3<Scalar>& rate_rad_s,
                                const MrpReference<Scalar>& reference, const Vector3<Scalar>& m) const {
    const Vector3<Scalar> v = mrp_rate(p, rate_rad_s);
    const Vector3<Scalar> desired_acceleration =
        lambda_1_s.cwiseProduct(v - reference.rate_1_s) + reference.acceleration_1_s2;
    const Vector3<Scalar> turning = 0.5 * (v.cross(m) + v.dot(m) * p + p.dot(m) * v - p.dot(v) * m);
    return rate_of_mrp_rate<Scalar>(p, desired_acceleration - turning);
  }

  template <typename Scalar>
  AttitudeCommand<Scalar> command(const AttitudeSight<Scalar>& sight) const {
    const Vector3<Scalar>& w = sight.rate_rad_s;
    const Vector3<Scalar> m = manifold(sight.mrp, sight.reference);
    const Vector3<Scalar> momentum = inertia_kg_m2 * w;
    AttitudeCommand<Scalar> command;
    command.surface_rad_s = w - m;                // Eq. 7
    command.equivalent_N_m = w.cross(momentum) +  // Eq. 11, with J^ for J
                             inertia_kg_m2 * manifold_rate(sight.mrp, w, sight.reference, m);
    const Vector3<Scalar> correction =
        gain_rad_s2.cwiseProduct(saturation(command.surface_rad_s, boundary_layer_rad_s));
    command.torque_N_m = command.equivalent_N_m - inertia_kg_m2 * correction;  // Eqs. 10 and 12, J^ again
    return command;
  }
};

/// dm/dp of a reference at rest in p_d = 0, rad/s. The law itself needs it along the motion only.
inline Eigen::Matrix3d manifold_gradient(const SlidingMode& law, const Eigen::Vector3d& p) {
  const double square = p.squaredNorm(), sum = 1 + square;
  const Eigen::Matrix3d a =
      (1 - square) * Eigen::Matrix3d::Identity() - 2 * cross_matrix(p) + 2 * p * p.transpose();
  const Eigen::Vector3d d = law.lambda_1_s.cwiseProduct(p);
  const Eigen::Matrix3d of_a_d =
      2 * (cross_matrix(d) + p.dot(d) * Eigen::Matrix3d::Identity() + p * d.transpose() - d * p.transpose());
  return 4 / (sum * sum) * (of_a_d + a * law.lambda_1_s.asDiagonal() - 4 / sum * a * d * p.transpose());
}

}  // namespace slew
