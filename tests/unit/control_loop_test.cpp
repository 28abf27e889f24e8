// Bryson 1994, Problems 3.2.2(c) and 3.2.4(c): the closed loops are (s^2 + 2 s + 2)^2 and (s + 1)(s^2 + 2 s +
// 2) for omega_0 = 1, that is 1 4 8 8 4 and 1 3 4 2.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

#include "server/control/frequency_response.hpp"
#include "tests/unit/linear_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using Complex = std::complex<double>;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void expect_range(const std::vector<StableGains>& found, double from, double to) {
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].from, from, 1e-12 * std::max(1.0, from));
  if (to < kInfinity)
    EXPECT_NEAR(found[0].to, to, 1e-12 * to);
  else
    EXPECT_EQ(found[0].to, to);
}

TEST(ControlLoop, CharacteristicPolynomials) {
  EXPECT_EQ(control_loop(problem_3_2_2()).characteristic_polynomial(1), (Polynomial{1, 4, 8, 8, 4}));
  EXPECT_EQ(control_loop(problem_3_2_4()).characteristic_polynomial(1), (Polynomial{1, 3, 4, 2}));
}

TEST(ControlLoop, DoublePolesAreDouble) {
  const Complex up{-1, 1}, down{-1, -1};
  EXPECT_EQ(control_loop(problem_3_2_2()).poles(1), (std::vector<Complex>{up, up, down, down}));
  EXPECT_EQ(control_loop(problem_3_2_4()).poles(1), (std::vector<Complex>{-1, up, down}));
}

// Eq. 3.7: -K/I = s^2 (s + b)/(s + a).
TEST(ControlLoop, LeadCompensationObeysEvansForm) {
  const ControlLoop loop = control_loop(lead(3, 0.5, 4));
  for (const Complex s : loop.poles(1)) EXPECT_LT(std::abs(s * s * (s + 4.0) / (s + 0.5) + 3.0), 1e-12) << s;
}

// Derived: 3.2.2 is stable for 0 < k_0 < 3, with poles at +- j sqrt 6 there; 3.2.4 for every k_0.
TEST(ControlLoop, StabilityRangesOfTheProblems) {
  const auto range = stable_gains(control_loop(problem_3_2_2()));
  expect_range(range, 0, 3);
  EXPECT_NEAR(range[0].to_crossing_rad_s.value(), std::sqrt(6), 1e-14);
  expect_range(stable_gains(control_loop(problem_3_2_4())), 0, kInfinity);
  expect_range(stable_gains(control_loop(attitude_rate())), 0, kInfinity);
}

TEST(ControlLoop, LeadIsStableIfAndOnlyIfThePoleIsBeyondTheZero) {
  expect_range(stable_gains(control_loop(lead(1, 1, 1.001))), 0, kInfinity);
  expect_range(stable_gains(control_loop(lead(1, 0.1, 10))), 0, kInfinity);
  EXPECT_TRUE(stable_gains(control_loop(lead(1, 1, 1))).empty());
  EXPECT_TRUE(stable_gains(control_loop(lead(1, 1, 0.999))).empty());
  EXPECT_TRUE(stable_gains(control_loop(lead(1, 0, 0))).empty());
}

// Per Routh: of s^4 + a s^3 + b s^2 + k (c s + d), the loop of any second-order estimator on a rigid axis,
// stable for k < (a b c - a^2 d)/c^2.
TEST(ControlLoop, StabilityRangeAgreesWithRouth) {
  std::mt19937_64 random(2);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int i = 0; i < 200; ++i) {
    auto spec = attitude_rate();
    spec.plant.inertia_kg_m2 = uniform(0.1, 100);
    spec.feedback.law = place_regulator({-uniform(0.01, 10), uniform(0, 10)}, uniform(0.1, 100));
    spec.estimator = place_second_order({-uniform(0.01, 10), uniform(0, 10)}, spec.plant.inertia_kg_m2);
    const ControlLoop loop = control_loop(spec);
    const Polynomial p = loop.characteristic_polynomial(1);
    const double most = (p[1] * p[2] * p[3] - p[1] * p[1] * p[4]) / (p[3] * p[3]);
    SCOPED_TRACE(i);
    if (most > 0) {
      const auto range = stable_gains(loop);
      ASSERT_EQ(range.size(), 1u);
      EXPECT_NEAR(range[0].to, most, 1e-10 * most);
    } else {
      EXPECT_TRUE(stable_gains(loop).empty());
    }
  }
}

