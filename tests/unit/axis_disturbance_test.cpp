// Hysteresis, switching delay, friction, steps, sinusoids and firing programs on a single axis. Bryson 1994,
// Problem 3.3.1(b): a limit cycle of 42.4 s, 2.06 deg and 0.2 deg/s.
#include <gtest/gtest.h>

#include "tests/unit/flexible_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;

OnOffAxisSpecification schmitt_trigger() {
  OnOffAxisSpecification spec;
  spec.law.gamma_bar = 0;
  spec.law.rate_gain_s = 5;
  spec.law.deadband = Deadband::double_sided;
  spec.law.deadband_rad = 3 * kRadPerDeg;
  spec.law.hysteresis_rad = 2 * kRadPerDeg;
  spec.actuator.torque_N_m = kRadPerDeg / 3;
  spec.maneuver.initial_angle_rad = 2 * kRadPerDeg;
  spec.maneuver.initial_rate_rad_s = 0.2 * kRadPerDeg;
  spec.duration_s = 500;
  spec.telemetry_period_s = 1;
  return spec;
}

TEST(SchmittTrigger, LimitCycle) {
  const auto cycle = fly(schmitt_trigger()).metrics.limit_cycle;
  ASSERT_TRUE(cycle);
  EXPECT_NEAR(cycle->period_s, 42.4, 1e-9);
  EXPECT_NEAR(cycle->amplitude_rad / kRadPerDeg, 2.06, 1e-9);
  EXPECT_NEAR(cycle->rate_amplitude_rad_s / kRadPerDeg, 0.2, 1e-12);
  EXPECT_NEAR(cycle->coast_s, 20, 1e-9);
  EXPECT_NEAR(cycle->firing_s, 1.2, 1e-9);
}

// Near the limit cycle each half cycle leaves -(tau - omega_c/N)/(tau + omega_c/N) of what the rate is off:
// -0.7857.
TEST(SchmittTrigger, TheLimitCycleAttracts) {
  auto spec = schmitt_trigger();
  const double cycle = 0.2 * kRadPerDeg, off = 1e-4 * kRadPerDeg;
  spec.maneuver.initial_rate_rad_s = cycle + off;
  spec.maneuver.initial_angle_rad = 3 * kRadPerDeg - 5 * spec.maneuver.initial_rate_rad_s;
  spec.duration_s = 5;  // one firing, and on the way to the next
  const double rate = fly(spec).metrics.residual_rate_rad_s;
  EXPECT_NEAR((-rate - cycle) / off, -0.7857, 1e-3);
}

// Derived: omega_m = N D (2 tau - D)/(2 (tau - D)), period 4 omega_m/N, amplitude omega_m^2/(2 N).
TEST(SwitchingDelay, LimitCycle) {
  std::mt19937_64 random(21);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int i = 0; i < 40; ++i) {
    OnOffAxisSpecification spec;
    spec.law.gamma_bar = 0;
    const double tau = spec.law.rate_gain_s = uniform(0.5, 5);
    const double delay = spec.actuator.switching_delay_s = uniform(0.02, 0.5) * tau;
    const double n = spec.actuator.torque_N_m = uniform(0.1, 2);
    const double rate = n * delay * (2 * tau - delay) / (2 * (tau - delay));
    spec.maneuver.initial_rate_rad_s = rate * uniform(0.5, 1.5);
    spec.duration_s = 400 * tau;
    spec.telemetry_period_s = tau;
    const auto cycle = fly(spec).metrics.limit_cycle;
    ASSERT_TRUE(cycle) << i;
    EXPECT_NEAR(cycle->period_s, 4 * rate / n, 1e-6 * tau) << i;
    EXPECT_NEAR(cycle->rate_amplitude_rad_s, rate, 1e-6 * rate) << i;
    EXPECT_NEAR(cycle->amplitude_rad, rate * rate / (2 * n), 1e-6 * rate * tau) << i;
  }
}

