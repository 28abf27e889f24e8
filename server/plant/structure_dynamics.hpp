// A structure that slews, solved for its accelerations (Sung, Lee & Kim 2001, Eq. 8, with C = alpha M + beta
// K):
//   z'' = -(K + theta'' Ka + theta'^2 Kw) z - (C + theta' G1) z' + B u - fa theta'' - fw theta'^2,
// each matrix here with M^-1 before it.
#pragma once

#include "server/structure/reduction.hpp"

namespace slew {

/// What is given to the hub besides the controls.
enum class ZeroOrderLoads {
  all,              ///< every force and moment that the rigid slew takes (Eqs. 18 to 20)
  about_axis_only,  ///< the torque about the slew's axis: what else it would take disturbs
};

struct StructureDynamics {
  Eigen::MatrixXd stiffness, damping, gyroscopic, tangential, centrifugal;
  Eigen::MatrixXd input;  ///< B, one column for each actuator
  Eigen::VectorXd tangential_load, centrifugal_load;

  Eigen::Index size() const { return stiffness.rows(); }
  Eigen::Index inputs() const { return input.cols(); }
  /// A and B of z, z' without what the slew adds.
  Eigen::MatrixXd state_matrix() const;
  Eigen::MatrixXd input_matrix() const;
};

/// `inputs`: generalized loads of unit controls over the structure's x, one column each.
StructureDynamics structure_dynamics(const ReducedStructure& structure, double alpha_1_s, double beta_s,
                                     const Eigen::MatrixXd& inputs, ZeroOrderLoads loads);

}  // namespace slew
