// Event times to 1e-12 relative, against bisection in long double.
#include "server/propagation/axis_events.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/plant/single_axis.hpp"

#include <Eigen/Core>
#include <unsupported/Eigen/AutoDiff>

namespace {

using namespace slew;

TEST(QuadraticRoots, SurviveCancellation) {
  // Roots 1e-9 and 1e9: the naive formula loses the small one.
  const auto roots = quadratic_roots(1, -(1e9 + 1e-9), 1);
  ASSERT_EQ(roots.count, 2);
  EXPECT_NEAR(roots.tau[0] / 1e-9, 1, 1e-14);
  EXPECT_NEAR(roots.tau[1] / 1e9, 1, 1e-14);
  EXPECT_EQ(quadratic_roots(1, 0, 1).count, 0);
  EXPECT_EQ(quadratic_roots(1, -2, 1).count, 1);
  EXPECT_EQ(quadratic_roots(0, 0, 3).count, 1);
  EXPECT_EQ(quadratic_roots(1, 0, 0).count, 0);
}

TEST(AscendingTimes, AreAscending) {
  AscendingTimes<4> times;
  for (const double t : {3.0, 1.0, 2.0, 0.5}) times.add(t);
  for (std::size_t i = 1; i < times.count(); ++i) EXPECT_LT(times[i - 1], times[i]);
}

struct Problem {
  QuadraticArc<double> arc;
  SwitchingFunctionParameters law;
  double final_angle;
  double h;
};

Problem random_problem(std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Problem problem;
  problem.arc = {uniform(-1, 1), uniform(-1, 1), uniform(-1.5, 1.5)};
  problem.law.inertia_kg_m2 = uniform(0.5, 2);
  problem.law.deadband = Deadband::double_sided;
  problem.law.deadband_rad = uniform(0, 0.3);
  problem.final_angle = uniform(-0.5, 0.5);
  problem.h = uniform(0.1, 3);
  return problem;
}

// The same side by brute force: s at many times in long double, then bisection.
std::optional<long double> crossing_by_bisection(const Problem& problem, const SwitchingFunction& law,
                                                 SwitchingSide side) {
  const auto s_at = [&](long double tau) {
    const long double angle =
        problem.arc.angle_rad + tau * (problem.arc.rate_rad_s + 0.5L * problem.arc.acceleration_rad_s2 * tau);
    const long double rate = problem.arc.rate_rad_s + problem.arc.acceleration_rad_s2 * tau;
    return angle - problem.final_angle + law.curvature() * rate * std::fabs(rate);
  };
  const auto side_of = [&](long double s) {
    return s > law.upper_rad()   ? SwitchingSide::above
           : s < law.lower_rad() ? SwitchingSide::below
                                 : SwitchingSide::inside;
  };
  constexpr int kParts = 20000;
  for (int i = 1; i <= kParts; ++i) {
    long double left = problem.h * static_cast<long double>(i - 1) / kParts;
    long double right = problem.h * static_cast<long double>(i) / kParts;
    if (side_of(s_at(right)) == side) continue;
    for (int k = 0; k < 100; ++k) {
      const long double middle = (left + right) / 2;
      (side_of(s_at(middle)) == side ? left : right) = middle;
    }
    return right;
  }
  return std::nullopt;
}

TEST(SideCrossing, AgreesWithBisection) {
  std::mt19937_64 random(5);
  int found = 0;
  for (int i = 0; i < 300; ++i) {
    const Problem problem = random_problem(random);
    const SwitchingFunction law(problem.law, problem.final_angle, +1);
    const auto side = law.side(law.value(problem.arc.angle_rad, problem.arc.rate_rad_s));
    const auto exact = crossing_by_bisection(problem, law, side);
    const auto crossing = side_crossing(problem.arc, law, side, problem.h);
    ASSERT_EQ(crossing.has_value(), exact.has_value()) << i;
    if (!crossing) continue;
    ++found;
    // Where s passes slowly, its own rounding is what limits the time.
    EXPECT_NEAR(crossing->tau, static_cast<double>(*exact), 1e-12 + 1e-7 * (*exact < 1e-3)) << i;
  }
  EXPECT_GT(found, 100);
}

TEST(SideCrossing, AnArcThatStartsOnTheEndDoesNotCrossItAgain) {
  SwitchingFunctionParameters parameters;
  parameters.deadband = Deadband::single_sided;
  parameters.deadband_rad = 0.1;
  const SwitchingFunction law(parameters, 0, +1);
  // Coasting upwards from the lower end of the band: out at the top only.
  const QuadraticArc<double> coast{-0.1 - law.curvature() * 0.25, 0.5, 0};
  const auto crossing = side_crossing(coast, law, SwitchingSide::inside, 10);
  ASSERT_TRUE(crossing);
  EXPECT_EQ(crossing->entered, SwitchingSide::above);
  EXPECT_NEAR(crossing->tau, 0.2, 1e-15);
}

TEST(BoxCrossing, SeesAVisitBetweenTheEnds) {
  const EndBox box{0.1, 10};
  // Up and down again: enters at e = -0.1, turns before it leaves on the other side, leaves at -0.1.
  const QuadraticArc<double> arc{-0.55, 1, -1};
  const auto in = box_crossing(arc, box, 0, false, 3, 1e-14);
  ASSERT_TRUE(in);
  EXPECT_NEAR(arc.angle_at(*in), -0.1, 1e-15);
  const QuadraticArc<double> inside{arc.angle_at(*in), arc.rate_at(*in), -1};
  const auto out = box_crossing(inside, box, 0, true, 3, 1e-14);
  ASSERT_TRUE(out);
  EXPECT_NEAR(inside.angle_at(*out), -0.1, 1e-12);
  EXPECT_FALSE(box_crossing(arc, EndBox{0.04, 10}, 0, false, 3, 1e-14));
}

TEST(BoxCrossing, AgreesWithLookingClosely) {
  std::mt19937_64 random(9);
  for (int i = 0; i < 200; ++i) {
    const Problem problem = random_problem(random);
    const EndBox box{0.3, 0.6};
    const auto is_in = [&](double tau) {
      return std::abs(problem.arc.angle_at(tau) - problem.final_angle) <= box.angle_rad &&
             std::abs(problem.arc.rate_at(tau)) <= box.rate_rad_s;
    };
    const bool starts_in = is_in(0);
    std::optional<double> seen;
    for (int k = 1; k <= 50000 && !seen; ++k)
      if (const double tau = problem.h * k / 50000; is_in(tau) != starts_in) seen = tau;
    const auto crossing = box_crossing(problem.arc, box, problem.final_angle, starts_in, problem.h, 1e-14);
    ASSERT_EQ(crossing.has_value(), seen.has_value()) << i;
    if (seen) {
      EXPECT_NEAR(*crossing, *seen, problem.h / 50000 + 1e-12) << i;
    }
  }
}

// Dual numbers through the arc and through the plant: the same derivative.
TEST(QuadraticArc, CarriesDualNumbers) {
  using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 1, 1>>;
  const SingleAxisPlant plant{2, {}};
  const Dual torque(0.5, 1, 0);  // the derivative with respect to the torque
  const std::array<Dual, 2> state{Dual(0.1), Dual(0.2)};
  std::array<Dual, 2> slope;
  derivative<Dual>(plant, state, torque, slope);
  const QuadraticArc<Dual> arc{state[0], state[1], slope[1]};
  EXPECT_DOUBLE_EQ(arc.angle_at(Dual(3)).derivatives()(0), 0.5 * 9 / 2);
  EXPECT_DOUBLE_EQ(arc.rate_at(Dual(3)).derivatives()(0), 3.0 / 2);
}

// Arcs that shrink without end come down to where both roots of s are lost in the rounding of theta.
TEST(SideCrossing, ARootLostInRoundingIsWhereThePieceBegins) {
  SwitchingFunctionParameters parameters;
  parameters.inertia_kg_m2 = 0.87022224312005914;
  const SwitchingFunction law(parameters, 1, 1);
  const QuadraticArc<double> arc{1.0000000000000004, -2.97312e-08, 1};
  const auto crossing = side_crossing(arc, law, SwitchingSide::below, 2);
  ASSERT_TRUE(crossing);
  EXPECT_LE(crossing->tau, 1e-7);
}

TEST(CrossingScan, WhatIsZeroAllAlongCrossesNothing) {
  struct Zero {
    ScanPoint at(double) const { return {0, 0}; }
    ScanLook look(double, double) const { return {0, 0, 0}; }
  };
  EXPECT_FALSE(first_crossing(Zero{}, 1, 0, 1, 1e-13));
  EXPECT_FALSE(first_crossing(Zero{}, -1, 0, 1, 1e-13));
}

}  // namespace
