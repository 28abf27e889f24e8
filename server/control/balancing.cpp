#include "server/control/balancing.hpp"

#include <cmath>

namespace slew {

Balanced balance(Eigen::MatrixXd matrix) {
  const Eigen::Index n = matrix.rows();
  Balanced balanced{std::move(matrix), Eigen::VectorXd::Ones(n)};
  Eigen::MatrixXd& a = balanced.matrix;
  // A chain of integrators could be scaled for ever.
  constexpr int kMostSweeps = 64;
  bool is_changing = true;
  for (int sweep = 0; is_changing && sweep < kMostSweeps; ++sweep) {
    is_changing = false;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double column = a.col(i).cwiseAbs().sum() - std::abs(a(i, i));
      const double row = a.row(i).cwiseAbs().sum() - std::abs(a(i, i));
      if (!(column > 0) || !(row > 0) || !std::isfinite(column + row)) continue;
      const double factor = std::exp2(std::round(0.5 * std::log2(row / column)));
      if (column * factor + row / factor > 0.95 * (column + row)) continue;
      a.row(i) /= factor;
      a.col(i) *= factor;
      balanced.scale[i] *= factor;
      is_changing = true;
    }
  }
  return balanced;
}

}  // namespace slew
