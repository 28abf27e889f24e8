// Bryson 1994, Problem 3.2.2(d): the compensator is -8 (s + 1/2)/((s + 2)^2 + 4) for omega_0 = 1, per I; and
// 3.2.4(d): -4 (s + 1/2)/(s + 3).
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "tests/unit/linear_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using Complex = std::complex<double>;

Compensator compensator_of(const LinearAxisSpecification& spec) {
  return make_compensator(spec.feedback, spec.estimator);
}

TEST(LinearFeedback, CompensatorOfProblem322) {
  const auto found = compensator_of(problem_3_2_2()).of_angle;
  EXPECT_EQ(found.numerator, (Polynomial{-8, -4}));
  EXPECT_EQ(found.denominator, (Polynomial{1, 4, 8}));
}

TEST(LinearFeedback, CompensatorOfProblem324) {
  const auto found = compensator_of(problem_3_2_4()).of_angle;
  EXPECT_EQ(found.numerator, (Polynomial{-4, -2}));
  EXPECT_EQ(found.denominator, (Polynomial{1, 3}));
}

TEST(LinearFeedback, PolesAreWhereTheGainsPutThem) {
  const AttitudeRateFeedback law = place_regulator({-1, 1}, 1);
  EXPECT_DOUBLE_EQ(law.rate_gain_N_m_s_rad, 2);
  EXPECT_DOUBLE_EQ(law.attitude_gain_N_m_rad, 2);
  EXPECT_EQ(regulator_polynomial(place_regulator({-0.3, 0.7}, 5), 5), (Polynomial{1, 0.6, 0.09 + 0.49}));
}

// For any omega_0 and I the problems print -8 I w^3 (s + w/2)/((s + 2 w)^2 + (2 w)^2) and -4 I w^2 (s +
// w/2)/(s + 3 w).
TEST(LinearFeedback, CompensatorsScaleAsPrinted) {
  const double w = 0.37, I = 13;
  LinearFeedback feedback{place_regulator({-w, w}, I)};
  const auto second = make_compensator(feedback, place_second_order({-w, w}, I)).of_angle;
  const auto first = make_compensator(feedback, place_first_order(-w, I)).of_angle;
  const double printed[] = {-8 * I * w * w * w, -4 * I * w * w * w * w};
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(second.numerator[i], printed[i], 1e-12 * -printed[i]);
  EXPECT_NEAR(second.denominator[1], 4 * w, 1e-14);
  EXPECT_NEAR(second.denominator[2], 8 * w * w, 1e-14);
  EXPECT_NEAR(first.numerator[0], -4 * I * w * w, 1e-12);
  EXPECT_NEAR(first.numerator[1], -2 * I * w * w * w, 1e-12);
  EXPECT_NEAR(first.denominator[1], 3 * w, 1e-14);
}

// The transfer function is that of the state-space form, for every law and estimator.
TEST(LinearFeedback, TransferFunctionAndStateSpaceAgree) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 100; ++i) {
    const auto spec = random_loop(random, false);
    const Compensator made = compensator_of(spec);
    const Complex s{0.3, 0.1 * i};
    Complex through = made.torque_of_angle + made.torque_of_rate * s;
    if (made.size() > 0) {
      const Eigen::MatrixXcd resolvent =
          s * Eigen::MatrixXcd::Identity(made.size(), made.size()) - made.dynamics.cast<Complex>();
      through += (made.torque.cast<Complex>() * resolvent.inverse() * made.input.cast<Complex>())(0);
    }
    const Complex printed =
        value_at<Complex>(made.of_angle.numerator, s) / value_at<Complex>(made.of_angle.denominator, s);
    EXPECT_LT(std::abs(through - printed), 1e-11 * std::abs(printed)) << i;
  }
}

TEST(LinearFeedback, RootsOfQuadratics) {
  EXPECT_EQ(roots(Polynomial{1, 2, 2}), (std::vector<Complex>{{-1, 1}, {-1, -1}}));
  EXPECT_EQ(roots(Polynomial{1, 2, 1}), (std::vector<Complex>{-1, -1}));
  EXPECT_EQ(roots(Polynomial{0, -8, -4}), (std::vector<Complex>{-0.5}));
  EXPECT_TRUE(roots(Polynomial{3}).empty());
  // Far apart: the small one is not lost in the difference.
  EXPECT_DOUBLE_EQ(roots(Polynomial{1, 1e8, 1})[1].real(), -1e-8);
  EXPECT_THROW(roots(Polynomial{1, 0, 0, 1}), std::invalid_argument);
}

}  // namespace
