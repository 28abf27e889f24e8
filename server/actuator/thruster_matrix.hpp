// What thrusters do for each newton they give.
#pragma once

#include <Eigen/Core>
#include <span>

#include "server/actuator/thruster_set.hpp"

namespace slew {

/// 3 x n; its storage is inside, so that copies allocate nothing.
using ThrusterMatrix = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, int{kMaxThrusters}>;

/// Torque about the centre of mass for each newton of thrust, in m. Expects at most kMaxThrusters.
inline ThrusterMatrix torque_matrix_m(std::span<const Thruster> thrusters) {
  ThrusterMatrix matrix(3, static_cast<Eigen::Index>(thrusters.size()));
  for (Eigen::Index i = 0; i < matrix.cols(); ++i)
    matrix.col(i) = torque_N_m(thrusters[i]) / thrusters[i].thrust_N;
  return matrix;
}

/// Force for each newton of thrust: none of a pair without position.
inline ThrusterMatrix force_matrix(std::span<const Thruster> thrusters) {
  ThrusterMatrix matrix(3, static_cast<Eigen::Index>(thrusters.size()));
  for (Eigen::Index i = 0; i < matrix.cols(); ++i)
    matrix.col(i) = thrusters[i].couple_N_m ? Eigen::Vector3d::Zero() : thrusters[i].direction;
  return matrix;
}

}  // namespace slew
