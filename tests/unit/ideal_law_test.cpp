// Ideal laws: sliding and rest as modes of their own. Agrawal & Bang 1995, Fig. 2: gamma = 1.1 slides along s
// = 0 for 1.07349 and rests at 2.04939; gamma = 0.9 comes to rest after infinitely many arcs at 2.66286.
#include <gtest/gtest.h>

#include "tests/unit/flexible_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;

OnOffAxisSpecification ideal(OnOffAxisSpecification spec) {
  spec.evaluation = Evaluation::ideal;
  spec.stop = StopCondition::duration;
  spec.law.end_box.reset();
  return spec;
}

TEST(IdealLaw, SlidesAndRests) {
  const RunReport report = fly(ideal(unit_slew(1.1, 1)));
  EXPECT_NEAR(report.metrics.sliding_s, 1.07349, 1e-5);
  EXPECT_NEAR(*report.metrics.rest_s, 2.04939, 1e-5);
  EXPECT_NEAR(report.metrics.final_error_rad, 0, 1e-12);
  EXPECT_EQ(report.metrics.residual_rate_rad_s, 0);
  EXPECT_LE(report.propagator.steps, 10u);
}

// Below 1, each half cycle leaves the fraction rho = (1 - g)/(1 + g) of the error; all of them together take
// 2 t1/(1 - sqrt(rho)).
TEST(IdealLaw, AccumulationEndsInRest) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 100; ++i) {
    const double g = std::uniform_real_distribution<double>(0.05, 0.95)(random);
    auto spec = ideal(unit_slew(g, 1));
    spec.duration_s = 1000;
    spec.telemetry_period_s = 1000;
    const RunReport report = fly(spec);
    const double t1 = std::sqrt(2 / (1 + g)), rho = (1 - g) / (1 + g);
    ASSERT_TRUE(report.metrics.rest_s) << g;
    EXPECT_NEAR(*report.metrics.rest_s, 2 * t1 / (1 - std::sqrt(rho)), 1e-7 / (1 - std::sqrt(rho))) << g;
    EXPECT_NEAR(report.metrics.final_error_rad, 0, 1e-13) << g;
    EXPECT_EQ(report.metrics.residual_rate_rad_s, 0) << g;
    int accumulated = 0;
    for (const SwitchEvent& event : report.events) accumulated += event.channel == kAccumulatedEvent;
    EXPECT_EQ(accumulated, report.events.size() == report.events_total ? 1 : accumulated) << g;
  }
}

// Anywhere in the phase plane, in either direction, with any band, with a disturbance or without.
OnOffAxisSpecification random_start(std::mt19937_64& random, bool is_flexible) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  OnOffAxisSpecification spec;
  if (is_flexible) {
    spec = random_flexible_slew(random, true);
  } else {
    spec.actuator.torque_N_m = uniform(0.5, 2);
    spec.law.torque_N_m = spec.actuator.torque_N_m;
    spec.maneuver.final_angle_rad = uniform(-1, 1);
    spec.law.deadband = static_cast<Deadband>(random() % 3);
    spec.law.deadband_rad = uniform(0.02, 0.2);
    spec.law.gamma_bar = uniform(1.05, 2);
    spec.disturbances.constant_N_m = random() % 2 ? uniform(-0.04, 0.04) * spec.actuator.torque_N_m : 0;
  }
  if (random() % 2) {
    spec.law.gamma_bar = 0;
    spec.law.rate_gain_s = uniform(0.3, 2);
  }
  spec.maneuver.initial_angle_rad = spec.maneuver.final_angle_rad + uniform(-1, 1);
  spec.maneuver.initial_rate_rad_s = uniform(-0.5, 0.5);
  spec.duration_s = uniform(1, 4);
  spec.telemetry_period_s = 0.1;
  return ideal(spec);
}

double difference(const RunReport& a, const RunReport& b) {
  return std::abs(a.metrics.final_error_rad - b.metrics.final_error_rad) +
         std::abs(a.metrics.residual_rate_rad_s - b.metrics.residual_rate_rad_s);
}

