// Quaternion feedback (Wie, Weiss & Arapostathis 1989): u = mu w x J w - D w - K qv with D = d J and K = k J,
// which with mu = 1 turns a body at rest about its eigenaxis.
#pragma once

#include "server/control/attitude_sight.hpp"

namespace slew {

struct QuaternionFeedback : AttitudeLawTraits {
  static constexpr const char* kType = "quaternion_feedback";

  double attitude_gain_1_s2 = 0.1;                              ///< k
  double rate_gain_1_s = 0.4;                                   ///< d
  double gyroscopic_compensation = 1;                           ///< mu, 0 to 1
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Identity();  ///< J, the law's belief

  template <typename Fields>
  void fields(Fields& fields) {
    fields("attitude_gain_1_s2", attitude_gain_1_s2);
    fields("rate_gain_1_s", rate_gain_1_s);
    fields("gyroscopic_compensation", gyroscopic_compensation);
    fields.inertia("inertia_kg_m2", inertia_kg_m2);
  }

  /// qv = 2 p / (1 + p.p). It leads to p = 0: the long way round where |p| > 1. Who wants the shorter one
  /// lets the plant replace p by its shadow.
  template <typename Scalar>
  AttitudeCommand<Scalar> command(const AttitudeSight<Scalar>& sight) const {
    const Vector3<Scalar>& w = sight.rate_rad_s;
    const Vector3<Scalar> momentum = inertia_kg_m2 * w;
    const Scalar factor = 2 * attitude_gain_1_s2 / (1 + sight.mrp.squaredNorm());
    const Vector3<Scalar> feedback = rate_gain_1_s * w + factor * sight.mrp;
    AttitudeCommand<Scalar> command;
    command.torque_N_m = gyroscopic_compensation * w.cross(momentum) - inertia_kg_m2 * feedback;
    return command;
  }
};

}  // namespace slew
