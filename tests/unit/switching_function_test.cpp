// Agrawal & Bang 1995, Eqs. 15 and 19, and Eq. 11: ds/dt = omega (1 + gamma u/N) for omega > 0.
#include "server/control/switching_function.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <unsupported/Eigen/AutoDiff>

namespace {

using namespace slew;

SwitchingFunctionParameters parameters(Deadband deadband) {
  SwitchingFunctionParameters law;
  law.inertia_kg_m2 = 1.1;
  law.deadband = deadband;
  law.deadband_rad = 0.1;
  return law;
}

TEST(SwitchingFunction, SingleSidedBandLiesWhereTheSlewComesFrom) {
  const SwitchingFunction forwards(parameters(Deadband::single_sided), 1, +1);
  EXPECT_EQ(forwards.lower_rad(), -0.1);
  EXPECT_EQ(forwards.upper_rad(), 0);
  const SwitchingFunction backwards(parameters(Deadband::single_sided), -1, -1);
  EXPECT_EQ(backwards.lower_rad(), 0);
  EXPECT_EQ(backwards.upper_rad(), 0.1);
}

TEST(SwitchingFunction, BothEndsBelongToTheBand) {
  const SwitchingFunction law(parameters(Deadband::double_sided), 0, +1);
  EXPECT_EQ(SwitchingFunction::demand(law.side(0.1)), 0);
  EXPECT_EQ(SwitchingFunction::demand(law.side(-0.1)), 0);
  EXPECT_EQ(SwitchingFunction::demand(law.side(std::nextafter(0.1, 1))), -1);
  EXPECT_EQ(SwitchingFunction::demand(law.side(std::nextafter(-0.1, -1))), 1);
}

TEST(SwitchingFunction, WithoutABandItIsTheSignum) {
  const SwitchingFunction law(parameters(Deadband::none), 0, +1);
  EXPECT_EQ(SwitchingFunction::demand(law.side(1e-300)), -1);
  EXPECT_EQ(SwitchingFunction::demand(law.side(0)), 0);
  EXPECT_EQ(SwitchingFunction::demand(law.side(-1e-300)), 1);
}

TEST(SwitchingFunction, EndBoxIncludesItsSides) {
  auto with_box = parameters(Deadband::none);
  with_box.end_box = EndBox{0.01, 0.05};
  const SwitchingFunction law(with_box, 1, +1);
  EXPECT_TRUE(law.in_end_box(1, 0.05));
  EXPECT_TRUE(law.in_end_box(1, -0.05));
  EXPECT_FALSE(law.in_end_box(1, 0.0501));
  EXPECT_FALSE(law.in_end_box(1.0101, 0));
  EXPECT_FALSE(SwitchingFunction(parameters(Deadband::none), 1, 1).in_end_box(1, 0));
}

// The template carries dual numbers: ds/dt from it is Eq. 11.
TEST(SwitchingFunction, DualNumbersGiveItsRateOfChange) {
  using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 1, 1>>;
  const SwitchingFunction law(parameters(Deadband::none), 1, +1);
  const double rate = 0.7, acceleration = -1;
  Dual angle(0.3), omega(rate);
  angle.derivatives()(0) = rate;
  omega.derivatives()(0) = acceleration;
  const Dual s = law.value(angle, omega);
  EXPECT_DOUBLE_EQ(s.value(), law.value(0.3, rate));
  EXPECT_DOUBLE_EQ(s.derivatives()(0), rate * (1 + 1.1 * acceleration));
}

}  // namespace
