// Input shaping (Singer & Seering 1990): what two impulses leave of the mode that they are made for is
// nothing, and at a frequency that is off by the fraction e, |cos(pi (1 + e)/2)|; three leave its square.
#include "server/guidance/impulse_shaper.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "server/guidance/shaped_controls.hpp"
#include "tests/unit/linear_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using std::numbers::pi;

double sum_of(const std::vector<Impulse>& impulses) {
  double sum = 0;
  for (const Impulse& impulse : impulses) sum += impulse.amplitude;
  return sum;
}

TEST(ImpulseShaper, LeavesNothingOfItsMode) {
  const auto two = zero_vibration(3, 0);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[0].amplitude, 0.5);
  EXPECT_NEAR(two[1].time_s, pi / 3, 1e-15);
  for (const double zeta : {0.0, 0.005, 0.1, 0.7})
    for (const auto& impulses : {zero_vibration(3, zeta), zero_vibration_and_derivative(3, zeta)}) {
      EXPECT_NEAR(sum_of(impulses), 1, 1e-15);
      EXPECT_NEAR(residual_vibration(impulses, 3, zeta), 0, 1e-15);
    }
}

TEST(ImpulseShaper, ThreeImpulsesForgiveAWrongFrequency) {
  for (const double off : {-0.2, -0.05, 0.05, 0.2}) {
    const double left = std::abs(std::cos(pi / 2 * (1 + off)));
    EXPECT_NEAR(residual_vibration(zero_vibration(3, 0), 3 * (1 + off), 0), left, 1e-14);
    EXPECT_NEAR(residual_vibration(zero_vibration_and_derivative(3, 0), 3 * (1 + off), 0), left * left,
                1e-14);
  }
}

TEST(ImpulseShaper, OfSeveralModes) {
  const std::vector<VibratingMode> own{{2, 0.01}, {5, 0.02}, {9, 1.5}, {11, -0.1}};
  const ImpulseShaper shaper{ShaperType::zero_vibration, {1, 0}, {{7.5, 0}}};
  const auto impulses = impulses_of(shaper, own);
  EXPECT_EQ(impulses.size(), 8u);
  EXPECT_EQ(shaper.impulse_count(), 8);
  EXPECT_NEAR(sum_of(impulses), 1, 1e-15);
  EXPECT_TRUE(std::is_sorted(impulses.begin(), impulses.end(),
                             [](const Impulse& a, const Impulse& b) { return a.time_s < b.time_s; }));
  for (const VibratingMode& mode : shaped_modes(shaper, own))
    EXPECT_NEAR(residual_vibration(impulses, mode.frequency_rad_s, mode.damping_ratio), 0, 1e-14);
  EXPECT_TRUE(impulses_of({}, own).empty());
  const auto refused = [&](std::vector<std::size_t> modes) {
    EXPECT_THROW(impulses_of({ShaperType::zero_vibration, std::move(modes), {}}, own), std::invalid_argument);
  };
  refused({4});
  refused({2});
  refused({3});
  refused({0, 1, 0, 1, 0, 1, 0, 1, 0});  // 512 impulses
  EXPECT_THROW(impulses_of({ShaperType::zero_vibration, {0}, {}}, {}), std::invalid_argument);
}

TEST(HeldCommand, ShapedIsTheSumOfItsParts) {
  const std::vector<HeldCommand> command{{0, 1, 1}, {1, 2.5, -1}, {4, 5, 0.5}};
  const std::vector<Impulse> impulses{{0, 0.5}, {1, 0.3}, {3, 0.2}};
  const auto at = [](const std::vector<HeldCommand>& pieces, double t) {
    double value = 0;
    for (const HeldCommand& piece : pieces)
      if (piece.from_s <= t && t < piece.to_s) value += piece.value;
    return value;
  };
  const auto out = shaped(command, impulses);
  double area = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    area += out[i].value * (out[i].to_s - out[i].from_s);
    ASSERT_LT(out[i].from_s, out[i].to_s);
    ASSERT_NE(out[i].value, 0);
    if (i == 0) continue;
    ASSERT_GE(out[i].from_s, out[i - 1].to_s);
    ASSERT_TRUE(out[i].from_s > out[i - 1].to_s || out[i].value != out[i - 1].value);
  }
  EXPECT_NEAR(area, 1 - 1.5 + 0.5, 1e-15);
  for (double t = 0.013; t < 9; t += 0.1) {
    double sum = 0;
    for (const Impulse& impulse : impulses) sum += impulse.amplitude * at(command, t - impulse.time_s);
    EXPECT_NEAR(at(out, t), sum, 1e-15) << t;
  }
  EXPECT_TRUE(shaped({}, impulses).empty());
}

