// A nonlinear program, and Kraft's sequential quadratic programming for it (SLSQP of NLopt).
#pragma once

#include <Eigen/Core>
#include <functional>

namespace slew {

/// What a program is at one point; gradients are rows.
struct NonlinearValues {
  double objective = 0;
  Eigen::VectorXd slope;        ///< of the objective
  Eigen::VectorXd equal;        ///< to be 0
  Eigen::MatrixXd equal_slope;  ///< one row each
  Eigen::VectorXd positive;     ///< to be >= 0
  Eigen::MatrixXd positive_slope;
};

struct NonlinearProgram {
  Eigen::VectorXd least, most;  ///< bounds of the variables
  Eigen::Index equals = 0, positives = 0;
  /// Fills everything. The sizes are always the same.
  std::function<void(const Eigen::VectorXd&, NonlinearValues&)> evaluate;
};

struct SequentialOptions {
  double tolerance = 1e-10;  ///< relative change of the objective and of the variables
  int most_evaluations = 100;
  std::function<bool()> keep_going;  ///< empty: always
};

struct SequentialResult {
  Eigen::VectorXd at;
  double violation = 0;  ///< largest of all constraints, there
  int evaluations = 0;
  bool was_stopped = false;
};

/// From `start`, which is brought between the bounds first. Returns the last point if it is better than none:
/// look at the violation.
SequentialResult minimize(const NonlinearProgram& program, Eigen::VectorXd start,
                          const SequentialOptions& options);

}  // namespace slew
