// The flexible axis: Agrawal & Bang 1995 with Table 1's six modes. 0.3 N m for 5 s turn it by 16.6395 deg, at
// 6.40151 deg/s; its frequencies with the hub free begin at 0.188195 Hz.
#include <gtest/gtest.h>

#include "server/propagation/axis_events.hpp"
#include "tests/unit/flexible_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;

TEST(FlexibleAxis, OpenLoopPulseAndFreeFrequencies) {
  const ModalBasis basis(table_1_plant());
  const double free_hz[] = {0.188195, 0.444935, 2.48848, 4.30057, 6.87471, 12.8201};
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(basis.free_frequencies_rad_s()[i] / (2 * std::numbers::pi), free_hz[i], 1e-4);

  ModalArc arc(basis, 0, 0);
  arc.set_torque(0.3);
  arc.move(5);
  EXPECT_NEAR(arc.begin().angle_rad / kRadPerDeg, 16.6395, 1e-3);
  EXPECT_NEAR(arc.begin().rate_rad_s / kRadPerDeg, 6.40151, 1e-3);
  EXPECT_NEAR(arc.momentum_at(0), 1.5, 1e-6);
  std::vector<std::complex<double>> scratch(basis.size());
  std::vector<double> q(6), v(6);
  arc.deflection_at(0, scratch, q, v);
  EXPECT_NEAR(q[0], -0.00883887, 1e-4);
  arc.set_torque(0);
  EXPECT_NEAR(arc.at(3).angle_rad / kRadPerDeg, 36.4109, 2e-3);
  EXPECT_NEAR(arc.at(3).rate_rad_s / kRadPerDeg, 6.79526, 2e-3);
}

TEST(FlexibleAxis, StepsOfAnyLengthLeadToTheSamePlace) {
  const ModalBasis basis(table_1_plant());
  ModalArc whole(basis, 0.1, 0.02), parts(basis, 0.1, 0.02);
  whole.set_torque(0.3);
  parts.set_torque(0.3);
  const AxisMotion far = whole.at(7);
  for (int i = 0; i < 700; ++i) parts.move(0.01);
  EXPECT_NEAR(parts.begin().angle_rad, far.angle_rad, 1e-13);
  EXPECT_NEAR(parts.begin().rate_rad_s, far.rate_rad_s, 1e-13);
  EXPECT_NEAR(parts.begin().acceleration_rad_s2, far.acceleration_rad_s2, 1e-13);
}

// The acceleration is the rate's derivative and the rate the angle's.
TEST(FlexibleAxis, MotionIsConsistent) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 50; ++i) {
    const ModalBasis basis(random_plant(random));
    ModalArc arc(basis, 0.3, -0.1);
    arc.set_torque(0.2);
    arc.move(1.7);
    arc.set_torque(-0.1);
    const double tau = 0.37, d = 1e-5;
    const AxisMotion here = arc.at(tau), before = arc.at(tau - d), after = arc.at(tau + d);
    EXPECT_NEAR((after.angle_rad - before.angle_rad) / (2 * d), here.rate_rad_s, 1e-6);
    EXPECT_NEAR((after.rate_rad_s - before.rate_rad_s) / (2 * d), here.acceleration_rad_s2, 1e-4);
    EXPECT_LE(std::abs(here.acceleration_rad_s2), arc.acceleration_bound(0, 1));
    EXPECT_LE(std::abs(after.acceleration_rad_s2 - before.acceleration_rad_s2) / (2 * d),
              arc.jerk_bound(0, 1) * (1 + 1e-6) + 1e-9);
  }
}

// Against a look at 20,000 points: what they see is found, and nothing is found before it.
TEST(FlexibleAxis, NoCrossingIsMissed) {
  std::mt19937_64 random(3);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  int crossings = 0;
  for (int i = 0; i < 200; ++i) {
    const auto spec = random_flexible_slew(random, true);
    const ModalBasis basis(spec.plant);
    ModalArc arc(basis, uniform(-0.2, 0.2), uniform(-0.2, 0.2));
    arc.set_torque(spec.actuator.torque_N_m);
    arc.move(uniform(0, 3));
    arc.set_torque((static_cast<int>(random() % 3) - 1) * spec.actuator.torque_N_m);
    const SwitchingFunction law(spec.law, 0, 1);
    const auto side_at = [&](double tau) {
      const AxisMotion motion = arc.at(tau);
      return law.side(law.value(motion.angle_rad, motion.rate_rad_s));
    };
    constexpr int kLooks = 20000;
    constexpr double kLength_s = 8;
    const SwitchingSide begin = side_at(0);
    std::optional<double> seen;
    for (int k = 1; k <= kLooks && !seen; ++k)
      if (const double tau = kLength_s * k / kLooks; side_at(tau) != begin) seen = tau;
    const auto crossing = side_crossing(arc, law, begin, kLength_s);
    ASSERT_EQ(crossing.has_value(), seen.has_value()) << i;
    if (!seen) continue;
    ++crossings;
    EXPECT_LE(crossing->tau, *seen) << i;
    EXPECT_GE(crossing->tau, *seen - kLength_s / kLooks - 1e-12) << i;
    const AxisMotion there = arc.at(crossing->tau);
    const double s = law.value(there.angle_rad, there.rate_rad_s);
    EXPECT_NEAR(std::min(std::abs(s - law.lower_rad()), std::abs(s - law.upper_rad())), 0, 1e-13) << i;
  }
  EXPECT_GT(crossings, 50);
}