// From rest at theta_0 under friction F < N: N - F accelerates, N + F brakes.
TEST(Friction, SlowsDownAndHolds) {
  OnOffAxisSpecification spec;
  spec.evaluation = Evaluation::program;
  spec.law.gamma_bar = 0;
  spec.program = {{1, 3, 1}, {3, 3.5, -1}};
  spec.disturbances.friction_N_m = 0.25;
  spec.duration_s = 20;
  spec.telemetry_period_s = 1;
  spec.output_times_s = {0.5, 3, 3.5};
  const RunReport report = fly(spec);
  EXPECT_EQ(report.outputs[0].state[1], 0);
  EXPECT_NEAR(report.outputs[1].state[1], 1.5, 1e-14);
  EXPECT_NEAR(report.outputs[2].state[1], 1.5 - 0.625, 1e-14);
  // Then friction alone: 0.875/0.25 = 3.5 s.
  EXPECT_NEAR(*report.metrics.first_rest_s, 7, 1e-12);
  EXPECT_NEAR(report.metrics.final_error_rad, 0.5 * 0.75 * 4 + 0.5 * (1.5 + 0.875) * 0.5 + 0.5 * 0.875 * 3.5,
              1e-12);
  EXPECT_EQ(report.metrics.residual_rate_rad_s, 0);
}

TEST(Friction, HoldsUntilATorqueIsLarger) {
  OnOffAxisSpecification spec;
  spec.evaluation = Evaluation::program;
  spec.disturbances.friction_N_m = 0.5;
  spec.disturbances.sinusoids = {{1.0, 1.0, 0}};  // sin t exceeds 0.5 from pi/6 on
  spec.duration_s = 0.6;
  spec.telemetry_period_s = 0.1;
  spec.output_times_s = {0.52, 0.6};
  const RunReport report = fly(spec);
  EXPECT_EQ(report.outputs[0].state[1], 0);
  const double t = 0.6, t0 = std::numbers::pi / 6;
  EXPECT_NEAR(report.outputs[1].state[1], std::cos(t0) - std::cos(t) - 0.5 * (t - t0), 1e-12);
}

TEST(FiringProgram, APulseOnTheFlexibleSpacecraft) {
  OnOffAxisSpecification spec = flexible_slew(1, 1);
  spec.evaluation = Evaluation::program;
  spec.law.end_box.reset();
  spec.program = {{0, 5, 1}};
  spec.disturbances = {};
  spec.duration_s = 8;
  spec.output_times_s = {5, 8};
  const RunReport report = fly(spec);
  EXPECT_NEAR(report.outputs[0].state[0] / kRadPerDeg, 16.6395, 1e-3);
  EXPECT_NEAR(report.outputs[1].state[0] / kRadPerDeg, 36.4109, 2e-3);
  EXPECT_NEAR(report.outputs[1].state[4], 1.5, 1e-12);
}

// Every regularisation with every disturbance, rigid and flexible.
OnOffAxisSpecification anything(std::mt19937_64& random, bool has_friction = true) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  auto spec = random_flexible_slew(random, random() % 2 == 0);
  if (random() % 2) spec.plant.modes.clear();
  const double thrust = spec.actuator.torque_N_m;
  if (random() % 3 == 0) {
    spec.law.gamma_bar = 0;
    spec.law.rate_gain_s = uniform(0.5, 3);
  }
  spec.law.end_box.reset();
  switch (random() % 5) {
    case 0:
      break;
    case 1:
      spec.evaluation = Evaluation::continuous;
      spec.actuator.minimum_on_time_s = 0;
      spec.law.hysteresis_rad = uniform(0.005, 0.01);
      break;
    case 2:
      spec.evaluation = Evaluation::continuous;
      spec.actuator.minimum_on_time_s = 0;
      spec.actuator.switching_delay_s = uniform(0.02, 0.1);
      break;
    case 3:
      spec.evaluation = Evaluation::ideal;
      spec.actuator.minimum_on_time_s = 0;
      break;
    case 4:
      spec.evaluation = Evaluation::program;
      spec.program = {{0.3, 1.7, 1}, {1.7, 2.2, -1}, {4, 5, -1}};
      break;
  }
  if (random() % 2)
    spec.disturbances.steps = {{uniform(0, 3), uniform(-0.05, 0.05) * thrust},
                               {uniform(3, 6), 0.02 * thrust}};
  if (random() % 2)
    spec.disturbances.sinusoids = {{uniform(0, 0.1) * thrust, uniform(0.3, 5), uniform(-3, 3)}};
  if (has_friction && random() % 3 == 0) spec.disturbances.friction_N_m = uniform(0, 0.1) * thrust;
  return spec;
}

