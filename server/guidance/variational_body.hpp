// A rigid body's motion together with what small changes of it do later. A change is (phi, dw): a rotation
// by the small vector phi about axes of the frame of reference, and a change of the rate. Then
//   phi' = C^T dw,   dw' = I^-1 ((I w) x dw - w x (I dw)) + I^-1 dM/dphi phi,
// so that without external moments a change of attitude alone stays what it is.
#pragma once

#include "server/attitude/dual.hpp"
#include "server/guidance/maneuver_problem.hpp"

namespace slew {

/// A plant with what is computed from it once.
struct ManeuverBody {
  explicit ManeuverBody(const RigidManeuverPlant& given)
      : plant(given),
        inverse(given.inertia_kg_m2.inverse()),
        acceleration_rad_s2(inverse * given.influence_N_m) {
    double stiffness = 0;
    if (given.weight)
      stiffness += given.weight->mass_kg * given.weight->gravity_m_s2 * given.weight->centre_m.norm();
    if (given.springs)
      stiffness += std::abs(given.springs->pitch_N_m_rad) + std::abs(given.springs->roll_N_m_rad);
    fastest_swing_1_s = std::sqrt(stiffness * inverse.norm());
    const double moment = given.inertia_kg_m2(0, 0);
    is_sphere = given.is_free() && given.inertia_kg_m2 == moment * Eigen::Matrix3d::Identity();
  }

  RigidManeuverPlant plant;
  Eigen::Matrix3d inverse;               ///< I^-1
  Eigen::Matrix3Xd acceleration_rad_s2;  ///< I^-1 B
  bool is_sphere = false;                ///< free, and all principal moments alike
  double fastest_swing_1_s;              ///< external moments let the body swing no faster than that
};

/// dM/dphi: by forward differentiation of the moment, q moving by phi q / 2.
inline Eigen::Matrix3d moment_sensitivity(const RigidManeuverPlant& plant, const Vector4<double>& q) {
  const Eigen::Matrix3d turned =
      0.5 * (q[0] * Eigen::Matrix3d::Identity() - cross_matrix<double>(q.tail<3>()));
  Vector4<Dual<3>> moved;
  moved[0] = {q[0], -0.5 * q.tail<3>()};
  for (int i = 0; i < 3; ++i) moved[i + 1] = {q[i + 1], turned.row(i).transpose()};
  const Vector3<Dual<3>> moment = external_moment<Dual<3>>(plant, moved);
  Eigen::Matrix3d sensitivity;
  for (int i = 0; i < 3; ++i) sensitivity.row(i) = moment[i].gradient.transpose();
  return sensitivity;
}

/// What moves (phi, dw) at one state.
struct VariationalRate {
  Eigen::Matrix3d turn;      ///< C^T: body axes to the frame of reference
  Eigen::Matrix3d rate;      ///< d(w')/dw
  Eigen::Matrix3d attitude;  ///< d(w')/dphi; zero for a free body
};

inline VariationalRate variational_rate(const ManeuverBody& body, const Vector4<double>& q,
                                        const Eigen::Vector3d& w) {
  VariationalRate rate;
  rate.turn = rotation_matrix_of<double>(q).transpose();
  const Eigen::Vector3d momentum = body.plant.inertia_kg_m2 * w;
  rate.rate =
      body.inverse * (cross_matrix<double>(momentum) - cross_matrix<double>(w) * body.plant.inertia_kg_m2);
  if (body.plant.is_free())
    rate.attitude.setZero();
  else
    rate.attitude = body.inverse * moment_sensitivity(body.plant, q);
  return rate;
}

/// How far a state is from another: 2 vec(conj(q_final) q) and w - w_final, and how small changes move that.
/// With Euler parameters alone one of which is left free (Eq. 13) the Jacobian is singular at 180 deg and a
/// wrong attitude may pass; so has the error none of both.
struct TerminalError {
  TerminalError(const RigidState& state, const RigidState& wanted) {
    const Vector4<double> e =
        euler_parameter_product<double>(euler_parameter_conjugate(wanted.attitude), state.attitude);
    value.head<3>() = 2 * e.tail<3>();
    value.tail<3>() = state.rate_rad_s - wanted.rate_rad_s;
    const Eigen::Vector3d v = e.tail<3>();
    attitude = (e[0] * Eigen::Matrix3d::Identity() - cross_matrix<double>(v)) *
               rotation_matrix_of<double>(wanted.attitude);
  }
  Eigen::Matrix<double, 6, 1> value;
  Eigen::Matrix3d attitude;  ///< d(value.head<3>())/dphi; of the rate it is 1
};

}  // namespace slew
