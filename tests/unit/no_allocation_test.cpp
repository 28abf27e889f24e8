// A step allocates nothing: counted by replacing the global operator new.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>
#include <vector>

#include "server/actuator/thruster_allocation.hpp"
#include "server/sensor/attitude_sensor.hpp"
#include "tests/unit/attitude_cases.hpp"
#include "tests/unit/linear_cases.hpp"
#include "tests/unit/structure_cases.hpp"

namespace {
std::atomic<bool> counting{false};
std::atomic<long> allocations{0};
}  // namespace

// Not inlined, or the compiler pairs one half with a library's other half and warns.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (counting) ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace {

using namespace slew;

class Discard final : public SampleSink {
 public:
  void sample(double, std::span<const double>, std::span<const double>) override { ++samples; }
  void event(const SwitchEvent&) override {}
  long samples = 0;
};

long allocations_of(Run& run) {
  Discard discard;
  run.advance(0.1, 1 << 30, discard);
  allocations = 0;
  counting = true;
  run.advance(1.9, 1 << 30, discard);
  counting = false;
  EXPECT_GT(discard.samples, 100);
  return allocations;
}

long allocations_of(const OnOffAxisSpecification& spec) {
  return allocations_of(*make_on_off_axis_run(spec));
}

TEST(NoAllocation, InAStepOfTheSampledLaw) {
  EXPECT_EQ(allocations_of(test::single_sided(1.1, 0.1, 1e-3)), 0);
}

TEST(NoAllocation, InAStepOfTheContinuousLaw) {
  auto spec = test::continuous(test::single_sided(1.1, 0.1, 0), 1e-3);
  spec.law.end_box = EndBox{0.001, 0.001};
  EXPECT_EQ(allocations_of(spec), 0);
}

TEST(NoAllocation, InAStepOfAFlexibleAxis) {
  auto spec = test::flexible_slew(1.0, 1e-3);
  spec.telemetry_period_s = 0.01;
  EXPECT_EQ(allocations_of(spec), 0);
  auto events = test::continuous(spec, 0.01);
  events.law.deadband = Deadband::single_sided;
  events.law.deadband_rad = 0.02;
  EXPECT_EQ(allocations_of(events), 0);
}

TEST(NoAllocation, InAStepOfAnIdealLaw) {
  for (const bool is_flexible : {false, true}) {
    auto spec = is_flexible ? test::flexible_slew(1.4, 1) : test::unit_slew(1.1, 1);
    spec.evaluation = Evaluation::ideal;
    spec.law.end_box.reset();
    spec.stop = StopCondition::duration;
    spec.maneuver.initial_angle_rad = spec.maneuver.final_angle_rad - 0.01;
    spec.disturbances.sinusoids = {{0.01, 30, 0}};
    spec.duration_s = 3;
    spec.telemetry_period_s = 0.01;
    EXPECT_EQ(allocations_of(spec), 0) << is_flexible;
  }
}

TEST(NoAllocation, InAStepUnderFrictionDelayAndHysteresis) {
  auto spec = test::flexible_slew(1.0, 1);
  spec.evaluation = Evaluation::continuous;
  spec.law.hysteresis_rad = 0.01;
  spec.actuator.switching_delay_s = 0.02;
  spec.disturbances.friction_N_m = 0.05;
  spec.maneuver.initial_angle_rad = spec.maneuver.final_angle_rad - 0.01;
  spec.duration_s = 3;
  spec.telemetry_period_s = 0.01;
  EXPECT_EQ(allocations_of(spec), 0);
}

TEST(NoAllocation, InAStepOfALinearLoop) {
  auto spec = test::problem_3_2_2();
  spec.plant = test::table_1_plant();
  spec.estimator = SecondOrderAngleEstimator{2, 2, 13};
  spec.disturbances.sinusoids = {{0.1, 3, 0}};
  spec.disturbances.steps = {{1.5, 0.2}};
  spec.stop = StopCondition::first_rest;
  spec.telemetry_period_s = 0.01;
  EXPECT_EQ(allocations_of(*make_linear_axis_run(spec)), 0);
  spec.impulses = zero_vibration_and_derivative(2, 0.1);
  EXPECT_EQ(allocations_of(*make_linear_axis_run(spec)), 0);
}

TEST(NoAllocation, InAStepOfAShapedProgram) {
  auto spec = test::flexible_slew(1, 1);
  spec.evaluation = Evaluation::program;
  spec.law.end_box.reset();
  spec.program = {{0, 1, 1}, {1, 2, -1}};
  spec.impulses = zero_vibration_and_derivative(2, 0.1);
  spec.duration_s = 10;
  spec.telemetry_period_s = 0.01;
  EXPECT_EQ(allocations_of(spec), 0);
}