// With elastic modes: every edge of a range has a pole on the axis, and a look at 4,000 gains sees nothing
// else.
TEST(ControlLoop, StabilityRangeOfFlexibleLoops) {
  std::mt19937_64 random(3);
  int edges = 0, unstable = 0;
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    const auto spec = random_loop(random, true);
    const ControlLoop loop = control_loop(spec);
    const auto ranges = stable_gains(loop);
    const auto growth = [&](double gain) {
      double most = -kInfinity;
      for (const Complex pole : loop.poles(gain)) most = std::max(most, pole.real());
      return most;
    };
    for (const StableGains& range : ranges) {
      for (const auto& [gain, crossing] :
           {std::pair(range.from, range.from_crossing_rad_s), std::pair(range.to, range.to_crossing_rad_s)}) {
        if (!crossing) continue;
        ++edges;
        EXPECT_NEAR(growth(gain), 0, 1e-9 * *crossing);
        EXPECT_NEAR(std::abs(1.0 + gain * loop.loop_response({0, *crossing})), 0, 1e-7);
      }
    }
    for (int k = 0; k < 400; ++k) {
      const double gain = 1e-3 * std::pow(10.0, k / 66.0);
      bool is_inside = false, is_near = false;
      for (const StableGains& range : ranges) {
        is_inside = is_inside || (gain > range.from && gain < range.to);
        is_near =
            is_near || std::abs(gain - range.from) < 1e-6 * gain || std::abs(gain - range.to) < 1e-6 * gain;
      }
      if (is_near || std::abs(growth(gain)) < 1e-10) continue;
      EXPECT_EQ(growth(gain) < 0, is_inside) << gain;
      unstable += !is_inside;
    }
  }
  EXPECT_GT(edges, 5);
  EXPECT_GT(unstable, 100);
}

// At k_0 = 1, Problem 3.2.2: the margin of the gain is 3 (9.54 dB).
TEST(ControlLoop, Margins) {
  const ControlLoop loop = control_loop(problem_3_2_2());
  const auto crossings = phase_crossovers(loop);
  ASSERT_EQ(crossings.size(), 1u);
  EXPECT_NEAR(crossings[0].loop_gain, 3, 1e-14);
  // |L|^2 = (64 w^2 + 16)/(w^4 ((8 - w^2)^2 + 16 w^2)) = 1, and the phase of what is in it.
  const auto crossover = gain_crossovers(loop, 1);
  ASSERT_EQ(crossover.size(), 1u);
  const double w = crossover[0].frequency_rad_s, x = w * w;
  EXPECT_NEAR((64 * x + 16) / (x * x * ((8 - x) * (8 - x) + 16 * x)), 1, 1e-14);
  EXPECT_NEAR(crossover[0].phase_margin_deg * kRadPerDeg, std::atan2(8 * w, 4) - std::atan2(4 * w, 8 - x),
              1e-14);
  // Attitude and rate: K = D = 2: 4 + 4 w^2 = w^4.
  const auto direct = gain_crossovers(control_loop(attitude_rate()), 1);
  ASSERT_EQ(direct.size(), 1u);
  EXPECT_NEAR(direct[0].frequency_rad_s, std::sqrt(2 + 2 * std::sqrt(2)), 1e-14);
}

// Every crossover that 20,000 points of a grid see is found, and nothing more in between.
TEST(ControlLoop, NoCrossoverIsMissed) {
  std::mt19937_64 random(4);
  std::size_t count = 0;
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(i);
    const ControlLoop loop = control_loop(random_loop(random, true));
    std::size_t gains = 0, phases = 0;
    Complex before = 0;
    for (int k = 0; k <= 20000; ++k) {
      const Complex now = loop.loop_response({0, 1e-3 * std::pow(10.0, 6.0 * k / 20000)});
      if (k > 0) {
        gains += (std::abs(before) < 1) != (std::abs(now) < 1);
        // Not at an undamped zero, where all of L changes its sign.
        phases += (before.imag() < 0) != (now.imag() < 0) && before.real() < 0 && now.real() < 0 &&
                  std::min(std::abs(before), std::abs(now)) > 1e-4;
      }
      before = now;
    }
    const auto in_grid = [](const auto& all) {
      return static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [](const auto& one) {
        return one.frequency_rad_s > 1e-3 && one.frequency_rad_s < 1e3;
      }));
    };
    EXPECT_GE(in_grid(gain_crossovers(loop, 1)), gains);
    EXPECT_GE(in_grid(phase_crossovers(loop)), phases);
    for (const GainCrossover& one : gain_crossovers(loop, 1))
      EXPECT_NEAR(std::abs(loop.loop_response({0, one.frequency_rad_s})), 1, 1e-6);
    count += gains + phases;
  }
  EXPECT_GT(count, 200u);
}

