// Sequential quadratic programming with the curvature of the Lagrangian, by differences of slopes: where the
// objective hardly curves along some directions, an approximation that is built up from steps (SLSQP) does
// not get to the end. Points on the way meet the constraints, so that objectives may be compared.
#pragma once

#include "server/guidance/sequential_quadratic.hpp"

namespace slew {

struct NewtonOptions {
  Eigen::VectorXd steps;  ///< of each variable: the change from which curvature is taken
  Eigen::VectorXd reach;  ///< of each variable: the largest first step
  int most_iterations = 30;
  double met = 1e-10;  ///< constraints
  std::function<bool()> keep_going;
};

/// From a start that nearly meets the constraints. The objective's curvature is not looked at: it is linear.
SequentialResult minimize_by_newton(const NonlinearProgram& program, const Eigen::VectorXd& start,
                                    const NewtonOptions& options);

}  // namespace slew
