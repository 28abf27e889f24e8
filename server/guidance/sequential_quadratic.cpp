#include "server/guidance/sequential_quadratic.hpp"

#include <nlopt.h>

#include <algorithm>
#include <memory>

namespace slew {

namespace {

// NLopt asks for the objective and for each kind of constraint in turn, for values and for gradients: one
// evaluation serves them all.
struct Asked {
  const NonlinearProgram& program;
  const SequentialOptions& options;
  nlopt_opt optimizer;
  NonlinearValues values;
  Eigen::VectorXd at;
  SequentialResult result;
  bool has_best = false;
  double best = 0;

  const NonlinearValues& look(unsigned n, const double* x) {
    const Eigen::Map<const Eigen::VectorXd> now(x, n);
    if (at.size() == now.size() && at == now) return values;
    at = now;
    program.evaluate(at, values);
    ++result.evaluations;
    if (options.keep_going && !options.keep_going()) {
      result.was_stopped = true;
      nlopt_force_stop(optimizer);
    }
    double violation = values.equal.size() > 0 ? values.equal.lpNorm<Eigen::Infinity>() : 0;
    if (values.positive.size() > 0) violation = std::max(violation, -values.positive.minCoeff());
    constexpr double kMet = 1e-8;
    const double merit = violation <= kMet ? values.objective - 1e6 : violation;
    if (!has_best || merit < best) {
      has_best = true, best = merit;
      result.at = at;
      result.violation = violation;
    }
    return values;
  }
};

void give(const Eigen::MatrixXd& slope, double sign, double* gradient) {
  if (!gradient) return;
  for (Eigen::Index i = 0; i < slope.rows(); ++i)
    for (Eigen::Index j = 0; j < slope.cols(); ++j) gradient[i * slope.cols() + j] = sign * slope(i, j);
}

double objective(unsigned n, const double* x, double* gradient, void* context) {
  const NonlinearValues& values = static_cast<Asked*>(context)->look(n, x);
  if (gradient) std::copy(values.slope.begin(), values.slope.end(), gradient);
  return values.objective;
}

void equal(unsigned, double* result, unsigned n, const double* x, double* gradient, void* context) {
  const NonlinearValues& values = static_cast<Asked*>(context)->look(n, x);
  std::copy(values.equal.begin(), values.equal.end(), result);
  give(values.equal_slope, 1, gradient);
}

// NLopt wants what is to be <= 0.
void positive(unsigned, double* result, unsigned n, const double* x, double* gradient, void* context) {
  const NonlinearValues& values = static_cast<Asked*>(context)->look(n, x);
  std::transform(values.positive.begin(), values.positive.end(), result, [](double v) { return -v; });
  give(values.positive_slope, -1, gradient);
}

}  // namespace

SequentialResult minimize(const NonlinearProgram& program, Eigen::VectorXd start,
                          const SequentialOptions& options) {
  const auto n = static_cast<unsigned>(start.size());
  const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> optimizer(nlopt_create(NLOPT_LD_SLSQP, n),
                                                                    nlopt_destroy);
  Asked asked{program, options, optimizer.get(), {}, {}, {}};
  start = start.cwiseMax(program.least).cwiseMin(program.most);
  nlopt_set_min_objective(optimizer.get(), objective, &asked);
  nlopt_set_lower_bounds(optimizer.get(), program.least.data());
  nlopt_set_upper_bounds(optimizer.get(), program.most.data());
  if (program.equals > 0) {
    const Eigen::VectorXd tolerance = Eigen::VectorXd::Constant(program.equals, 1e-10);
    nlopt_add_equality_mconstraint(optimizer.get(), static_cast<unsigned>(program.equals), equal, &asked,
                                   tolerance.data());
  }
  if (program.positives > 0) {
    const Eigen::VectorXd tolerance = Eigen::VectorXd::Constant(program.positives, 1e-10);
    nlopt_add_inequality_mconstraint(optimizer.get(), static_cast<unsigned>(program.positives), positive,
                                     &asked, tolerance.data());
  }
  nlopt_set_ftol_rel(optimizer.get(), options.tolerance);
  nlopt_set_xtol_rel(optimizer.get(), options.tolerance);
  nlopt_set_maxeval(optimizer.get(), options.most_evaluations);
  double value = 0;
  nlopt_optimize(optimizer.get(), start.data(), &value);
  return std::move(asked.result);
}

}  // namespace slew