// 0.1 + 0.2 and 0.3 are one edge.
TEST(HeldCommand, EdgesThatOnlyRoundingKeepsApartAreOne) {
  const auto out = shaped(std::vector<HeldCommand>{{0, 0.1, 1}, {0.3, 0.4, 1}},
                          std::vector<Impulse>{{0, 0.5}, {0.2, 0.5}});
  ASSERT_EQ(out.size(), 3u);
  EXPECT_EQ(out[1].value, 0.5);
  EXPECT_EQ(out[1].from_s, 0.2);
  EXPECT_EQ(out[1].to_s, 0.4);
}

TEST(ShapedControls, AreOffWhereNothingIsLeft) {
  ControlHistory history;
  history.time_s = history.on_off.end_s = 2;
  history.on_off.controls = {{1, -1}, {0}, {0, 1}};
  history.on_off.switch_times_s = {{1}, {}, {1.5}};
  const ControlHistory out = shaped_controls(history, zero_vibration(pi, 0));  // a second apart
  EXPECT_EQ(out.time_s, 3);
  EXPECT_EQ(out.on_off.controls, (std::vector<std::vector<double>>{{0.5, 0, -0.5}, {0}, {0, 0.5, 0, 0.5}}));
  EXPECT_EQ(out.on_off.switch_times_s, (std::vector<std::vector<double>>{{1, 2}, {}, {1.5, 2, 2.5}}));
  for (std::size_t i = 0; i < 3; ++i)
    for (double t = 0.01; t < 3.2; t += 0.07)
      EXPECT_NEAR(control_of(out, i, -1, 1, t),
                  0.5 * control_of(history, i, -1, 1, t) + 0.5 * control_of(history, i, -1, 1, t - 1), 1e-15);
}

// ---- flown

/// Start and stop of the flexible spacecraft in open loop.
OnOffAxisSpecification pulses(const SingleAxisPlant& plant) {
  OnOffAxisSpecification spec;
  spec.plant = plant;
  spec.evaluation = Evaluation::program;
  spec.law.gamma_bar = 0;
  spec.actuator.torque_N_m = 0.3;
  spec.program = {{0, 6, 1}, {6.5, 12.5, -1}};
  spec.duration_s = 40;
  spec.telemetry_period_s = 1;
  return spec;
}

SingleAxisPlant undamped(SingleAxisPlant plant) {
  for (ElasticMode& mode : plant.modes) mode.damping = 0;
  return plant;
}

template <typename Specification>
Specification shaped_for(Specification spec, const ImpulseShaper& shaper) {
  spec.shaper = shaper;
  spec.impulses = impulses_of(shaper, vibrating_modes(spec));
  return spec;
}

TEST(ShapedTorque, LeavesNothingOfAnUndampedMode) {
  const auto unshaped = pulses(undamped(table_1_plant()));
  const auto before = fly(unshaped).metrics.vibration;
  ASSERT_EQ(before.size(), 6u);
  EXPECT_GT(before[0].residual_rad, 1e-3);
  for (const ShaperType type : {ShaperType::zero_vibration, ShaperType::zero_vibration_and_derivative}) {
    const auto spec = shaped_for(unshaped, {type, {0, 1}, {}});
    const RunReport report = fly(spec);
    const Metrics& m = report.metrics;
    EXPECT_LT(m.vibration[0].residual_rad, 1e-14);
    EXPECT_LT(m.vibration[1].residual_rad, 1e-14);
    // It turns as far as unshaped ones turn a rigid axis, and the other modes hardly matter.
    EXPECT_NEAR(m.final_error_rad, 0.3 / 13 * 6 * 6.5, 1e-4);
    // The torque is less, and there is less of its square.
    EXPECT_NEAR(m.angular_impulse_N_m_s, 0.3 * m.thruster_on_time_s.total, 1e-12);
    EXPECT_LT(m.control_effort_N2_m2_s, 0.3 * m.angular_impulse_N_m_s);
    const RunReport other = fly(*make_on_off_axis_verification(spec));
    const Verification verification = compare(report, other);
    EXPECT_TRUE(verification.same_event_sequence);
    EXPECT_EQ(verification.event_time_max_s, 0);
    for (const double difference : verification.final_state_difference) EXPECT_NEAR(difference, 0, 1e-9);
  }
}

