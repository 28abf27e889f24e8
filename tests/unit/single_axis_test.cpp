// Agrawal & Bang 1995: t1 = 0.92582, coast 0.108012, t_slew = 2.05223 at gamma = 1.1, epsilon = 0.1.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/unit/single_axis_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;

TEST(SingleAxis, SingleSidedBandComesToRestWithoutOvershoot) {
  const auto metrics = fly(single_sided(1.1, 0.1, 1e-4)).metrics;
  EXPECT_NEAR(*metrics.first_rest_s, 2.05223, 5e-4);
  EXPECT_NEAR(*metrics.coast_s, 0.108012, 2e-4);
  EXPECT_NEAR(metrics.thruster_on_time_s.total, 1.85164, 5e-4);
  EXPECT_NEAR(metrics.thruster_on_time_s.accelerating.positive, 0.92582, 2e-4);
  EXPECT_NEAR(*metrics.braking_duty, 0.909091, 2e-3);
  EXPECT_EQ(metrics.firings.by_sign.positive, 1u);
  EXPECT_LT(*metrics.overshoot_rad, 1e-6);
}

TEST(SingleAxis, MinimumOnTimeGivesEighteenFirings) {
  auto spec = continuous(single_sided(1.1, 0.1, 0), 0.05);
  spec.law.end_box = EndBox{0.01, 0.05};
  spec.stop = StopCondition::end_box;
  const auto report = fly(spec);
  EXPECT_EQ(report.stop_reason, "end_box");
  EXPECT_EQ(report.metrics.firings.by_sign.positive, 1u);
  EXPECT_NEAR(static_cast<double>(report.metrics.firings.by_sign.negative), 18, 1);
  EXPECT_NEAR(*report.metrics.switch_on_s, 1.03383, 1e-5);
  EXPECT_NEAR(report.metrics.thruster_on_time_s.total, 1.80164, 3e-3);
  EXPECT_NEAR(*report.metrics.end_box_entry_s, 2.002, 5e-3);
  // Located on the side of the box, not near it.
  EXPECT_NEAR(report.metrics.residual_rate_rad_s, 0.05, 1e-14);
}

TEST(SingleAxis, BandAsWideAsTheSlewNeverFires) {
  for (auto spec : {single_sided(1.1, 1.0, 1e-3), continuous(single_sided(1.1, 1.0, 0), 0.01)}) {
    spec.stop = StopCondition::duration;
    const auto report = fly(spec);
    EXPECT_EQ(report.metrics.firings.total, 0u);
    EXPECT_EQ(report.metrics.final_error_rad, -1.0);
    EXPECT_FALSE(report.metrics.crossing_s.has_value());
  }
}

TEST(SingleAxis, CoarselySampledClassicalLawFiresFivePulsesEachWay) {
  auto spec = unit_slew(1.1, 0.00998);
  spec.law.end_box = EndBox{0.01, 0.05};
  spec.stop = StopCondition::end_box;
  const auto metrics = fly(spec).metrics;
  EXPECT_EQ(metrics.firings.by_sign.positive, 5u);
  EXPECT_EQ(metrics.firings.by_sign.negative, 5u);
  EXPECT_NEAR(metrics.thruster_on_time_s.total, 1.98602, 1e-9);
  EXPECT_NEAR(*metrics.end_box_entry_s, 1.98602, 1e-9);
}

TEST(SingleAxis, GammaBelowOneOvershoots) {
  auto spec = unit_slew(0.9, 1e-4);
  spec.stop = StopCondition::duration;
  spec.duration_s = 4;
  const auto metrics = fly(spec).metrics;
  EXPECT_NEAR(*metrics.switch_on_s, 1.02598, 1.1e-4);
  EXPECT_NEAR(*metrics.overshoot_rad, 0.0526316, 1e-4);
  EXPECT_NEAR(*metrics.first_rest_s, 2.05196, 2e-4);
  ASSERT_GE(metrics.extrema.size(), 2u);
  EXPECT_NEAR(metrics.extrema[1].error_rad, -0.00277008, 1e-4);
}

