// SCOLE, 30 deg about x in 12 s (S10 to S13). Pointing after the command's arrival at 6.4415 s, 0.02 deg:
// a -0.192 s, b 2.267 s, open never; relative a 0.160, b 2.267. Torque effort in (ft lbf)^2 s: a 0.0108,
// b 10.63, rigid in between; peak pointing about x in deg: a 0.639, b 1.261, open 0.765.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/unit/structure_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr double kTorqueEffort = kFootPound_N_m * kFootPound_N_m;
constexpr double kForceEffort = kPoundForce_N * kPoundForce_N;

class Ignore final : public SampleSink {
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

RunReport fly(Run& run) {
  Ignore ignore;
  while (run.advance(std::numeric_limits<double>::infinity(), 1 << 20, ignore) == RunStatus::running) {
  }
  return run.report();
}

RunReport fly(StructureSpecification spec) {
  spec.output_times_s = {0.5, 1, 3, 5.5, 6.5, 8};
  return fly(*make_structure_run(spec));
}

void expect_peaks(const AntennaRotation& rotation, const std::array<double, 3>& peak_deg) {
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(rotation.peak_rad[i] * kDegPerRad, peak_deg[i], 0.002 * peak_deg[0]) << i;
}

using Samples = std::array<std::array<double, 3>, 6>;

void expect_samples(const RunReport& report, std::size_t first_channel, const Samples& expected_deg) {
  ASSERT_EQ(report.outputs.size(), 6u);
  for (std::size_t row = 0; row < 6; ++row)
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(report.outputs[row].state[first_channel + i] * kDegPerRad, expected_deg[row][i], 0.0005)
          << report.outputs[row].t_s << " s, axis " << i;
}

constexpr std::size_t kRelative = 10, kPointing = 13;  ///< channels

double effort(const RunReport& report, const std::string& group) {
  for (const GroupEffort& one : report.metrics.structure->efforts)
    if (one.group == group) return one.effort;
  return -1;
}

TEST(StructureRun, CaseAFollowsTheTrackingModel) {
  const RunReport report = fly(scole_slew(ScoleCase::a));
  const StructureMetrics& metrics = *report.metrics.structure;
  EXPECT_NEAR(metrics.command_arrival_s, 6.4415003, 1e-3);
  EXPECT_NEAR(metrics.pointing.settling_s.value(), -0.1915, 0.003);
  EXPECT_NEAR(metrics.relative.settling_s.value(), 0.16, 0.01);
  EXPECT_EQ(report.metrics.settling_time_s, metrics.pointing.settling_s);
  expect_peaks(metrics.relative, {0.76958, 0.045909, 0.17169});
  expect_peaks(metrics.pointing, {0.63893, 0.042981, 0.16335});
  EXPECT_NEAR(report.metrics.control_effort_N2_m2_s / kTorqueEffort, 0.010794, 0.003 * 0.010794);
  EXPECT_NEAR(report.metrics.control_effort_N2_s.value() / kForceEffort, 5.924e-05, 0.003 * 5.924e-05);
  EXPECT_NEAR(effort(report, "shuttle_torque") / kTorqueEffort, 0.0058231, 0.003 * 0.0058231);
  EXPECT_NEAR(effort(report, "tip_torque") / kTorqueEffort, 0.0049706, 0.003 * 0.0049706);
  expect_samples(report, kPointing,
                 {{{-0.44812, 0.028918, 0.11301},
                   {-0.1487, -0.0032536, 0.045939},
                   {0.00085586, -0.0054196, 0.0032484},
                   {0.25561, -0.016525, -0.064698},
                   {0.0060307, -0.015022, 0.0079531},
                   {-0.0016632, 0.010366, -0.0060904}}});
  expect_samples(report, kRelative,
                 {{{-0.54043, 0.030601, 0.11882},
                   {-0.18009, -0.0079123, 0.04817},
                   {0.00094233, -0.0078582, 0.0033625},
                   {0.3088, -0.017596, -0.068039},
                   {0.0062498, -0.021379, 0.008251},
                   {-0.0018306, 0.015146, -0.0063143}}});
}

TEST(StructureRun, CaseBDoesNotKnowTheLoads) {
  const RunReport report = fly(scole_slew(ScoleCase::b));
  const StructureMetrics& metrics = *report.metrics.structure;
  EXPECT_NEAR(metrics.pointing.settling_s.value(), 2.2675, 0.003);
  EXPECT_NEAR(metrics.relative.settling_s.value(), 2.2675, 0.003);
  expect_peaks(metrics.relative, {1.3915, 0.066485, 0.32353});
  expect_peaks(metrics.pointing, {1.261, 0.063068, 0.31519});
  EXPECT_NEAR(report.metrics.control_effort_N2_m2_s / kTorqueEffort, 10.628, 0.003 * 10.628);
  EXPECT_NEAR(report.metrics.control_effort_N2_s.value() / kForceEffort, 0.11597, 0.003 * 0.11597);
  EXPECT_NEAR(effort(report, "shuttle_torque") / kTorqueEffort, 7.2663, 0.003 * 7.2663);
  EXPECT_NEAR(effort(report, "tip_torque") / kTorqueEffort, 3.3612, 0.003 * 3.3612);
  expect_samples(report, kPointing,
                 {{{-0.96125, 0.051893, 0.21669},
                   {-0.47248, -0.0037481, 0.084553},
                   {0.031732, -0.012369, -0.0011922},
                   {0.57731, -0.035421, -0.11397},
                   {0.050985, -0.012183, -0.0044431},
                   {-0.043275, 0.011676, 0.0042767}}});
  expect_samples(report, kRelative,
                 {{{-1.0537, 0.053603, 0.22251},
                   {-0.50388, -0.0084143, 0.086787},
                   {0.0318, -0.014802, -0.0010773},
                   {0.63066, -0.03649, -0.11732},
                   {0.051199, -0.018562, -0.0041434},
                   {-0.043422, 0.016452, 0.0040517}}});
}

// The case that sees G1, Ka and Kw: nothing but the torque about x.
TEST(StructureRun, OpenLoopNeverSettles) {
  const RunReport report = fly(scole_slew(ScoleCase::open));
  const StructureMetrics& metrics = *report.metrics.structure;
  EXPECT_FALSE(metrics.pointing.settling_s);
  EXPECT_NEAR(metrics.relative.settling_s.value(), 0.121, 0.003);
  expect_peaks(metrics.relative, {0.75514, 0.039029, 0.16779});
  expect_peaks(metrics.pointing, {0.76451, 0.46188, 0.53827});
  const double residual_deg[] = {0.13274, 0.46188, 0.53491};
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(metrics.pointing.residual_rad[i] * kDegPerRad, residual_deg[i], 1e-3);
  EXPECT_EQ(report.metrics.control_effort_N2_m2_s, 0);
  expect_samples(report, kPointing,
                 {{{-0.43497, 0.023139, 0.10627},
                   {-0.12922, 0.0028437, 0.06848},
                   {0.072402, 0.070379, 0.25312},
                   {0.38689, 0.095665, 0.45406},
                   {0.14322, 0.026247, 0.53746},
                   {0.13651, -0.090446, 0.52483}}});
  expect_samples(report, kRelative,
                 {{{-0.52814, 0.021179, 0.10476},
                   {-0.17085, -0.017951, 0.031705},
                   {0.0059204, -0.012892, 0.0042362},
                   {0.30514, -0.01254, -0.049657},
                   {0.0026464, -0.019815, 0.0074138},
                   {-0.0016484, 0.014842, -0.0062551}}});
}

TEST(StructureRun, CasesAreInThePublishedOrder) {
  const RunReport a = fly(scole_slew(ScoleCase::a)), b = fly(scole_slew(ScoleCase::b)),
                  rigid = fly(scole_slew(ScoleCase::rigid));
  const auto effort_of = [](const RunReport& report) { return report.metrics.control_effort_N2_m2_s; };
  EXPECT_LT(effort_of(a), effort_of(rigid));
  EXPECT_LT(effort_of(rigid), effort_of(b));
  EXPECT_LT(effort_of(a) / kTorqueEffort, 5);
  EXPECT_LT(a.metrics.settling_time_s.value(), rigid.metrics.settling_time_s.value());
  EXPECT_LT(a.metrics.settling_time_s.value(), 0.25);
  const auto peak = [](const RunReport& report) { return report.metrics.structure->pointing.peak_rad[0]; };
  EXPECT_LT(peak(a), peak(rigid));
  EXPECT_LT(peak(rigid), peak(b));
}

TEST(StructureRun, TheOtherReadings) {
  const RunReport ideal = fly(scole_slew(ScoleCase::open_ideal));
  EXPECT_NEAR(ideal.metrics.structure->pointing.settling_s.value(), -0.207, 0.003);
  EXPECT_NEAR(ideal.metrics.structure->relative.settling_s.value(), 0.162, 0.01);
  expect_peaks(ideal.metrics.structure->pointing, {0.634, 0.042, 0.161});
  const RunReport rigid_d = fly(scole_slew(ScoleCase::rigid_d));
  EXPECT_NEAR(rigid_d.metrics.structure->pointing.settling_s.value(), 0.169, 0.003);
  EXPECT_NEAR(rigid_d.metrics.control_effort_N2_m2_s / kTorqueEffort, 4.94, 0.005);
  EXPECT_NEAR(effort(rigid_d, "shuttle_torque") / kTorqueEffort, 2.33, 0.01);
  EXPECT_NEAR(rigid_d.metrics.control_effort_N2_s.value() / kForceEffort, 0.0117, 0.0001);
}

TEST(StructureRun, ZeroReferenceOfTheHubTakesMoreEffort) {
  StructureSpecification spec = scole_slew(ScoleCase::a);
  spec.control->rigid_reference = RigidReference::zero;
  const RunReport report = fly(spec);
  EXPECT_NEAR(report.metrics.structure->pointing.settling_s.value(), -0.15, 0.003);
  EXPECT_NEAR(report.metrics.structure->relative.settling_s.value(), -0.15, 0.003);
  expect_peaks(report.metrics.structure->pointing, {0.726, 0.041, 0.17});
  EXPECT_NEAR(report.metrics.control_effort_N2_m2_s / kTorqueEffort, 8.71, 0.01);
  EXPECT_NEAR(report.metrics.control_effort_N2_s.value() / kForceEffort, 0.134, 0.001);
}

TEST(StructureRun, TheFormsOfTheLawAgreeWhereNothingIsTracked) {
  StructureSpecification spec = scole_slew(ScoleCase::rigid_d);
  const RunReport consistent = fly(spec);
  spec.control->gains.form = LawForm::as_printed;
  const RunReport printed = fly(spec);
  EXPECT_NEAR(printed.metrics.control_effort_N2_m2_s, consistent.metrics.control_effort_N2_m2_s,
              1e-8 * consistent.metrics.control_effort_N2_m2_s);
  spec = scole_slew(ScoleCase::a);
  spec.control->gains.form = LawForm::as_printed;
  EXPECT_GT(fly(spec).metrics.control_effort_N2_m2_s / kTorqueEffort, 0.02);
}

// ---- bits

TEST(StructureRun, SlicesAndCopiesChangeNoBit) {
  StructureSpecification spec = scole_slew(ScoleCase::a);
  spec.duration_s = 2;
  spec.process_noise = HeldNoise{1e-6, 0.013};
  spec.sensor_noise = HeldNoise{1e-9, 0.02};
  spec.output_times_s = {0.51, 1.234};
  spec.system = build_structure_system(spec);
  const RunReport whole = fly(*make_structure_run(spec));
  const auto run = make_structure_run(spec);
  std::unique_ptr<slew::Run> copy;
  Ignore ignore;
  for (double until = 0; run->advance(until, 2, ignore) == RunStatus::running; until += 0.0171)
    if (!copy && run->t_s() > 0.777) copy = run->clone();
  const RunReport sliced = run->report();
  for (const RunReport& other : {sliced, fly(*copy)}) {
    EXPECT_EQ(other.digest, whole.digest);
    EXPECT_EQ(other.metrics.final_state, whole.metrics.final_state);
    EXPECT_EQ(other.metrics.control_effort_N2_m2_s, whole.metrics.control_effort_N2_m2_s);
    for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(other.outputs[i].state, whole.outputs[i].state);
  }
  // Telemetry and what is derived anew change none either; the seed does.
  spec.telemetry_period_s = 0.0007;
  spec.system = build_structure_system(spec);
  EXPECT_EQ(fly(*make_structure_run(spec)).digest, whole.digest);
  spec.seed = 1;
  EXPECT_NE(fly(*make_structure_run(spec)).digest, whole.digest);
}

// Variance of the held numbers is intensity over period, so the response does not depend on the period.
TEST(StructureRun, NoiseHasTheReferencesSize) {
  StructureSpecification spec = scole_slew(ScoleCase::a);
  spec.guidance.angle_rad = 0;
  spec.control.reset();
  spec.duration_s = 160;
  spec.telemetry_period_s = 0.05;
  spec.relative_tolerance = 1e-6;
  spec.process_noise = HeldNoise{1e-3, 0.02};
  class Square final : public SampleSink {
   public:
    void sample(double t_s, std::span<const double> state, std::span<const double>) override {
      if (t_s < 20) return;
      ++count;
      for (std::size_t i = 0; i < 3; ++i) sum[i] += std::pow(state[kRelative + i] * kDegPerRad, 2);
    }
    void event(const SwitchEvent&) override {}
    double count = 0;
    std::array<double, 3> sum{};
  } square;
  const auto run = make_structure_run(spec);
  while (run->advance(160, 1 << 20, square) == RunStatus::running) {
  }
  // The reference: open loop 0.116, 0.084, 0.071 deg rms.
  const double expected_deg[] = {0.116, 0.084, 0.071};
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(std::sqrt(square.sum[i] / square.count), expected_deg[i], 0.2 * expected_deg[i]) << i;
}

// ---- spillover: designed on 12 degrees of freedom, flown on more

TEST(StructureRun, RicherPlantsAreFlownByTheSameDesign) {
  StructureSpecification spec = scole_slew(ScoleCase::a);
  const RunReport own = fly(spec);
  for (const ElasticReduction& richer : {ElasticReduction{EveryMode{}}, ElasticReduction{HubFreeModes{20}},
                                         ElasticReduction{ClampedModes{30}}}) {
    spec.plant = richer;
    const RunReport report = fly(spec);
    ASSERT_FALSE(report.failure) << report.failure->sentence;
    const StructureMetrics& metrics = *report.metrics.structure;
    EXPECT_NEAR(metrics.pointing.peak_rad[0], own.metrics.structure->pointing.peak_rad[0],
                0.03 * metrics.pointing.peak_rad[0]);
    EXPECT_GT(report.metrics.control_effort_N2_m2_s, own.metrics.control_effort_N2_m2_s);
  }
}

}  // namespace
