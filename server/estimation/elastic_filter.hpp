// The Kalman filter of the elastic states, the hub's being measured exactly (Sung, Lee & Kim 2001, Eq. 15):
//   z^' = A z^ + B u + L (y - C z^) + D,   L = P C^T / Qm,   P' = A P + P A^T + Qp G G^T - P C^T C P / Qm,
// z = [z_f; z_f'], G = [0; 1]: noise of intensity Qp on the acceleration of every elastic coordinate, which
// has a meaning because the basis is orthonormal in the mass.
#pragma once

#include "server/plant/structure_dynamics.hpp"

namespace slew {

struct FilterIntensities {
  double process = 1e-3;          ///< Qp
  double measurement = 1e-4;      ///< Qm
  double initial_covariance = 0;  ///< P(0) over the identity; 0: the structure is known to be at rest
};

struct ElasticFilter {
  Eigen::MatrixXd state;    ///< A
  Eigen::MatrixXd output;   ///< C
  Eigen::MatrixXd process;  ///< Qp G G^T
  FilterIntensities intensities;

  Eigen::Index size() const { return state.rows(); }
  Eigen::Index sensors() const { return output.rows(); }
  Eigen::MatrixXd initial_covariance() const;
  /// P' of P.
  void covariance_rate(const Eigen::MatrixXd& covariance, Eigen::MatrixXd& rate) const;
};

/// `output`: what the sensors see of [z_f; z_f'].
ElasticFilter elastic_filter(const StructureDynamics& design, const Eigen::MatrixXd& output,
                             const FilterIntensities& intensities);

/// The covariance at which the filter stands still. Throws std::domain_error when there is none.
Eigen::MatrixXd steady_covariance(const ElasticFilter& filter);
/// A - L C of it.
Eigen::MatrixXd steady_filter(const ElasticFilter& filter);

}  // namespace slew
