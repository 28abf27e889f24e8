// Programs whose answer is known: a quadratic one at a bound, and one that hardly curves along its valley.
#include "server/guidance/newton_program.hpp"

#include <gtest/gtest.h>

#include "server/guidance/bounded_quadratic.hpp"

namespace {

using namespace slew;
using Eigen::VectorXd;

TEST(BoundedQuadratic, FindsTheNearestPointOfABox) {
  // From (2, 2, 2) to the plane x + y + z = 1 within |x| <= 1/2, |y| <= 1, -1 <= z <= 0.
  BoundedQuadratic program;
  program.curvature = Eigen::Matrix3d::Identity();
  program.slope = Eigen::Vector3d(-2, -2, -2);
  program.equal_slope = Eigen::RowVector3d::Ones();
  program.equal = VectorXd::Ones(1);
  program.least = Eigen::Vector3d(-0.5, -1, -1);
  program.most = Eigen::Vector3d(0.5, 1, 0);
  const auto found = solve(program);
  ASSERT_TRUE(found);
  EXPECT_LE((found->at - Eigen::Vector3d(0.5, 0.5, 0)).norm(), 1e-5);
  program.equal[0] = 2;  // no point of the box
  EXPECT_FALSE(solve(program));
}

TEST(NewtonProgram, FollowsAFlatValley) {
  // t = (x - y^2)^2 + 1e-3 (y - 1)^2, from y = 0; y may not exceed 0.9.
  NonlinearProgram program;
  program.least = Eigen::Vector3d(-2, -2, -10);
  program.most = Eigen::Vector3d(2, 0.9, 10);
  program.equals = 1;
  program.evaluate = [](const VectorXd& z, NonlinearValues& values) {
    const double x = z[0], y = z[1], across = x - y * y;
    values.objective = z[2];
    values.slope = VectorXd::Unit(3, 2);
    values.equal.resize(1);
    values.equal[0] = across * across + 1e-3 * (y - 1) * (y - 1) - z[2];
    values.equal_slope = Eigen::RowVector3d(2 * across, -4 * y * across + 2e-3 * (y - 1), -1);
    values.positive.resize(0);
    values.positive_slope.resize(0, 3);
  };
  NewtonOptions options;
  options.steps = VectorXd::Constant(3, 1e-6);
  options.reach = VectorXd::Constant(3, 0.5);
  const SequentialResult result = minimize_by_newton(program, Eigen::Vector3d(0, 0, 1e-3), options);
  EXPECT_LE(result.violation, 1e-10);
  EXPECT_NEAR(result.at[1], 0.9, 1e-4);
  EXPECT_NEAR(result.at[2], 1e-5, 1e-9);
}

}  // namespace
