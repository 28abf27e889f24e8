// A matrix in units of its own: a diagonal similarity that brings rows and columns to like size (Parlett &
// Reinsch 1969). Powers of two only, so that nothing is rounded.
#pragma once

#include <Eigen/Core>

namespace slew {

/// S^-1 A S and the diagonal of S: x = S y.
struct Balanced {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd scale;
};

Balanced balance(Eigen::MatrixXd matrix);

}  // namespace slew
