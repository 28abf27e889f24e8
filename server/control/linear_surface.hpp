// Sliding mode control on a surface that is linear in the attitude, s = w + L p:
//   u = w x J w - J L p' - K sat(s / phi).
#pragma once

#include "server/control/attitude_sight.hpp"

namespace slew {

struct LinearSurface : AttitudeLawTraits {
  static constexpr const char* kType = "linear_surface";
  static constexpr bool kHasSurface = true;

  Eigen::Vector3d slope_1_s = Eigen::Vector3d::Constant(0.4);   ///< the diagonal of L, positive
  Eigen::Vector3d gain_N_m = Eigen::Vector3d::Constant(2);      ///< the diagonal of K, positive
  double boundary_layer_rad_s = 0.02;                           ///< phi, one for all axes
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Identity();  ///< J, the law's belief

  template <typename Fields>
  void fields(Fields& fields) {
    fields("slope_1_s", slope_1_s);
    fields("gain_N_m", gain_N_m);
    fields("boundary_layer_rad_s", boundary_layer_rad_s);
    fields.inertia("inertia_kg_m2", inertia_kg_m2);
  }

  template <typename Scalar>
  AttitudeCommand<Scalar> command(const AttitudeSight<Scalar>& sight) const {
    const Vector3<Scalar>& w = sight.rate_rad_s;
    const Vector3<Scalar> momentum = inertia_kg_m2 * w;
    const Vector3<Scalar> braking = slope_1_s.cwiseProduct(mrp_rate(sight.mrp, w));
    AttitudeCommand<Scalar> command;
    command.surface_rad_s = w + slope_1_s.cwiseProduct(sight.mrp);
    command.equivalent_N_m = w.cross(momentum) - inertia_kg_m2 * braking;
    command.torque_N_m = command.equivalent_N_m -
                         gain_N_m.cwiseProduct(saturation(command.surface_rad_s, boundary_layer_rad_s));
    return command;
  }
};

}  // namespace slew