// The Filippov limit is the limit: what is sampled every T, or fires for at least T, comes as near as T is
// small.
void expect_limit(bool is_flexible, int cases, double slope) {
  std::mt19937_64 random(is_flexible ? 12 : 11);
  int slid = 0;
  for (int i = 0; i < cases; ++i) {
    const auto spec = random_start(random, is_flexible);
    SCOPED_TRACE(i);
    const RunReport limit = fly(spec);
    ASSERT_FALSE(limit.failure) << limit.failure->sentence;
    slid += limit.metrics.sliding_s > 0;
    for (const double period_s : {1e-3, 1e-4}) {
      auto sampled = spec;
      sampled.evaluation = Evaluation::sampled;
      sampled.sample_period_s = period_s;
      EXPECT_LE(difference(limit, fly(sampled)), slope * period_s);
      EXPECT_LE(difference(limit, fly(continuous(spec, period_s))), slope * period_s);
    }
  }
  EXPECT_GE(slid, cases / 8);
}

TEST(IdealLaw, IsTheLimitOfSampledAndMinimumOnTimeLaws) {
  expect_limit(false, 80, 20);
}
TEST(IdealLaw, IsTheLimitOnAFlexibleAxisToo) {
  expect_limit(true, 40, 60);
}

// Parabolas meet the switching curve where the law sends them; a start that is the mirror image flies the
// mirror image.
TEST(IdealLaw, TheMirrorImageFliesTheMirrorImage) {
  std::mt19937_64 random(13);
  for (int i = 0; i < 100; ++i) {
    const auto spec = random_start(random, i % 2 == 0);
    auto mirror = spec;
    mirror.maneuver.initial_angle_rad *= -1;
    mirror.maneuver.initial_rate_rad_s *= -1;
    mirror.maneuver.final_angle_rad *= -1;
    mirror.disturbances.constant_N_m *= -1;
    const RunReport a = fly(spec), b = fly(mirror);
    EXPECT_EQ(a.metrics.final_error_rad, -b.metrics.final_error_rad) << i;
    EXPECT_EQ(a.metrics.thruster_on_time_s.by_sign.positive, b.metrics.thruster_on_time_s.by_sign.negative)
        << i;
    ASSERT_EQ(a.events_total, b.events_total) << i;
  }
}

TEST(IdealLaw, SundialsAgrees) {
  std::mt19937_64 random(14);
  int same = 0;
  for (int i = 0; i < 60; ++i) {
    const auto spec = random_start(random, i % 2 == 0);
    SCOPED_TRACE(i);
    const auto verification = make_on_off_axis_verification(spec);
    const auto opinion = compare(fly(spec), fly(*verification));
    same += opinion.same_event_sequence;
    for (const double difference : opinion.final_state_difference) EXPECT_NEAR(difference, 0, 1e-6);
  }
  // Where arcs accumulate the integrator gives up earlier.
  EXPECT_GE(same, 50);
}

// The line theta + tau omega = 0: theta falls as exp(-t/tau) (Bryson 1994, after Eq. 3.12).
TEST(IdealLaw, SlidesAlongALineExponentially) {
  OnOffAxisSpecification spec = ideal(unit_slew(1, 1));
  spec.law.gamma_bar = 0;
  spec.law.rate_gain_s = 2;
  spec.maneuver = {.initial_angle_rad = 1, .initial_rate_rad_s = -0.5, .final_angle_rad = 0};
  spec.duration_s = 6;
  spec.output_times_s = {1, 3};
  const RunReport report = fly(spec);
  EXPECT_NEAR(report.outputs[0].state[0], std::exp(-0.5), 1e-14);
  EXPECT_NEAR(report.outputs[1].state[1], -0.5 * std::exp(-1.5), 1e-14);
  EXPECT_NEAR(report.metrics.sliding_s, 6, 1e-12);
}

// Torque that the thrusters cannot match takes it off the line; with less of it, it comes back.
TEST(IdealLaw, ADisturbanceTakesItOffAndLetsItBack) {
  OnOffAxisSpecification spec = ideal(unit_slew(1.5, 1));
  spec.disturbances.steps = {{1.2, 2.0}, {1.4, -2.0}};
  spec.duration_s = 10;
  const RunReport report = fly(spec);
  std::vector<int> sliding;
  for (const SwitchEvent& event : report.events)
    if (event.channel == kSlidingEvent) sliding.push_back(event.mode);
  ASSERT_GE(sliding.size(), 3u);
  EXPECT_EQ((std::vector<int>(sliding.begin(), sliding.begin() + 3)), (std::vector<int>{1, 0, 1}));
  EXPECT_NEAR(report.metrics.final_error_rad, 0, 1e-9);
}

}  // namespace
