// The same request by closed-form arcs and by SUNDIALS: same events, same end.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/single_axis_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;

Verification second_opinion(const OnOffAxisSpecification& spec) {
  const auto verification = make_on_off_axis_verification(spec);
  return compare(fly(spec), fly(*verification));
}

void expect_agreement(const OnOffAxisSpecification& spec, double state_tolerance, double time_tolerance_s) {
  const auto opinion = second_opinion(spec);
  EXPECT_TRUE(opinion.same_event_sequence);
  EXPECT_NEAR(opinion.final_time_difference_s, 0, time_tolerance_s);
  for (const double difference : opinion.final_state_difference) EXPECT_NEAR(difference, 0, state_tolerance);
  if (opinion.event_time_max_s) {
    EXPECT_LE(*opinion.event_time_max_s, time_tolerance_s);
  }
}

TEST(SecondOpinion, AgreesOnTheSampledLaw) {
  expect_agreement(single_sided(1.1, 0.1, 1e-2), 1e-12, 1e-12);
}

TEST(SecondOpinion, AgreesOnTheMinimumOnTime) {
  auto spec = continuous(single_sided(1.1, 0.1, 0), 0.05);
  spec.law.end_box = EndBox{0.01, 0.05};
  spec.stop = StopCondition::end_box;
  expect_agreement(spec, 1e-12, 1e-11);
  spec.maneuver.final_angle_rad = -1;
  expect_agreement(spec, 1e-12, 1e-11);
}

TEST(SecondOpinion, AgreesFromRandomStarts) {
  std::mt19937_64 random(11);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int i = 0; i < 40; ++i) {
    auto spec = single_sided(uniform(1.02, 1.8), uniform(0.02, 0.3), uniform(0.003, 0.03));
    spec.maneuver.initial_angle_rad = uniform(-1, 1);
    spec.maneuver.initial_rate_rad_s = uniform(-0.3, 0.3);
    spec.maneuver.final_angle_rad = uniform(-1, 1);
    spec.disturbances.constant_N_m = i % 3 == 0 ? uniform(-0.05, 0.05) : 0;
    if (i % 2) spec = continuous(spec, uniform(0.01, 0.1));
    spec.stop = StopCondition::duration;
    spec.duration_s = 2;
    SCOPED_TRACE(i);
    expect_agreement(spec, 1e-8, 1e-8);
  }
}

TEST(SecondOpinion, SeesAnotherSequenceWhenThereIsOne) {
  auto other = single_sided(1.1, 0.1, 1e-2);
  const auto mine = fly(other);
  other.law.inertia_kg_m2 = 1.3;
  const auto theirs = make_on_off_axis_verification(other);
  EXPECT_FALSE(compare(mine, fly(*theirs)).same_event_sequence);
}

}  // namespace
