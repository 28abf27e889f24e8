// A^T P + P A - P G P + Q = 0, the solution for which A - G P is stable, by the matrix sign function of the
// Hamiltonian matrix (Roberts 1980): Newton's iteration Z <- (c Z + (c Z)^-1)/2 with determinants as scale
// (Byers 1987), by Eigen's LU, and P from the null space of sign(H) + 1 by its QR.
#pragma once

#include <Eigen/Core>

namespace slew {

/// G and Q symmetric, positive semidefinite. Throws std::domain_error when there is no stabilising solution.
Eigen::MatrixXd stabilising_solution(const Eigen::MatrixXd& a, const Eigen::MatrixXd& g,
                                     const Eigen::MatrixXd& q);

/// A^T P + P A - P G P + Q over the size of its terms.
double riccati_residual(const Eigen::MatrixXd& a, const Eigen::MatrixXd& g, const Eigen::MatrixXd& q,
                        const Eigen::MatrixXd& p);

}  // namespace slew
