#include "server/guidance/bounded_quadratic.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace slew {

namespace {

// The longest part of a step that keeps what is positive positive.
double longest(const Eigen::VectorXd& value, const Eigen::VectorXd& step) {
  double part = 1;
  for (Eigen::Index j = 0; j < value.size(); ++j)
    if (step[j] < 0) part = std::min(part, -value[j] / step[j]);
  return part;
}

}  // namespace

std::optional<QuadraticSolution> solve(const BoundedQuadratic& program) {
  constexpr int kMostIterations = 60;
  constexpr double kTolerance = 1e-12;
  const Eigen::Index n = program.slope.size(), m = program.equal.size();
  const Eigen::VectorXd width = program.most - program.least;
  Eigen::VectorXd x = program.least + 0.5 * width;
  Eigen::VectorXd y = Eigen::VectorXd::Zero(m);
  // Of the lower and of the upper bounds.
  const double scale = std::max(1e-3, program.slope.lpNorm<Eigen::Infinity>());
  Eigen::VectorXd zl = Eigen::VectorXd::Constant(n, scale), zu = zl;
  Eigen::MatrixXd kkt(n + m, n + m);
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const Eigen::VectorXd low = x - program.least, high = program.most - x;
    const Eigen::VectorXd dual =
        program.curvature * x + program.slope + program.equal_slope.transpose() * y - zl + zu;
    const Eigen::VectorXd primal = program.equal_slope * x - program.equal;
    const double gap = (low.dot(zl) + high.dot(zu)) / (2 * static_cast<double>(n));
    if (gap < kTolerance * scale && dual.lpNorm<Eigen::Infinity>() < 1e-9 * scale &&
        primal.lpNorm<Eigen::Infinity>() < 1e-10)
      return QuadraticSolution{x, y};
    kkt.setZero();
    kkt.topLeftCorner(n, n) = program.curvature;
    kkt.topLeftCorner(n, n).diagonal() += zl.cwiseQuotient(low) + zu.cwiseQuotient(high);
    kkt.topRightCorner(n, m) = program.equal_slope.transpose();
    kkt.bottomLeftCorner(m, n) = program.equal_slope;
    const Eigen::PartialPivLU<Eigen::MatrixXd> factors(kkt);
    Eigen::VectorXd dx, dy, dl, du;
    // low zl = tl and high zu = tu are wanted.
    const auto step = [&](const Eigen::VectorXd& tl, const Eigen::VectorXd& tu) {
      Eigen::VectorXd right(n + m);
      right << -dual + (tl - low.cwiseProduct(zl)).cwiseQuotient(low) -
                   (tu - high.cwiseProduct(zu)).cwiseQuotient(high),
          -primal;
      const Eigen::VectorXd both = factors.solve(right);
      dx = both.head(n), dy = both.tail(m);
      dl = (tl - low.cwiseProduct(zl) - zl.cwiseProduct(dx)).cwiseQuotient(low);
      du = (tu - high.cwiseProduct(zu) + zu.cwiseProduct(dx)).cwiseQuotient(high);
    };
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(n);
    step(none, none);
    const double primal_part = std::min(longest(low, dx), longest(high, -dx));
    const double dual_part = std::min(longest(zl, dl), longest(zu, du));
    const double predicted = ((low + primal_part * dx).dot(zl + dual_part * dl) +
                              (high - primal_part * dx).dot(zu + dual_part * du)) /
                             (2 * static_cast<double>(n));
    const double centre = std::pow(predicted / gap, 3) * gap;
    const Eigen::VectorXd tl = Eigen::VectorXd::Constant(n, centre) - dx.cwiseProduct(dl);
    const Eigen::VectorXd tu = Eigen::VectorXd::Constant(n, centre) + dx.cwiseProduct(du);
    step(tl, tu);
    if (!dx.allFinite() || !dl.allFinite() || !du.allFinite()) return std::nullopt;
    constexpr double kShort = 0.995;
    const double part = kShort * std::min({1 / kShort, longest(low, dx), longest(high, -dx), longest(zl, dl),
                                           longest(zu, du)});
    x += part * dx;
    y += part * dy;
    zl += part * dl;
    zu += part * du;
  }
  return std::nullopt;
}

}  // namespace slew
