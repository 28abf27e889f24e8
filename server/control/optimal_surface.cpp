#include "server/control/optimal_surface.hpp"

#include <Eigen/Dense>
#include <stdexcept>

#include "server/estimation/algebraic_riccati.hpp"

namespace slew {

using Eigen::Index;
using Eigen::MatrixXd;

OptimalSurface optimal_surface(const MatrixXd& a, const MatrixXd& b, const MatrixXd& q) {
  const Index n = a.rows(), m = b.cols();
  const Eigen::ColPivHouseholderQR<MatrixXd> factored(b);
  if (m > n || factored.rank() < m)
    throw std::domain_error("actuators depend on each other: some combination of them moves nothing");
  const MatrixXd whole = factored.householderQ();
  const MatrixXd z2 = whole.leftCols(m), z1 = whole.rightCols(n - m);  // z = Z1 z1 + Z2 z2
  const MatrixXd a11 = z1.transpose() * a * z1, a12 = z1.transpose() * a * z2;
  const MatrixXd q11 = z1.transpose() * q * z1, q21 = z2.transpose() * q * z1;
  const Eigen::LDLT<MatrixXd> q22(z2.transpose() * q * z2);
  // z2 = -K z1, K = Q22^-1 (A12^T P + Q21), P of the problem without its cross term.
  const MatrixXd weighed = q22.solve(q21);
  const MatrixXd p = stabilising_solution(a11 - a12 * weighed, a12 * q22.solve(a12.transpose()),
                                          q11 - q21.transpose() * weighed);
  const MatrixXd k = q22.solve(a12.transpose() * p + q21);
  const MatrixXd gain = z2.transpose() + k * z1.transpose();
  return {(gain * b).partialPivLu().solve(gain), (a11 - a12 * k).eigenvalues()};
}

}  // namespace slew