TEST(SingleAxis, DoubleSidedBandRestsAtEpsilon) {
  auto spec = unit_slew(1.1, 1e-4);
  spec.law.deadband = Deadband::double_sided;
  spec.law.deadband_rad = 0.1;
  const auto metrics = fly(spec).metrics;
  EXPECT_NEAR(*metrics.coast_s, 0.216025, 2e-4);
  EXPECT_NEAR(*metrics.first_rest_s, 2.16025, 5e-4);
  EXPECT_NEAR(*metrics.rest_error_rad, 0.1, 1e-4);
}

TEST(SingleAxis, ConstantDisturbanceAlongTheSlewOvershoots) {
  auto spec = unit_slew(1, 1e-3);
  spec.plant.inertia_kg_m2 = spec.law.inertia_kg_m2 = 13;
  spec.actuator.torque_N_m = spec.law.torque_N_m = 0.3;
  spec.maneuver.final_angle_rad = 50 * M_PI / 180;
  spec.disturbances.constant_N_m = 0.018;
  spec.stop = StopCondition::duration;
  const auto metrics = fly(spec).metrics;
  EXPECT_NEAR(*metrics.overshoot_rad * 180 / M_PI, 1.64222, 0.015);
  EXPECT_NEAR(metrics.peak_rate_rad_s * 180 / M_PI, 8.2484, 5e-3);
}

// Closed forms of the Filippov limit, single-sided band, gamma >= 1 (derived from Eqs. 8, 11 and 19).
struct ClosedForm {
  double t1, coast, slew, on;
  ClosedForm(double gamma, double epsilon, double delta, double a) {
    t1 = std::sqrt(2 * (delta - epsilon) / (a * (1 + gamma)));
    coast = epsilon / (a * t1);
    slew = t1 + coast + gamma * t1;
    on = 2 * t1;
  }
};

// 200 random slews of either sign, each bounded by a few periods; the sums fall with the period.
TEST(SingleAxis, ErrorFallsInProportionToTheSamplePeriod) {
  std::mt19937_64 random(20260101);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  double coarse_rest = 0, fine_rest = 0, coarse_on = 0, fine_on = 0;
  for (int i = 0; i < 200; ++i) {
    const double gamma = uniform(1, 2), delta = uniform(0.1, 3), epsilon = uniform(0.01, 0.6) * delta;
    const double inertia = std::pow(10, uniform(-1, 3)), torque = std::pow(10, uniform(-2, 1));
    const double a = torque / inertia, start = uniform(-1, 1);
    const ClosedForm exact(gamma, epsilon, delta, a);
    SCOPED_TRACE(i);
    const auto errors_at = [&](double period_s) {
      auto spec = single_sided(gamma, epsilon, period_s);
      spec.plant.inertia_kg_m2 = inertia;
      spec.law.inertia_kg_m2 = gamma * inertia;
      spec.actuator.torque_N_m = spec.law.torque_N_m = torque;
      spec.maneuver.initial_angle_rad = start;
      spec.maneuver.final_angle_rad = start + (i % 2 ? delta : -delta);
      spec.duration_s = 3 * exact.slew;
      spec.telemetry_period_s = exact.slew;
      const auto metrics = fly(spec).metrics;
      EXPECT_NEAR(metrics.thruster_on_time_s.total, exact.on, 3 * period_s);
      EXPECT_NEAR(*metrics.coast_s, exact.coast, 3 * period_s * (1 + exact.coast / exact.t1));
      EXPECT_LE(*metrics.overshoot_rad, 4 * period_s * a * exact.t1);
      EXPECT_NEAR(*metrics.first_rest_s, exact.slew, 5 * period_s * (1 + exact.coast / exact.t1));
      EXPECT_LE(std::abs(*metrics.rest_error_rad), 4 * period_s * a * exact.t1);
      return std::pair(std::abs(*metrics.first_rest_s - exact.slew) / exact.slew,
                       std::abs(metrics.thruster_on_time_s.total - exact.on) / exact.slew);
    };
    const auto [rest, on] = errors_at(exact.slew / 1000);
    const auto [finer_rest, finer_on] = errors_at(exact.slew / 8000);
    coarse_rest += rest;
    fine_rest += finer_rest;
    coarse_on += on;
    fine_on += finer_on;
  }
  // First order: an eighth of the period, about an eighth of the error.
  // A rest falls on a sample: its error is a whole number of periods, mostly 0 or 1.
  EXPECT_GT(coarse_rest / fine_rest, 4);
  EXPECT_NEAR(coarse_on / fine_on, 8, 2);
}