TEST(AnyAxis, SundialsAgrees) {
  std::mt19937_64 random(22);
  int same = 0, compared = 0;
  for (int i = 0; i < 150; ++i) {
    SCOPED_TRACE(i);
    const auto spec = anything(random);
    const RunReport report = fly(spec);
    ASSERT_FALSE(report.failure) << report.failure->sentence;
    const auto verification = make_on_off_axis_verification(spec);
    const auto opinion = compare(report, fly(*verification));
    ++compared;
    same += opinion.same_event_sequence;
    if (!opinion.same_event_sequence) continue;
    for (const double difference : opinion.final_state_difference) EXPECT_NEAR(difference, 0, 2e-6);
  }
  // A grazing crossing, or arcs that accumulate, may part the two.
  EXPECT_GE(same, compared * 9 / 10);
}

// I omega + sum D q' is the integral of every torque but friction's, which the balance leaves out.
TEST(AnyAxis, MomentumIsBalancedInAThousandRandomRuns) {
  std::mt19937_64 random(23);
  for (int i = 0; i < 1000; ++i) {
    const auto spec = anything(random, false);
    const RunReport report = fly(spec);
    ASSERT_FALSE(report.failure) << i << report.failure->sentence;
    const auto& state = report.metrics.final_state;
    const std::size_t n = spec.plant.modes.size();
    const double t_s = report.metrics.end_time_s;
    double momentum = spec.plant.inertia_kg_m2 * state[1];
    for (std::size_t k = 0; k < n; ++k) momentum += spec.plant.modes[k].coupling_sqrt_kg_m * state[5 + n + k];
    const auto& on = report.metrics.thruster_on_time_s;
    double impulse = spec.actuator.torque_N_m * (on.by_sign.positive - on.by_sign.negative) +
                     spec.disturbances.constant_N_m * t_s +
                     spec.plant.inertia_kg_m2 * spec.maneuver.initial_rate_rad_s;
    for (const StepDisturbance& step : spec.disturbances.steps)
      impulse += step.torque_N_m * std::max(0.0, t_s - step.from_s);
    for (const Sinusoid& one : spec.disturbances.sinusoids)
      impulse += one.amplitude_N_m / one.frequency_rad_s *
                 (std::cos(one.phase_rad) - std::cos(one.frequency_rad_s * t_s + one.phase_rad));
    EXPECT_NEAR(momentum, impulse, 1e-9 * (spec.actuator.torque_N_m * (on.total + 1))) << i;
  }
}

TEST(AnyAxis, PiecesChangeNoBit) {
  std::mt19937_64 random(24);
  for (int i = 0; i < 60; ++i) {
    const auto spec = anything(random);
    const RunReport whole = fly(spec);
    auto run = make_on_off_axis_run(spec);
    Recorder recorder;
    double until_s = 0;
    while (run->advance(until_s, 7, recorder) == RunStatus::running) {
      until_s += 0.0137;
      if (random() % 16 == 0) run = run->clone();
    }
    EXPECT_EQ(run->report().digest, whole.digest) << i;
  }
}

}  // namespace