// The loop's response from its transfer functions is that of its matrices.
TEST(ControlLoop, ResponseAgreesWithTheMatrices) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 50; ++i) {
    const ControlLoop loop = control_loop(random_loop(random, true));
    const Complex s{0.2, 0.3 + 0.1 * i};
    const Eigen::MatrixXcd resolvent = s * Eigen::MatrixXcd::Identity(loop.size(), loop.size()) - loop.open();
    const Complex theirs = -(loop.torque().cast<Complex>() *
                             resolvent.partialPivLu().solve(loop.torque_input().cast<Complex>()))(0);
    EXPECT_LT(std::abs(loop.loop_response(s) - theirs), 1e-9 * std::abs(theirs)) << i;
  }
}

TEST(ControlLoop, BodeOfTwoIntegratorsAndALead) {
  const ControlLoop loop = control_loop(lead(3, 0.5, 4));
  for (const BodePoint& point : bode(loop, 2, bode_grid(loop, 2))) {
    const double w = point.frequency_rad_s;
    EXPECT_NEAR(point.magnitude_dB, 20 * std::log10(6 * std::hypot(w, 0.5) / (w * w * std::hypot(w, 4))),
                1e-10);
    EXPECT_NEAR(point.phase_deg, (std::atan(w / 0.5) - std::atan(w / 4)) / kRadPerDeg - 180, 1e-10);
  }
}

// Continuous, and everywhere the phase of L but for whole turns.
TEST(ControlLoop, PhaseIsUnwrapped) {
  std::mt19937_64 random(6);
  for (int i = 0; i < 50; ++i) {
    const ControlLoop loop = control_loop(random_loop(random, true));
    for (const BodePoint& point : bode(loop, 1, bode_grid(loop, 1))) {
      const double phase = std::arg(loop.loop_response({0, point.frequency_rad_s})) / kRadPerDeg;
      EXPECT_NEAR(std::remainder(point.phase_deg - phase, 360), 0, 1e-5) << i;
    }
  }
  const auto curve = bode(control_loop(problem_3_2_2()), 1, std::vector<double>{1e-6, 1e6});
  EXPECT_NEAR(curve[0].phase_deg, -180, 1e-3);
  EXPECT_NEAR(curve[1].phase_deg, -270, 1e-3);
}

// Branches begin at the loop's poles, are continuous, obey 1 + k_0 L = 0, and pass the double poles at 1.
TEST(ControlLoop, RootLocusOfProblem322) {
  const ControlLoop loop = control_loop(problem_3_2_2());
  const RootLocus locus = root_locus(loop, 10, 5);
  ASSERT_EQ(locus.branches.size(), 4u);
  const auto one =
      static_cast<std::size_t>(std::find(locus.gains.begin(), locus.gains.end(), 1.0) - locus.gains.begin());
  ASSERT_LT(one, locus.gains.size());
  for (const auto& branch : locus.branches) {
    EXPECT_NEAR(std::abs(branch[one].imag()), 1, 1e-7);
    for (std::size_t i = 1; i < branch.size(); ++i) {
      EXPECT_LT(std::abs(branch[i] - branch[i - 1]), 0.06 * std::max(5.0, std::abs(branch[i]))) << i;
      if (std::abs(branch[i] - branch[one]) < 0.3) continue;  // a double pole is no better known than 1e-8
      EXPECT_LT(std::abs(1.0 + locus.gains[i] * loop.loop_response(branch[i])), 1e-8) << i;
    }
  }
}

TEST(ControlLoop, FreeModesAreTheLoopsPoles) {
  auto spec = attitude_rate();
  spec.plant = table_1_plant();
  const auto poles = control_loop(spec).loop_poles();
  ASSERT_EQ(poles.size(), 14u);
  EXPECT_EQ(poles[1], 0.0);
  EXPECT_NEAR(std::abs(poles[2]) / (2 * std::numbers::pi), 0.188195, 1e-4);
}

}  // namespace
