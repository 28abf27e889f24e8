#include "server/guidance/elastic_tracking.hpp"

#include <Eigen/Dense>

namespace slew {

using Eigen::Index;
using Eigen::VectorXd;

ElasticTracking elastic_tracking(const ReducedStructure& structure, double alpha_1_s, double beta_s,
                                 Index modes, double scale, RigidReference rigid) {
  const Index n = structure.elastic();
  const FreeModes free = free_modes(structure);
  VectorXd load = structure.tangential_load;
  load.head<6>().setZero();
  const VectorXd influence = structure.mass.ldlt().solve(load).tail(n);  // A_e
  ElasticTracking out;
  out.frequency_rad_s = free.frequency_rad_s.head(modes);
  out.damping_ratio = out.frequency_rad_s.unaryExpr(
      [&](double frequency_rad_s) { return damping_ratio(alpha_1_s, beta_s, frequency_rad_s); });
  out.input = scale * free.shapes.partialPivLu().solve(influence).head(modes);
  out.shapes = Eigen::MatrixXd::Zero(structure.size(), modes);
  if (rigid == RigidReference::natural) out.shapes.topRows<6>() = free.rigid.leftCols(modes);
  out.shapes.bottomRows(n) = free.shapes.leftCols(modes);
  return out;
}

}  // namespace slew
