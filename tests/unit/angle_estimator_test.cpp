// Bryson 1994, Problems 3.2.2(b) and 3.2.4(b): estimate-error poles at -1 +- j take k_q = 2, k_theta = 2; one
// at -1 takes ell = 1.
#include <gtest/gtest.h>

#include "server/control/polynomial.hpp"
#include "tests/unit/linear_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;

TEST(AngleEstimator, GainsOfTheProblems) {
  const auto second = place_second_order({-1, 1}, 1);
  EXPECT_DOUBLE_EQ(second.rate_gain_1_s2, 2);
  EXPECT_DOUBLE_EQ(second.attitude_gain_1_s, 2);
  EXPECT_DOUBLE_EQ(place_first_order(-1, 1).gain_1_s, 1);
  EXPECT_EQ(roots(error_polynomial(second)), (std::vector<std::complex<double>>{{-1, 1}, {-1, -1}}));
}

// The estimate's error is not moved by what moves the spacecraft: e = theta - theta^ from the flight against
// e'' + k_theta e' + k_q e = 0 with e(0) = 0.2 and e'(0) = -k_theta e(0): e = 0.2 exp(-t) (cos t - sin t).
TEST(AngleEstimator, ErrorDiesOutByItself) {
  auto spec = problem_3_2_2();
  spec.estimate.error_rad = spec.maneuver.initial_angle_rad - 0.2;
  spec.output_times_s = {0.5, 1, 2, 4};
  for (const OutputRow& row : fly(spec).outputs) {
    const double t = row.t_s;
    EXPECT_NEAR(row.state[0] - row.state[4], 0.2 * std::exp(-t) * (std::cos(t) - std::sin(t)), 1e-14);
  }
}

// Problem 3.2.3's "note that", corrected: the innovation is ell (z' - q^), so a wrong rate is forgotten as
// exp(-ell t); as printed, with z, it would go to theta/2.
TEST(AngleEstimator, TheFirstOrderInnovationIsOfTheRate) {
  auto spec = problem_3_2_4();
  spec.estimate.rate_rad_s = 0.3;
  spec.output_times_s = {0.5, 1, 2, 4, 8};
  for (const OutputRow& row : fly(spec).outputs)
    EXPECT_NEAR(row.state[3] - row.state[1], 0.3 * std::exp(-row.t_s), 1e-14);
}

// With the right beginning an estimator changes nothing: the flight is that of sensed attitude and rate.
TEST(AngleEstimator, SeparationPrinciple) {
  auto sensed = attitude_rate();
  sensed.maneuver.initial_rate_rad_s = 0.1;
  sensed.output_times_s = {1, 3, 6};
  auto second = problem_3_2_2(), first = problem_3_2_4();
  for (auto* spec : {&second, &first}) {
    spec->maneuver = sensed.maneuver;
    spec->output_times_s = sensed.output_times_s;
    spec->estimate.rate_rad_s = 0.1;
    const auto ours = fly(*spec).outputs, theirs = fly(sensed).outputs;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(ours[i].state[k], theirs[i].state[k], 1e-14);
  }
}

}  // namespace
