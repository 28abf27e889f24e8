#include "server/estimation/algebraic_riccati.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <stdexcept>

namespace slew {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Throws where an eigenvalue is on the imaginary axis: there is no sign, and the iteration does not end.
MatrixXd matrix_sign(MatrixXd z) {
  constexpr int kMost = 60;
  const Index n = z.rows();
  for (int i = 0; i < kMost; ++i) {
    const Eigen::PartialPivLU<MatrixXd> factored(z);
    double log_determinant = 0;
    for (Index k = 0; k < n; ++k) log_determinant += std::log(std::abs(factored.matrixLU()(k, k)));
    if (!std::isfinite(log_determinant)) break;
    const double scale = i < 12 ? std::exp(-log_determinant / static_cast<double>(n)) : 1;
    const MatrixXd next = 0.5 * (scale * z + factored.inverse() / scale);
    const double change = (next - z).norm();
    z = next;
    if (!z.allFinite()) break;
    if (change < 1e-12 * z.norm()) return z;
    // Quadratic near the end: what is below this is squared by one step more.
    if (change < 1e-8 * z.norm()) {
      const MatrixXd last = 0.5 * (z + z.inverse());
      if (last.allFinite()) return last;
      break;
    }
  }
  throw std::domain_error("the Riccati equation has no stabilising solution");
}

}  // namespace

MatrixXd stabilising_solution(const MatrixXd& a, const MatrixXd& g, const MatrixXd& q) {
  const Index n = a.rows();
  MatrixXd hamiltonian(2 * n, 2 * n);
  hamiltonian << a, -g, -q, -a.transpose();
  const MatrixXd sign = matrix_sign(hamiltonian);
  // (sign + 1) [1; P] = 0: what is stable has the sign -1.
  MatrixXd left(2 * n, n), right(2 * n, n);
  left << sign.topRightCorner(n, n), sign.bottomRightCorner(n, n) + MatrixXd::Identity(n, n);
  right << sign.topLeftCorner(n, n) + MatrixXd::Identity(n, n), sign.bottomLeftCorner(n, n);
  const MatrixXd p = -left.colPivHouseholderQr().solve(right);
  const MatrixXd symmetric = 0.5 * (p + p.transpose());
  const MatrixXd closed = a - g * symmetric;
  if (!symmetric.allFinite() || !(riccati_residual(a, g, q, symmetric) < 1e-7) ||
      !(closed.eigenvalues().real().maxCoeff() < 0))
    throw std::domain_error("the Riccati equation has no stabilising solution");
  return symmetric;
}

double riccati_residual(const MatrixXd& a, const MatrixXd& g, const MatrixXd& q, const MatrixXd& p) {
  const MatrixXd linear = a.transpose() * p, square = p * g * p;
  const double size = 2 * linear.norm() + square.norm() + q.norm();
  return size > 0 ? (linear + linear.transpose() - square + q).norm() / size : 0;
}

}  // namespace slew
