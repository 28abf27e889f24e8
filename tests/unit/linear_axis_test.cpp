// Bryson 1994, Eqs. 3.1 and 3.2 with D = K = 2, I = 1: from rest at theta_0, theta = theta_0 exp(-t) (cos t +
// sin t), which overshoots by exp(-pi), at t = pi.
#include <gtest/gtest.h>

#include "server/propagation/taylor_arc.hpp"
#include "tests/unit/linear_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using std::numbers::pi;

TEST(LinearAxis, TheDoubleIntegrator) {
  auto spec = attitude_rate();
  spec.output_times_s = {0, 0.3, 1, 2.5, pi, 9.99};
  const double theta_0 = spec.maneuver.initial_angle_rad;
  const RunReport report = fly(spec);
  ASSERT_EQ(report.outputs.size(), 6u);
  for (const OutputRow& row : report.outputs) {
    const double t = row.t_s, angle = theta_0 * std::exp(-t) * (std::cos(t) + std::sin(t));
    const double rate = -2 * theta_0 * std::exp(-t) * std::sin(t);
    EXPECT_NEAR(row.state[0], angle, 1e-15) << t;
    EXPECT_NEAR(row.state[1], rate, 1e-15) << t;
    EXPECT_NEAR(row.thrusters[0], -2 * angle - 2 * rate, 4e-15) << t;
  }
  const Metrics& m = report.metrics;
  EXPECT_NEAR(*m.overshoot_rad, theta_0 * std::exp(-pi), 1e-15);
  EXPECT_NEAR(*m.crossing_s, 0.75 * pi, 1e-13);
  EXPECT_NEAR(m.extrema.at(0).t_s, pi, 1e-13);
  EXPECT_NEAR(m.extrema.at(1).t_s, 2 * pi, 1e-12);
  EXPECT_NEAR(m.extrema.at(1).error_rad, theta_0 * std::exp(-2 * pi), 1e-15);
  EXPECT_NEAR(m.peak_rate_rad_s, 2 * theta_0 * std::exp(-pi / 4) * std::sin(pi / 4), 1e-10);
  // Q = -2 theta_0 exp(-t) (cos t - sin t): against the slew, which is towards -theta, from pi/4 on.
  EXPECT_NEAR(*m.switch_on_s, pi / 4, 1e-13);
  EXPECT_NEAR(*m.first_rest_s, pi, 1e-13);
  // Its integral is 2 theta_0 exp(-t) sin t, its square's over all time theta_0^2.
  double impulse = 0;
  for (int k = 0; k < 3; ++k) {
    const auto at = [&](double t) { return 2 * theta_0 * std::exp(-t) * std::sin(t); };
    const double from = k == 0 ? 0 : pi / 4 + (k - 1) * pi;
    impulse += std::abs(at(pi / 4 + k * pi) - at(from));
  }
  const double last =
      2 * theta_0 * (std::exp(-10) * std::sin(10) - std::exp(-pi / 4 - 2 * pi) * std::sin(pi / 4));
  EXPECT_NEAR(m.angular_impulse_N_m_s, impulse + std::abs(last), 1e-13);
  // Of 4 theta_0^2 exp(-2 t) (1 - sin 2 t).
  const auto square = [&](double t) {
    return theta_0 * theta_0 * std::exp(-2 * t) * (std::sin(2 * t) + std::cos(2 * t) - 2);
  };
  EXPECT_NEAR(m.control_effort_N2_m2_s, square(10) - square(0), 1e-13);
  EXPECT_EQ(m.firings.total, 0u);
  EXPECT_EQ(m.thruster_on_time_s.total, 0);
  EXPECT_FALSE(m.braking_duty);
  EXPECT_EQ(report.events_total, 0u);
}

// |theta| <= 1 % of theta_0 for good: the last time that exp(-t) |cos t + sin t| = 0.01.
TEST(LinearAxis, SettlingTime) {
  const double settled = *fly(attitude_rate()).metrics.settling_time_s;
  EXPECT_NEAR(std::exp(-settled) * std::abs(std::cos(settled) + std::sin(settled)), 0.01, 1e-14);
  EXPECT_GT(settled, pi);
  EXPECT_LT(settled, 5.5);
}

