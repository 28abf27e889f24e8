#include "server/estimation/elastic_filter.hpp"

#include "server/estimation/algebraic_riccati.hpp"

namespace slew {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd ElasticFilter::initial_covariance() const {
  return intensities.initial_covariance * MatrixXd::Identity(size(), size());
}

void ElasticFilter::covariance_rate(const MatrixXd& covariance, MatrixXd& rate) const {
  const MatrixXd propagated = state * covariance;
  const MatrixXd seen = covariance * output.transpose();
  rate = propagated + propagated.transpose() + process - seen * seen.transpose() / intensities.measurement;
}

ElasticFilter elastic_filter(const StructureDynamics& design, const MatrixXd& output,
                             const FilterIntensities& intensities) {
  const Index n = design.size() - 6;
  ElasticFilter out;
  out.state = MatrixXd::Zero(2 * n, 2 * n);
  out.state.topRightCorner(n, n).setIdentity();
  out.state.bottomLeftCorner(n, n) = -design.stiffness.bottomRightCorner(n, n);
  out.state.bottomRightCorner(n, n) = -design.damping.bottomRightCorner(n, n);
  out.output = output;
  out.process = MatrixXd::Zero(2 * n, 2 * n);
  out.process.bottomRightCorner(n, n) = intensities.process * MatrixXd::Identity(n, n);
  out.intensities = intensities;
  return out;
}

// The dual of the regulator's equation.
MatrixXd steady_covariance(const ElasticFilter& filter) {
  return stabilising_solution(filter.state.transpose(),
                              filter.output.transpose() * filter.output / filter.intensities.measurement,
                              filter.process);
}

MatrixXd steady_filter(const ElasticFilter& filter) {
  return filter.state - steady_covariance(filter) * filter.output.transpose() * filter.output /
                            filter.intensities.measurement;
}

}  // namespace slew