void expect_second_opinion(const OnOffAxisSpecification& spec, double tolerance) {
  const auto verification = make_on_off_axis_verification(spec);
  const auto opinion = compare(fly(spec), fly(*verification));
  EXPECT_TRUE(opinion.same_event_sequence);
  for (const double difference : opinion.final_state_difference) EXPECT_NEAR(difference, 0, tolerance);
  if (opinion.event_time_max_s) {
    EXPECT_LE(*opinion.event_time_max_s, tolerance);
  }
}

TEST(FlexibleAxis, SundialsAgreesOnTheSampledLaw) {
  expect_second_opinion(flexible_slew(1.0, 0.15), 1e-8);
  std::mt19937_64 random(4);
  for (int i = 0; i < 30; ++i) {
    SCOPED_TRACE(i);
    expect_second_opinion(random_flexible_slew(random, true), 1e-7);
  }
}

TEST(FlexibleAxis, SundialsAgreesOnTheMinimumOnTime) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 30; ++i) {
    SCOPED_TRACE(i);
    expect_second_opinion(random_flexible_slew(random, false), 1e-6);
  }
}

// I omega + sum D q' is the integral of the torque, exactly: from the state at the end, which went through
// the modes, and from the on-times, which did not.
TEST(FlexibleAxis, MomentumIsBalancedInAThousandRandomRuns) {
  std::mt19937_64 random(6);
  for (int i = 0; i < 1000; ++i) {
    auto spec = random_flexible_slew(random, i % 2 == 0);
    const RunReport report = fly(spec);
    const auto& state = report.metrics.final_state;
    const std::size_t n = spec.plant.modes.size();
    double momentum = spec.plant.inertia_kg_m2 * state[1];
    for (std::size_t k = 0; k < n; ++k) momentum += spec.plant.modes[k].coupling_sqrt_kg_m * state[5 + n + k];
    const auto& on = report.metrics.thruster_on_time_s;
    const double impulse = spec.actuator.torque_N_m * (on.by_sign.positive - on.by_sign.negative) +
                           spec.disturbances.constant_N_m * report.metrics.end_time_s;
    const double scale = spec.actuator.torque_N_m * on.total + 1e-3;
    EXPECT_NEAR(momentum, impulse, 1e-9 * scale) << i;
    EXPECT_NEAR(state[4], impulse, 1e-9 * scale) << i;
  }
}

// Advanced in pieces of any size, copied on the way: the same bits.
TEST(FlexibleAxis, PiecesChangeNoBit) {
  std::mt19937_64 random(7);
  for (const bool is_sampled : {true, false}) {
    const auto spec = random_flexible_slew(random, is_sampled);
    const RunReport whole = fly(spec);
    auto run = make_on_off_axis_run(spec);
    Recorder recorder;
    double until_s = 0;
    while (run->advance(until_s, 7, recorder) == RunStatus::running) {
      until_s += 0.0137;
      if (random() % 16 == 0) run = run->clone();
    }
    EXPECT_EQ(run->report().digest, whole.digest);
  }
}

TEST(FlexibleAxis, WithoutModesItIsTheRigidOne) {
  auto rigid = single_sided(1.1, 0.1, 1e-2);
  auto flexible = rigid;
  flexible.plant.modes = {{3.0, 0.01, 0.0}};
  const RunReport a = fly(rigid), b = fly(flexible);
  ASSERT_EQ(a.events.size(), b.events.size());
  EXPECT_NEAR(a.metrics.final_error_rad, b.metrics.final_error_rad, 1e-13);
  EXPECT_NEAR(a.metrics.peak_rate_rad_s, b.metrics.peak_rate_rad_s, 1e-13);
}

TEST(FlexibleAxis, MoreInertiaInTheModesThanThereIsIsAnError) {
  EXPECT_THROW(ModalBasis(SingleAxisPlant{1, {{1, 0, 0.8}, {2, 0, 0.8}}}), std::domain_error);
}

}  // namespace
