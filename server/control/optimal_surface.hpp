// The sliding surface G z = 0 on which the integral of z^T Q z is least (Utkin & Young 1978): in coordinates
// with B = [0; B2] it is a linear-quadratic problem for z1 with z2 as its input. Scaled so that G B = 1.
#pragma once

#include <Eigen/Core>

namespace slew {

struct OptimalSurface {
  Eigen::MatrixXd gain;                  ///< G, one row for each input
  Eigen::VectorXcd sliding_eigenvalues;  ///< of the motion on it: as many as states less inputs
};

/// Q symmetric, positive semidefinite, positive definite on the inputs' range. Throws std::domain_error with
/// a sentence where inputs depend on each other, or where nothing on the surface can be made stable.
OptimalSurface optimal_surface(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, const Eigen::MatrixXd& q);

}  // namespace slew