TEST(ShapedTorque, WithAWrongFrequencyThreeImpulsesLeaveLess) {
  const auto unshaped = pulses(undamped(table_1_plant()));
  const VibratingMode mode = vibrating_modes(unshaped)[0];
  const double before = fly(unshaped).metrics.vibration[0].residual_rad;
  for (const double off : {-0.1, 0.1}) {
    const double left = std::abs(std::cos(pi / 2 / (1 + off)));
    const VibratingMode believed{mode.frequency_rad_s * (1 + off), 0};
    const auto fly_with = [&](ShaperType type) {
      return fly(shaped_for(unshaped, {type, {}, {believed}})).metrics.vibration[0].residual_rad;
    };
    EXPECT_NEAR(fly_with(ShaperType::zero_vibration), left * before, 1e-9 * before);
    EXPECT_NEAR(fly_with(ShaperType::zero_vibration_and_derivative), left * left * before, 1e-9 * before);
  }
}

// A linear plant answers to the parts of a command by the parts of its answer: states at the end of shaped
// flights are sums of states of unshaped ones.
TEST(ShapedTorque, AnswersBySuperposition) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 30; ++i) {
    auto spec = pulses(random_plant(random));
    const auto whole = shaped_for(spec, {ShaperType::zero_vibration_and_derivative, {0}, {{2.5, 0.1}}});
    spec.duration_s = 20;
    spec.output_times_s.clear();
    for (const Impulse& impulse : whole.impulses)
      if (impulse.time_s < 20) spec.output_times_s.push_back(20 - impulse.time_s);
    std::reverse(spec.output_times_s.begin(), spec.output_times_s.end());
    auto shaped_spec = whole;
    shaped_spec.duration_s = 20;
    shaped_spec.output_times_s = {20};
    const RunReport parts = fly(spec), sum = fly(shaped_spec);
    for (std::size_t k = 0; k < parts.outputs.front().state.size(); ++k) {
      if (k == 2 || k == 3) continue;  // error and s have offsets
      double expected = 0;
      for (std::size_t j = 0; j < parts.outputs.size(); ++j)
        expected += whole.impulses[j].amplitude * parts.outputs[parts.outputs.size() - 1 - j].state[k];
      EXPECT_NEAR(sum.outputs[0].state[k], expected, 1e-10) << i << ' ' << k;
    }
  }
}

TEST(ShapedTorque, UnderFrictionAndSinusoidsAsWell) {
  auto spec = pulses(table_1_plant());
  spec.disturbances.friction_N_m = 0.06;
  spec.disturbances.sinusoids = {{0.02, 0.9, 0.3}};
  spec.disturbances.steps = {{7, 0.01}};
  spec = shaped_for(spec, {ShaperType::zero_vibration, {0, 1}, {}});
  const Verification verification = compare(fly(spec), fly(*make_on_off_axis_verification(spec)));
  EXPECT_TRUE(verification.same_event_sequence);
  EXPECT_LT(*verification.event_time_max_s, 1e-6);
  for (const double difference : verification.final_state_difference) EXPECT_NEAR(difference, 0, 1e-7);
}

TEST(ShapedTorque, ImpulsesAreEventsAndPiecesChangeNoBit) {
  std::mt19937_64 random(3);
  const auto spec = shaped_for(pulses(table_1_plant()), {ShaperType::zero_vibration_and_derivative, {0}, {}});
  const RunReport whole = fly(spec);
  const auto torque = commanded_torque(spec);
  for (const Impulse& impulse : spec.impulses)
    EXPECT_TRUE(std::any_of(whole.events.begin(), whole.events.end(), [&](const SwitchEvent& event) {
      return event.t_s == impulse.time_s;
    })) << impulse.time_s;
  EXPECT_EQ(whole.events_total, torque.size() + 1);
  auto run = make_on_off_axis_run(spec);
  Recorder recorder;
  double until_s = 0;
  while (run->advance(until_s, 3, recorder) == RunStatus::running) {
    until_s += 0.137;
    if (random() % 16 == 0) run = run->clone();
  }
  EXPECT_EQ(run->report().digest, whole.digest);
}