TEST(NoAllocation, InTheAllocationOfTorque) {
  std::vector<Thruster> thrusters;
  for (int i = 0; i < 16; ++i) {
    const double along = 0.4 * i;
    Thruster thruster;
    thruster.position_m = {std::cos(along), std::sin(along), 0.3 * (i % 3 - 1)};
    thruster.direction =
        Eigen::Vector3d(std::sin(3 * along), std::cos(2 * along), std::cos(5 * along)).normalized();
    thrusters.push_back(thruster);
    thruster.direction = -thruster.direction;
    thrusters.push_back(thruster);
  }
  for (const auto method :
       {AllocationMethod::non_negative_least_squares, AllocationMethod::linear_programme}) {
    const ThrusterAllocation allocation(thrusters, method);
    std::array<double, kMaxThrusters> thrust{};
    allocations = 0;
    counting = true;
    for (int i = 0; i < 200; ++i) allocation.allocate({std::cos(i), std::sin(i), std::cos(3 * i)}, thrust);
    counting = false;
    EXPECT_EQ(allocations, 0);
    EXPECT_GT(*std::max_element(thrust.begin(), thrust.end()), 0);
  }
}

TEST(NoAllocation, InAReadingOfTheAttitude) {
  AttitudeSensorParameters parameters;
  parameters.angle_noise_rad = parameters.rate_noise_rad_s = 1e-3;
  parameters.angle_quantum_rad = parameters.rate_quantum_rad_s = 1e-4;
  parameters.laws_samples_per_reading = 2;
  parameters.delay_samples = 5;
  AttitudeSensor sensor(parameters, 1);
  allocations = 0;
  counting = true;
  for (int i = 0; i < 100; ++i) sensor.read({0, 0, 0.01 * i}, {0, 0, 0.1});
  counting = false;
  EXPECT_EQ(allocations, 0);
}

AttitudeSpecification slew_about_all_axes() {
  AttitudeSpecification spec = test::yaw_half_turn(true, true);
  spec.maneuver.initial_mrp = {0.3, -0.2, 0.4};
  spec.duration_s = 3;
  spec.telemetry_period_s = 0.01;
  return spec;
}

TEST(NoAllocation, InAStepOfThreeAxesAtEveryInstant) {
  AttitudeSpecification spec = slew_about_all_axes();
  EXPECT_EQ(allocations_of(*make_attitude_run(spec)), 0);
  EXPECT_EQ(allocations_of(*make_attitude_run(test::observed(spec, ObserverFeeding::applied_total))), 0);
  std::get<AxisThrusters>(spec.actuator).modulator = SchmittModulator{};
  std::get<AxisThrusters>(spec.actuator).valve.on_delay_s = 0.01;
  EXPECT_EQ(allocations_of(*make_attitude_run(spec)), 0);
  spec.actuator = IdealTorque{};
  EXPECT_EQ(allocations_of(*make_attitude_run(spec)), 0);
}

TEST(NoAllocation, InAStepOfThreeAxesThatAreSampled) {
  AttitudeSpecification spec = slew_about_all_axes();
  spec.sample_period_s = 0.02;
  spec.sensor.angle_noise_rad = 1e-4;
  spec.sensor.delay_samples = 2;
  std::get<AxisThrusters>(spec.actuator).valve.rise_s = 0.01;
  std::get<AxisThrusters>(spec.actuator).valve.noise = 0.01;
  for (const Modulator& modulator :
       {Modulator{PwpfModulator{}}, Modulator{SchmittModulator{}}, Modulator{PulseWidthModulator{}}}) {
    std::get<AxisThrusters>(spec.actuator).modulator = modulator;
    EXPECT_EQ(allocations_of(*make_attitude_run(spec)), 0) << modulator.index();
  }
  EXPECT_EQ(allocations_of(*make_attitude_run(test::observed(spec, ObserverFeeding::commanded))), 0);
}

TEST(NoAllocation, InAStepOfThreeAxesWithMountedThrusters) {
  AttitudeSpecification spec = slew_about_all_axes();
  MountedThrusters mounted;
  for (const double side : {-1, 1})
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {-1, 1}) {
        Thruster thruster;
        thruster.position_m = side * Eigen::Vector3d::Unit(axis);
        thruster.direction = sign * Eigen::Vector3d::Unit((axis + 1) % 3);
        mounted.thrusters.push_back(thruster);
      }
  for (const std::optional<double> period_s : {std::optional<double>{}, std::optional<double>{0.02}})
    for (const AllocationMethod method :
         {AllocationMethod::non_negative_least_squares, AllocationMethod::linear_programme}) {
      mounted.allocation = method;
      spec.actuator = mounted;
      spec.sample_period_s = period_s;
      EXPECT_EQ(allocations_of(*make_attitude_run(spec)), 0);
    }
}

TEST(NoAllocation, InAStepOfAStructure) {
  StructureSpecification spec = test::scole_slew(test::ScoleCase::a);
  EXPECT_EQ(allocations_of(*make_structure_run(spec)), 0);
  spec.control.reset();
  spec.process_noise = HeldNoise{1e-3, 0.05};
  EXPECT_EQ(allocations_of(*make_structure_run(spec)), 0);
}

}  // namespace