TEST(SingleAxis, MinimumOnTimeConvergesToTheSameLimit) {
  const ClosedForm exact(1.3, 0.2, 1, 1);
  double before = HUGE_VAL;
  for (const double t_on : {0.04, 0.01, 0.0025}) {
    const auto metrics = fly(continuous(single_sided(1.3, 0.2, 0), t_on)).metrics;
    EXPECT_NEAR(*metrics.coast_s, exact.coast, 1e-12);
    const double error = std::abs(*metrics.first_rest_s - exact.slew);
    EXPECT_LT(error, 2 * t_on);
    EXPECT_LT(error, before);
    before = error;
  }
}

TEST(SingleAxis, NegativeSlewIsTheMirrorImageBitForBit) {
  auto spec = continuous(single_sided(1.1, 0.1, 0), 0.05);
  Recorder plus, minus;
  make_on_off_axis_run(spec)->advance(1e9, 1 << 30, plus);
  spec.maneuver.final_angle_rad = -1;
  make_on_off_axis_run(spec)->advance(1e9, 1 << 30, minus);
  ASSERT_EQ(plus.rows.size(), minus.rows.size());
  for (std::size_t i = 0; i < plus.rows.size(); ++i) {
    EXPECT_EQ(plus.rows[i].t_s, minus.rows[i].t_s);
    for (std::size_t channel = 0; channel < 5; ++channel)
      EXPECT_EQ(plus.rows[i].values[channel], -minus.rows[i].values[channel]);
  }
  ASSERT_EQ(plus.events.size(), minus.events.size());
  for (std::size_t i = 0; i < plus.events.size(); ++i) EXPECT_EQ(plus.events[i].t_s, minus.events[i].t_s);
}

// A run cut into pieces is the same run.
TEST(SingleAxis, SlicesChangeNeitherDigestNorSamples) {
  std::mt19937_64 random(7);
  for (const auto& spec : {single_sided(1.1, 0.1, 1e-3), continuous(single_sided(1.1, 0.1, 0), 0.02)}) {
    Recorder whole;
    const auto one = make_on_off_axis_run(spec);
    one->advance(1e9, 1 << 30, whole);
    for (int repeat = 0; repeat < 10; ++repeat) {
      Recorder pieces;
      const auto run = make_on_off_axis_run(spec);
      double until_s = 0;
      RunStatus status = RunStatus::running;
      while (status == RunStatus::running) {
        until_s += std::uniform_real_distribution<double>(0, 0.05)(random);
        status = run->advance(until_s, std::uniform_int_distribution<int>(0, 20)(random), pieces);
      }
      EXPECT_EQ(run->report().digest, one->report().digest);
      EXPECT_EQ(pieces.rows, whole.rows);
    }
  }
}

TEST(SingleAxis, NothingIsHandedOutAheadOfTime) {
  const auto run = make_on_off_axis_run(single_sided(1.1, 0.1, 1e-3));
  Recorder recorder;
  for (const double until_s : {0.0, 0.005, 0.3, 1.234}) {
    run->advance(until_s, 1 << 30, recorder);
    EXPECT_LE(recorder.rows.back().t_s, until_s);
    EXPECT_GT(recorder.rows.back().t_s, until_s - 0.01 - 1e-12);
    EXPECT_EQ(run->t_s(), until_s);
  }
}