// The undamped loop I theta'' = -K (theta - r): a step makes it swing to twice the angle, two halves bring it
// there.
TEST(ShapedAngle, BringsAnUndampedLoopToRest) {
  auto spec = attitude_rate();
  spec.feedback.law = AttitudeRateFeedback{4, 0};
  const double step_rad = std::abs(spec.maneuver.initial_angle_rad);
  const Metrics before = fly(spec).metrics;
  ASSERT_EQ(before.vibration.size(), 1u);
  EXPECT_NEAR(before.vibration[0].residual_rad, step_rad, 1e-12);
  EXPECT_NEAR(before.vibration[0].frequency_rad_s, 2, 1e-14);
  spec = shaped_for(spec, {ShaperType::zero_vibration, {0}, {}});
  spec.output_times_s = {0, 0.5, pi / 2, 3};
  const RunReport report = fly(spec);
  EXPECT_NEAR(report.metrics.vibration[0].residual_rad, 0, 1e-14);
  EXPECT_NEAR(*report.metrics.overshoot_rad, 0, 1e-14);
  ASSERT_EQ(report.events.size(), 2u);
  EXPECT_EQ(report.events[1].t_s, spec.impulses[1].time_s);
  // From 30 deg by halves: half way it commands 15 deg and swings about it.
  EXPECT_NEAR(report.outputs[1].state.back(), step_rad / 2, 1e-15);
  EXPECT_NEAR(report.outputs[1].state[0], step_rad * (0.5 + 0.5 * std::cos(1)), 1e-14);
  EXPECT_NEAR(report.outputs[3].state[0], 0, 1e-14);
  EXPECT_EQ(report.outputs[3].state.back(), 0);
}

TEST(ShapedAngle, AnswersBySuperpositionWithEveryCompensator) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 40; ++i) {
    auto spec = random_loop(random, i % 2 == 0);
    spec.disturbances = {};
    spec.maneuver.initial_rate_rad_s = 0;
    spec.maneuver.initial_angle_rad = 0;
    spec.estimate = {};
    spec.stop = StopCondition::duration;
    spec.duration_s = 20;
    const ImpulseShaper shaper{ShaperType::zero_vibration, {}, {{0.8, 0.1}, {0.45, 0}}};
    auto shaped_spec = shaped_for(spec, shaper);
    shaped_spec.output_times_s = {20};
    for (auto impulse = shaped_spec.impulses.rbegin(); impulse != shaped_spec.impulses.rend(); ++impulse)
      spec.output_times_s.push_back(20 - impulse->time_s);
    const RunReport parts = fly(spec), sum = fly(shaped_spec);
    const double scale = std::max(1.0, std::abs(spec.maneuver.final_angle_rad));
    for (const std::size_t k : {0u, 1u}) {
      double expected = 0;
      for (std::size_t j = 0; j < parts.outputs.size(); ++j)
        expected += shaped_spec.impulses[j].amplitude * parts.outputs[parts.outputs.size() - 1 - j].state[k];
      EXPECT_NEAR(sum.outputs[0].state[k], expected, 1e-10 * scale) << i << ' ' << k;
    }
  }
}

TEST(ShapedAngle, BySecondOpinion) {
  std::mt19937_64 random(6);
  for (int i = 0; i < 20; ++i) {
    const ImpulseShaper shaper{ShaperType::zero_vibration_and_derivative, {}, {{1.1, 0.05}}};
    const auto spec = shaped_for(random_loop(random, i % 2 == 0), shaper);
    const Verification verification = compare(fly(spec), fly(*make_linear_axis_verification(spec)));
    EXPECT_TRUE(verification.same_event_sequence) << i;
    for (const double difference : verification.final_state_difference) EXPECT_NEAR(difference, 0, 1e-7) << i;
  }
}

TEST(ShapedAngle, PiecesChangeNoBit) {
  std::mt19937_64 random(8);
  const auto spec = shaped_for(problem_3_2_4(), {ShaperType::zero_vibration, {}, {{1.3, 0.2}, {4, 0}}});
  auto run = make_linear_axis_run(spec);
  Recorder recorder;
  double until_s = 0;
  while (run->advance(until_s, 3, recorder) == RunStatus::running) {
    until_s += 0.0371;
    if (random() % 16 == 0) run = run->clone();
  }
  EXPECT_EQ(run->report().digest, fly(spec).digest);
}

}  // namespace
