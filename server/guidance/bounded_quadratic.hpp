// min 1/2 x'Qx + g'x with A x = b and least <= x <= most, by Mehrotra's predictor and corrector (1992, SIAM
// J. Optim. 2, 575-601).
#pragma once

#include <Eigen/Core>
#include <optional>

namespace slew {

struct BoundedQuadratic {
  Eigen::MatrixXd curvature;    ///< Q, positive definite
  Eigen::VectorXd slope;        ///< g
  Eigen::MatrixXd equal_slope;  ///< A
  Eigen::VectorXd equal;        ///< b
  Eigen::VectorXd least, most;  ///< finite; least < most
};

struct QuadraticSolution {
  Eigen::VectorXd at;
  Eigen::VectorXd multipliers;  ///< y of A: Qx + g + A'y is zero but for the bounds
};

/// Nothing where it does not converge, as where no x meets everything.
std::optional<QuadraticSolution> solve(const BoundedQuadratic& program);

}  // namespace slew