TEST(LinearAxis, Propellant) {
  auto spec = attitude_rate();
  spec.actuator = {.lever_arm_m = 2, .specific_impulse_s = 60, .gas_density_kg_m3 = 0.5};
  const Metrics m = fly(spec).metrics;
  EXPECT_NEAR(*m.propellant_kg, m.angular_impulse_N_m_s / (2 * 60 * 9.80665), 1e-18);
  EXPECT_NEAR(*m.gas_volume_m3, *m.propellant_kg / 0.5, 1e-18);
  EXPECT_NEAR(*m.control_effort_N2_s, m.control_effort_N2_m2_s / 4, 1e-18);
}

// (s^2 + 2 s + 2)^2, which no expansion in eigenvectors can fly: an estimate that begins wrong by e_0 moves
// theta'' + 2 theta' + 2 theta = 2 (e_q + e), with e_q = -2 e_0 exp(-t) sin t and e = e_0 exp(-t) (cos t -
// sin t): resonance, theta = e_0 exp(-t) (t (3 cos t + sin t) - 3 sin t) for theta_0 = 0.
TEST(LinearAxis, DoublePoles) {
  auto spec = problem_3_2_2();
  spec.maneuver = {};
  spec.estimate.error_rad = -0.1;
  spec.output_times_s = {0.5, 1, 2, 4, 8};
  for (const OutputRow& row : fly(spec).outputs) {
    const double t = row.t_s;
    EXPECT_NEAR(row.state[0], 0.1 * std::exp(-t) * (t * (3 * std::cos(t) + std::sin(t)) - 3 * std::sin(t)),
                1e-15)
        << t;
  }
}

// A constant torque T leaves the angle T/K off; a sinusoid comes through with 1/|s^2 + D s + K|.
TEST(LinearAxis, Disturbances) {
  auto spec = attitude_rate();
  spec.disturbances.steps = {{3.3, 0.5}};
  spec.disturbances.constant_N_m = -0.1;
  spec.duration_s = 60;
  EXPECT_NEAR(fly(spec).metrics.final_error_rad, 0.4 / 2, 1e-15);
  spec.disturbances = {};
  spec.disturbances.sinusoids = {{0.3, 1.7, 0.4}};
  spec.output_times_s = {55};
  const std::complex<double> s{0, 1.7};
  const auto forced = std::polar(0.3, 1.7 * 55 + 0.4) / (s * s + 2.0 * s + 2.0);
  EXPECT_NEAR(fly(spec).outputs.at(0).state[0], forced.imag(), 1e-14);
}

// Before a step disturbance nothing is felt of it, and its time cuts a step.
TEST(LinearAxis, AStepIsFeltFromItsTimeOn) {
  auto spec = attitude_rate();
  spec.maneuver = {};
  spec.disturbances.steps = {{2.0 / 3, 1}};
  spec.output_times_s = {2.0 / 3, 2.0 / 3 + 1e-3, 2.0 / 3 + 1};
  const auto outputs = fly(spec).outputs;
  EXPECT_EQ(outputs[0].state[0], 0);
  EXPECT_NEAR(outputs[1].state[0], 0.5e-6, 1e-9);
  EXPECT_NEAR(outputs[2].state[0], 0.5 * (1 - std::exp(-1) * (std::cos(1) + std::sin(1))), 1e-15);
}

TEST(LinearAxis, StopsAtTheFirstRest) {
  auto spec = attitude_rate();
  spec.stop = StopCondition::first_rest;
  const RunReport report = fly(spec);
  EXPECT_EQ(report.stop_reason, "first_rest");
  EXPECT_NEAR(report.metrics.end_time_s, pi, 1e-13);
  EXPECT_NEAR(report.metrics.residual_rate_rad_s, 0, 1e-15);
  // Critically damped it comes to rest nowhere, however long.
  spec.feedback.law = AttitudeRateFeedback{1, 2};
  spec.duration_s = 100;
  spec.maneuver.final_angle_rad = 0.3;
  const RunReport never = fly(spec);
  EXPECT_EQ(never.stop_reason, "duration");
  EXPECT_FALSE(never.metrics.crossing_s);
  EXPECT_TRUE(never.metrics.extrema.empty());
  // Nor does rounding about an equilibrium that a disturbance moves away count as one.
  spec.disturbances.constant_N_m = 0.01;
  EXPECT_EQ(fly(spec).stop_reason, "duration");
}

