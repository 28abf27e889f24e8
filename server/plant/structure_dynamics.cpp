#include "server/plant/structure_dynamics.hpp"

#include <Eigen/Cholesky>

namespace slew {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

// What the zero-order loads leave of what holds every coordinate on the rigid slew.
VectorXd left_over(const VectorXd& load, const Vector3d& axis, ZeroOrderLoads given) {
  VectorXd left = load;
  const Vector3d moment = load.segment<3>(3);
  if (given == ZeroOrderLoads::all)
    left.head<6>().setZero();
  else
    left.segment<3>(3) = moment - axis.dot(moment) * axis;
  return left;
}

}  // namespace

MatrixXd StructureDynamics::state_matrix() const {
  const Index n = size();
  MatrixXd a = MatrixXd::Zero(2 * n, 2 * n);
  a.topRightCorner(n, n).setIdentity();
  a.bottomLeftCorner(n, n) = -stiffness;
  a.bottomRightCorner(n, n) = -damping;
  return a;
}

MatrixXd StructureDynamics::input_matrix() const {
  MatrixXd b = MatrixXd::Zero(2 * size(), inputs());
  b.bottomRows(size()) = input;
  return b;
}

StructureDynamics structure_dynamics(const ReducedStructure& structure, double alpha_1_s, double beta_s,
                                     const MatrixXd& inputs, ZeroOrderLoads loads) {
  const Eigen::LDLT<MatrixXd> mass(structure.mass);
  StructureDynamics out;
  out.stiffness = mass.solve(structure.stiffness);
  out.damping = beta_s * out.stiffness;
  out.damping.diagonal().array() += alpha_1_s;
  out.gyroscopic = mass.solve(structure.gyroscopic);
  out.tangential = mass.solve(structure.tangential);
  out.centrifugal = mass.solve(structure.centrifugal);
  // Eigen solves for no right side at all by a reference to nothing.
  out.input = Eigen::MatrixXd(structure.size(), inputs.cols());
  if (inputs.cols() > 0) out.input = mass.solve(structure.basis.transpose() * inputs);
  out.tangential_load = mass.solve(left_over(structure.tangential_load, structure.axis, loads));
  out.centrifugal_load = mass.solve(left_over(structure.centrifugal_load, structure.axis, loads));
  return out;
}

}  // namespace slew
