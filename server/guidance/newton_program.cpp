#include "server/guidance/newton_program.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "server/guidance/bounded_quadratic.hpp"

namespace slew {

namespace {

// What a constraint that is to be positive may have left.
constexpr double kMostSlack = 1e3;
// Of the largest curvature: along a direction that has less it is taken for so much.
constexpr double kLeastCurvature = 1e-10;

double violation_of(const NonlinearValues& values) {
  double violation = values.equal.lpNorm<Eigen::Infinity>();
  if (values.positive.size() > 0) violation = std::max(violation, -values.positive.minCoeff());
  return violation;
}

// About a point: the step, and slacks of what is to be positive.
BoundedQuadratic linearized(const NonlinearProgram& program, const NonlinearValues& values,
                            const Eigen::VectorXd& at, const Eigen::VectorXd& reach) {
  const Eigen::Index n = at.size(), e = values.equal.size(), p = values.positive.size();
  BoundedQuadratic quadratic;
  quadratic.slope = Eigen::VectorXd::Zero(n + p);
  quadratic.curvature = Eigen::MatrixXd::Zero(n + p, n + p);
  quadratic.equal_slope = Eigen::MatrixXd::Zero(e + p, n + p);
  quadratic.equal_slope.topLeftCorner(e, n) = values.equal_slope;
  quadratic.equal_slope.bottomLeftCorner(p, n) = values.positive_slope;
  quadratic.equal_slope.bottomRightCorner(p, p) = -Eigen::MatrixXd::Identity(p, p);
  quadratic.equal.resize(e + p);
  quadratic.equal << -values.equal, -values.positive;
  quadratic.least.resize(n + p);
  quadratic.most.resize(n + p);
  quadratic.least << (program.least - at).cwiseMax(-reach), Eigen::VectorXd::Zero(p);
  quadratic.most << (program.most - at).cwiseMin(reach), Eigen::VectorXd::Constant(p, kMostSlack);
  // Where the point is at a bound, or beyond by rounding, something must be left between the two.
  quadratic.most = quadratic.most.cwiseMax(quadratic.least + Eigen::VectorXd::Constant(n + p, 1e-14));
  return quadratic;
}

// To the nearest point that meets the constraints. False where there is none near.
bool meet(const NonlinearProgram& program, const Eigen::VectorXd& reach, double met, Eigen::VectorXd& at,
          NonlinearValues& values, int& evaluations) {
  constexpr int kMostSteps = 6;
  for (int step = 0; step < kMostSteps && violation_of(values) > met; ++step) {
    BoundedQuadratic nearest = linearized(program, values, at, reach);
    const Eigen::Index n = at.size();
    nearest.curvature.diagonal().head(n) = reach.cwiseAbs2().cwiseInverse();
    nearest.curvature.diagonal().tail(nearest.slope.size() - n).setConstant(1e-8);
    const auto found = solve(nearest);
    if (!found) return false;
    at = (at + found->at.head(n)).cwiseMax(program.least).cwiseMin(program.most);
    program.evaluate(at, values);
    ++evaluations;
  }
  return violation_of(values) <= met;
}

// Of the Lagrangian, made positive: along the constraints, where steps go, by taking sizes.
Eigen::MatrixXd positive_curvature(const Eigen::MatrixXd& curvature, const Eigen::MatrixXd& slope) {
  const Eigen::Index n = curvature.rows();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(slope.transpose());
  const Eigen::Index rank = factors.rank();
  const Eigen::MatrixXd basis = factors.householderQ() * Eigen::MatrixXd::Identity(n, n);
  const auto across = basis.leftCols(rank), along = basis.rightCols(n - rank);
  const Eigen::MatrixXd reduced = along.transpose() * curvature * along;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(0.5 * (reduced + reduced.transpose()));
  const double size = std::max(eigen.eigenvalues().cwiseAbs().maxCoeff(), 1e-6);
  const Eigen::VectorXd sizes = eigen.eigenvalues().cwiseAbs().cwiseMax(kLeastCurvature * size);
  const Eigen::MatrixXd vectors = along * eigen.eigenvectors();
  return vectors * sizes.asDiagonal() * vectors.transpose() + size * (across * across.transpose());
}

}  // namespace

SequentialResult minimize_by_newton(const NonlinearProgram& program, const Eigen::VectorXd& start,
                                    const NewtonOptions& options) {
  SequentialResult result;
  const Eigen::Index n = start.size();
  Eigen::VectorXd z = start.cwiseMax(program.least).cwiseMin(program.most);
  NonlinearValues values, moved;
  program.evaluate(z, values);
  ++result.evaluations;
  const bool is_met = meet(program, options.reach, options.met, z, values, result.evaluations);
  result.at = z;
  result.violation = violation_of(values);
  if (!is_met) return result;
  Eigen::VectorXd multipliers;
  double part = 1;
  for (int iteration = 0; iteration < options.most_iterations; ++iteration) {
    if (options.keep_going && !options.keep_going()) {
      result.was_stopped = true;
      break;
    }
    const Eigen::Index e = values.equal.size(), p = values.positive.size();
    const auto quadratic_of = [&](const Eigen::MatrixXd& curvature) {
      BoundedQuadratic quadratic = linearized(program, values, z, part * options.reach);
      quadratic.slope.head(n) = values.slope;
      quadratic.curvature.topLeftCorner(n, n) = curvature;
      quadratic.curvature.diagonal().tail(p).setConstant(1e-8);
      return quadratic;
    };
    if (multipliers.size() == 0) {
      const auto first = solve(quadratic_of(options.reach.cwiseAbs2().cwiseInverse().asDiagonal()));
      if (!first) break;
      multipliers = first->multipliers;
    }
    Eigen::MatrixXd curvature(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      // Inwards, where the bound is near.
      const double step = z[j] + options.steps[j] <= program.most[j] ? options.steps[j] : -options.steps[j];
      program.evaluate(z + step * Eigen::VectorXd::Unit(n, j), moved);
      ++result.evaluations;
      curvature.col(j) = ((moved.equal_slope - values.equal_slope).transpose() * multipliers.head(e) +
                          (moved.positive_slope - values.positive_slope).transpose() * multipliers.tail(p)) /
                         step;
    }
    const Eigen::MatrixXd positive = positive_curvature(curvature, values.equal_slope);
    bool has_moved = false;
    double expected = 0;
    while (part > 1e-5 && !has_moved) {
      const auto quadratic = quadratic_of(positive);
      const auto step = solve(quadratic);
      if (!step) {
        part *= 0.25;
        continue;
      }
      const Eigen::VectorXd change = step->at.head(n);
      expected = -(values.slope.dot(change) + 0.5 * change.dot(positive * change));
      Eigen::VectorXd next = (z + change).cwiseMax(program.least).cwiseMin(program.most);
      program.evaluate(next, moved);
      ++result.evaluations;
      const bool is_there = meet(program, part * options.reach, options.met, next, moved, result.evaluations);
      const double gain = values.objective - moved.objective;
      if (is_there && gain > 1e-3 * expected - 1e-13) {
        has_moved = true;
        multipliers = step->multipliers;
        z = next;
        std::swap(values, moved);
        if (gain > 0.5 * expected) part = std::min(1.0, 3 * part);
      } else {
        part *= 0.25;
      }
    }
    if (!has_moved) break;
    result.at = z;
    result.violation = violation_of(values);
    if (expected < 1e-13) break;
  }
  return result;
}

}  // namespace slew