TEST(LinearAxis, MirrorImage) {
  std::mt19937_64 random(8);
  for (int i = 0; i < 20; ++i) {
    auto plus = random_loop(random, i % 2);
    auto minus = plus;
    minus.maneuver = {-plus.maneuver.initial_angle_rad, -plus.maneuver.initial_rate_rad_s,
                      -plus.maneuver.final_angle_rad};
    minus.estimate.rate_rad_s *= -1;
    if (minus.estimate.error_rad) *minus.estimate.error_rad *= -1;
    minus.disturbances.constant_N_m *= -1;
    for (auto& step : minus.disturbances.steps) step.torque_N_m *= -1;
    for (auto& one : minus.disturbances.sinusoids) one.amplitude_N_m *= -1;
    const Metrics a = fly(plus).metrics, b = fly(minus).metrics;
    EXPECT_EQ(a.final_error_rad, -b.final_error_rad);
    EXPECT_EQ(a.settling_time_s, b.settling_time_s);
    EXPECT_EQ(a.peak_rate_rad_s, b.peak_rate_rad_s);
    EXPECT_EQ(a.angular_impulse_N_m_s, b.angular_impulse_N_m_s);
    EXPECT_EQ(a.first_rest_s, b.first_rest_s);
  }
}

TEST(LinearAxis, SundialsAgrees) {
  std::mt19937_64 random(9);
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(i);
    auto spec = random_loop(random, i % 3 > 0);
    spec.verification_tolerance = 1e-11;
    const auto verification = make_linear_axis_verification(spec);
    const auto opinion = compare(fly(spec), fly(*verification));
    EXPECT_TRUE(opinion.same_event_sequence);
    EXPECT_EQ(opinion.final_time_difference_s, 0);
    for (const double difference : opinion.final_state_difference) EXPECT_NEAR(difference, 0, 1e-8);
    EXPECT_NE(opinion.final_state_difference[1], 0);
  }
}

TEST(LinearAxis, SundialsFindsTheSameRest) {
  std::mt19937_64 random(10);
  int rests = 0;
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    auto spec = random_loop(random, false);
    spec.stop = StopCondition::first_rest;
    const auto verification = make_linear_axis_verification(spec);
    const RunReport ours = fly(spec), theirs = fly(*verification);
    EXPECT_EQ(ours.stop_reason, theirs.stop_reason);
    EXPECT_NEAR(ours.metrics.end_time_s, theirs.metrics.end_time_s, 1e-6);
    rests += ours.stop_reason == "first_rest";
  }
  EXPECT_GT(rests, 20);
}

// I omega + sum D q' is the integral of the torques: from the state at the end, and from samples of the
// torque by Simpson's rule.
TEST(LinearAxis, MomentumIsBalanced) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 100; ++i) {
    auto spec = random_loop(random, true);
    spec.disturbances.sinusoids.clear();
    spec.disturbances.steps.clear();
    spec.plant.modes.resize(1);
    spec.plant.modes[0].frequency_rad_s = 3;
    spec.telemetry_period_s = 1e-3;
    Recorder recorder;
    const auto run = make_linear_axis_run(spec);
    run->advance(1e9, 1 << 30, recorder);
    ASSERT_EQ(recorder.rows.size(), 10001u);
    double impulse = spec.disturbances.constant_N_m * 10;
    for (std::size_t k = 0; k < recorder.rows.size(); ++k) {
      const bool is_end = k == 0 || k + 1 == recorder.rows.size();
      impulse += recorder.rows[k].values.back() * (is_end ? 1 : k % 2 ? 4 : 2) * 1e-3 / 3;
    }
    const auto& begin = recorder.rows.front().values;
    const double gained = run->report().metrics.final_state[3] - begin[3];
    EXPECT_NEAR(gained, impulse, 1e-9 * (std::abs(impulse) + spec.plant.inertia_kg_m2)) << i;
  }
}