TEST(SingleAxis, TelemetryAndOutputsLeaveTheTrajectoryAlone) {
  auto spec = continuous(single_sided(1.1, 0.1, 0), 0.05);
  const auto digest = fly(spec).digest;
  spec.telemetry_period_s = 1e-3;
  EXPECT_EQ(fly(spec).digest, digest);
  spec.telemetry_period_s = 1;
  spec.output_times_s = {0, 0.4, 0.925820099772551, 1.5, 2.0};
  const auto report = fly(spec);
  EXPECT_EQ(report.digest, digest);
  ASSERT_EQ(report.outputs.size(), 5u);
  // While accelerating theta = t^2/2, to the last bit but one.
  EXPECT_DOUBLE_EQ(report.outputs[1].state[0], 0.08);
  EXPECT_DOUBLE_EQ(report.outputs[1].state[1], 0.4);
}

TEST(SingleAxis, OutputsAfterTheEndAreLeftOutAndSaidSo) {
  auto spec = single_sided(1.1, 0.1, 1e-3);
  spec.output_times_s = {1, 3, 4};
  const auto report = fly(spec);
  EXPECT_EQ(report.outputs.size(), 1u);
  ASSERT_EQ(report.warnings.size(), 1u);
}

TEST(SingleAxis, ASampleAtASwitchingShowsTheStateAfterIt) {
  auto spec = single_sided(1.1, 0.1, 0.01);
  Recorder recorder;
  make_on_off_axis_run(spec)->advance(1e9, 1 << 30, recorder);
  for (const SwitchEvent& event : recorder.events)
    if (event.channel == 0)
      for (const auto& row : recorder.rows)
        if (row.t_s == event.t_s) {
          EXPECT_EQ(row.values[4], event.mode) << "t = " << row.t_s;
        }
}

TEST(SingleAxis, ACloneGoesOnWithTheSameBits) {
  const auto spec = continuous(single_sided(1.1, 0.1, 0), 0.02);
  const auto run = make_on_off_axis_run(spec);
  Recorder recorder;
  run->advance(1.1, 1 << 30, recorder);
  const auto copy = run->clone();
  EXPECT_EQ(fly(*run).digest, fly(*copy).digest);
  EXPECT_EQ(run->report().digest, fly(spec).digest);
}

TEST(SingleAxis, TheLastBitOfTheInitialStateShows) {
  auto spec = single_sided(1.1, 0.1, 1e-3);
  spec.maneuver.initial_rate_rad_s = 0.01;
  const auto digest = fly(spec).digest;
  spec.maneuver.initial_rate_rad_s = std::nextafter(0.01, 1);
  EXPECT_NE(fly(spec).digest, digest);
}

TEST(SingleAxis, MomentumBalances) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 50; ++i) {
    auto spec = single_sided(std::uniform_real_distribution<double>(0.7, 1.6)(random), 0.1, 0.003);
    spec.maneuver.initial_rate_rad_s = std::uniform_real_distribution<double>(-0.5, 0.5)(random);
    spec.disturbances.constant_N_m = std::uniform_real_distribution<double>(-0.1, 0.1)(random);
    spec.stop = StopCondition::duration;
    spec.duration_s = 5;
    const auto metrics = fly(spec).metrics;
    const auto& on = metrics.thruster_on_time_s.by_sign;
    const double impulse = on.positive - on.negative + spec.disturbances.constant_N_m * 5;
    EXPECT_NEAR(metrics.residual_rate_rad_s - spec.maneuver.initial_rate_rad_s, impulse, 1e-11);
  }
}

TEST(SingleAxis, RestingSlewIsStoppedAtOnceWhenItBrakesBackwards) {
  auto spec = unit_slew(1.1, 1e-3);
  spec.maneuver.final_angle_rad = 0;  // nowhere to go; the law sees s > 0 from an initial rate
  spec.maneuver.initial_rate_rad_s = 0.2;
  const auto report = fly(spec);
  EXPECT_EQ(report.stop_reason, "first_rest");
  EXPECT_NEAR(*report.metrics.first_rest_s, 0.2, 2e-3);
}

}  // namespace