// ---- the same bits

TEST(LinearAxis, PiecesAndCopiesChangeNoBit) {
  std::mt19937_64 random(12);
  for (int i = 0; i < 10; ++i) {
    const auto spec = random_loop(random, i % 2);
    Recorder whole;
    const auto one = make_linear_axis_run(spec);
    one->advance(1e9, 1 << 30, whole);
    Recorder pieces;
    auto run = make_linear_axis_run(spec);
    for (double until_s = 0;
         run->advance(until_s, static_cast<int>(random() % 5), pieces) == RunStatus::running;) {
      until_s += std::uniform_real_distribution<double>(0, 0.05)(random);
      if (random() % 16 == 0) run = run->clone();
    }
    EXPECT_EQ(run->report().digest, one->report().digest);
    EXPECT_EQ(pieces.rows, whole.rows);
  }
}

TEST(LinearAxis, TelemetryAndOutputsLeaveTheTrajectoryAlone) {
  auto spec = problem_3_2_2();
  const auto digest = fly(spec).digest;
  spec.telemetry_period_s = 0.0371;
  spec.output_times_s = {0.1, 0.2, 3.33333};
  const auto report = fly(spec);
  EXPECT_EQ(report.digest, digest);
  EXPECT_EQ(report.outputs.size(), 3u);
  // It is a digest of the flight: another one has another.
  spec.feedback.loop_gain = 1 + 1e-15;
  EXPECT_NE(fly(spec).digest, digest);
}

TEST(LinearAxis, NothingIsHandedOutAheadOfTime) {
  const auto run = make_linear_axis_run(problem_3_2_4());
  Recorder recorder;
  for (const double until_s : {0.0, 0.05, 0.3, 1.234}) {
    run->advance(until_s, 1 << 30, recorder);
    EXPECT_LE(recorder.rows.back().t_s, until_s);
    EXPECT_GT(recorder.rows.back().t_s, until_s - 0.1 - 1e-12);
    EXPECT_EQ(run->t_s(), until_s);
  }
}

TEST(LinearAxis, WhatGrowsBeyondNumbersHasDiverged) {
  auto spec = lead(1000, 10, 0.1);
  spec.duration_s = 1e4;
  const auto run = make_linear_axis_run(spec);
  Recorder recorder;
  EXPECT_EQ(run->advance(1e9, 1 << 30, recorder), RunStatus::failed);
  EXPECT_EQ(run->report().failure->code, "diverged");
}

// ---- the power series by itself

TEST(TaylorArc, IsTheExponential) {
  Eigen::MatrixXd a{{0, 1, 0}, {-9, -0.6, 0.1}, {0, 0, -4}};
  const auto system = std::make_shared<const LinearSystem>(a, Eigen::Vector3d(0, 1, 0));
  TaylorArc arc(system, Eigen::Vector3d(0.3, -0.2, 1));
  arc.expand(0.7);
  const double h = system->step_s();
  std::vector<double> state(3), half(3);
  arc.state_at(h, state);
  arc.state_at(0.5 * h, half);
  EXPECT_NEAR(state[2], std::exp(-4 * h), 1e-16);
  arc.move(0.5 * h);
  arc.expand(0.7);
  std::vector<double> there(3);
  arc.state_at(0.5 * h, there);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(there[i], state[i], 1e-15);
  // The dense output obeys the equation, with its derivative within its bound.
  const TaylorPolynomial angle = arc.component(0), rate = arc.component(1);
  for (const double tau : {0.0, 0.3 * h, h}) {
    EXPECT_NEAR(angle.slope(tau), rate.value(tau), 1e-15);
    EXPECT_LE(std::abs(rate.slope(tau)), rate.slope_bound(h));
  }
}

TEST(TaylorArc, IntegralsAreThoseOfThePolynomial) {
  TaylorPolynomial p;
  p.c[0] = 1;
  p.c[2] = -3;
  EXPECT_DOUBLE_EQ(p.integral(0.5, 2), 1.5 - (8 - 0.125));
  EXPECT_DOUBLE_EQ(p.integral_of_square(0, 2), 2 - 2.0 * 8 + 9.0 * 32 / 5);
}

}  // namespace
