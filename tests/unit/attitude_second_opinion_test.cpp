// The same request by this program's own propagators and by SUNDIALS: same events, same end.
#include <gtest/gtest.h>

#include "tests/unit/attitude_cases.hpp"
#include "tests/unit/random_attitude.hpp"

namespace slew {
namespace {

using test::fly;

// Of the second opinion. An integrator's own tolerance does not tell how well it meets a guard: SUNDIALS
// finds a root on an interpolant of order 4, to about 1e-11 s, and a modulator that is met at a grazing
// angle, or two minutes of switchings that each begin where the last one ended, make 1e-8 of that; at 1e-12,
// once, 2e-6.
constexpr double kRelative = 1e-12, kTight = 1e-13;

/// States are compared to the tolerance times 1 + |x|: an observer's are large.
void expect_agreement(AttitudeSpecification spec, double state_tolerance, double time_tolerance_s,
                      double relative_tolerance = kRelative) {
  spec.verification_tolerance = relative_tolerance;
  const RunReport mine = fly(spec), other = fly(*make_attitude_verification(spec));
  ASSERT_FALSE(mine.failure || other.failure);
  const Verification opinion = compare(mine, other);
  EXPECT_TRUE(opinion.same_event_sequence) << mine.events_total << " and " << other.events_total;
  EXPECT_LE(opinion.event_time_max_s.value_or(0), time_tolerance_s);
  EXPECT_EQ(opinion.final_time_difference_s, 0);
  const Metrics &a = mine.metrics, &b = other.metrics;
  ASSERT_EQ(a.final_state.size(), b.final_state.size());
  for (std::size_t i = 0; i < a.final_state.size(); ++i)
    EXPECT_NEAR(a.final_state[i], b.final_state[i], state_tolerance * (1 + std::abs(a.final_state[i]))) << i;
  ASSERT_EQ(a.settling_time_s.has_value(), b.settling_time_s.has_value());
  EXPECT_NEAR(a.settling_time_s.value_or(0), b.settling_time_s.value_or(0), 1e-6);
  EXPECT_NEAR(a.final_error_rad, b.final_error_rad, 4 * state_tolerance);
  EXPECT_NEAR(a.residual_rate_rad_s, b.residual_rate_rad_s, 2 * state_tolerance);
  EXPECT_EQ(a.firings.per_thruster, b.firings.per_thruster);
  for (std::size_t j = 0; j < a.firings.per_thruster.size(); ++j)
    EXPECT_NEAR(a.thruster_on_time_s.per_thruster[j], b.thruster_on_time_s.per_thruster[j],
                10 * time_tolerance_s);
  EXPECT_NEAR(a.propellant_kg.value_or(0), b.propellant_kg.value_or(0), 1e-8);
  // Each takes what is between its points as it can: the largest rate, and |T| where it passes zero.
  EXPECT_NEAR(a.peak_rate_rad_s, b.peak_rate_rad_s, 1e-5 * b.peak_rate_rad_s);
  EXPECT_NEAR(a.angular_impulse_N_m_s, b.angular_impulse_N_m_s, 1e-4 * (1 + b.angular_impulse_N_m_s));
  EXPECT_NEAR(a.control_effort_N2_m2_s, b.control_effort_N2_m2_s, 1e-6 * (1 + b.control_effort_N2_m2_s));
}

TEST(AttitudeSecondOpinion, agrees_on_table_1) {
  for (const auto& [deg, lambda, gain] :
       {std::array{180.0, -2.2437, 1.3960}, std::array{90.0, -2.1917, 1.4262},
        std::array{72.0, -2.2396, 1.4166}, std::array{45.0, -2.2812, 1.4194}})
    expect_agreement(test::table_1(deg, lambda, gain), 2e-7, 5e-8);
}

TEST(AttitudeSecondOpinion, agrees_on_half_turns_by_thrusters) {
  const auto expect_close_agreement = [](AttitudeSpecification spec) {
    spec.relative_tolerance = kTight;
    expect_agreement(spec, 1e-7, 1e-7, kTight);
  };
  for (const bool inertia_is_uncertain : {false, true})
    for (const bool is_disturbed : {false, true}) {
      SCOPED_TRACE(::testing::Message() << inertia_is_uncertain << is_disturbed);
      expect_close_agreement(test::yaw_half_turn(inertia_is_uncertain, is_disturbed));
    }
  const AttitudeSpecification spec = test::yaw_half_turn(true, true);
  for (const ObserverFeeding feeding :
       {ObserverFeeding::applied_total, ObserverFeeding::applied_minus_equivalent})
    expect_close_agreement(test::observed(spec, feeding));
}

TEST(AttitudeSecondOpinion, agrees_where_equation_35_winds_up) {
  AttitudeSpecification spec = test::observed(test::yaw_half_turn(true, false), ObserverFeeding::commanded);
  spec.duration_s = 2;
  expect_agreement(spec, 1e-8, 1e-8);
}

TEST(AttitudeSecondOpinion, agrees_on_half_turns_by_wheels) {
  for (const AttitudeParameters parameters :
       {AttitudeParameters::mrp, AttitudeParameters::euler_parameters}) {
    AttitudeSpecification spec = test::yaw_half_turn(true, true);
    spec.plant.attitude = parameters;
    // From exactly half a turn Euler parameters lead the shorter way: by rounding, either.
    spec.maneuver.initial_mrp = {0.01, 0, 0.99};
    spec.actuator = IdealTorque{};
    expect_agreement(spec, 1e-11, 0);
    expect_agreement(test::observed(spec, ObserverFeeding::commanded), 1e-11, 0);
  }
}

TEST(AttitudeSecondOpinion, agrees_on_the_common_slew) {
  AttitudeSpecification spec = test::common_slew();
  expect_agreement(spec, 1e-13, 0);
  spec.sample_period_s.reset();
  expect_agreement(spec, 1e-11, 0);
}

AttitudeLaw random_law(RandomAttitude& random, int i, const Eigen::Matrix3d& inertia) {
  const Eigen::Matrix3d belief = inertia * random.between(0.8, 1.2);
  switch (i % 5) {
    case 0: {
      LinearSurface law;
      law.slope_1_s = Eigen::Vector3d::Constant(0.4) + random.vector(0.2);
      law.gain_N_m = Eigen::Vector3d::Constant(4) + random.vector(2);
      law.inertia_kg_m2 = belief;
      return law;
    }
    case 1: {
      QuaternionFeedback law;
      law.gyroscopic_compensation = random.between(0, 1);
      law.inertia_kg_m2 = belief;
      return law;
    }
    case 2: {
      RateDamping law;
      law.damping_N_m_s = Eigen::Vector3d::Constant(50) + random.vector(20);
      return law;
    }
    case 3: {
      TorqueProgram law;
      law.initial_torque_N_m = random.vector(4);
      for (auto& times : law.switch_times_s) times = {random.between(0.5, 1), random.between(1, 2)};
      law.end_s = random.between(2, 3);
      return law;
    }
    default: {
      SlidingMode law = test::sliding_mode(0, 0, belief);
      law.lambda_1_s = Eigen::Vector3d::Constant(-0.4) + random.vector(0.2);
      law.gain_rad_s2 = Eigen::Vector3d::Constant(0.05) + random.vector(0.02);
      return law;
    }
  }
}

Modulator random_modulator(RandomAttitude& random, bool is_sampled) {
  const double kind = random.between(0, is_sampled ? 3 : 2);
  if (kind > 2) return PulseWidthModulator{random.between(0, 0.02)};
  if (kind > 1) return SchmittModulator{random.between(0.4, 0.8), random.between(0.1, 0.3)};
  PwpfModulator pwpf;
  pwpf.gain = random.between(3, 8);
  pwpf.time_constant_s = random.between(0.3, 1.5);
  pwpf.input = static_cast<ModulatorInput>(static_cast<int>(random.between(0, 3)));
  return pwpf;
}

Thruster random_valve(RandomAttitude& random) {
  Thruster valve;
  const auto sometimes = [&](double most) {
    return random.between(0, 1) < 0.4 ? random.between(0, most) : 0.0;
  };
  valve.minimum_on_time_s = sometimes(0.1);
  valve.minimum_off_time_s = sometimes(0.1);
  if (random.between(0, 1) < 0.5) valve.minimum_on_time_of = MinimumOnTimeOf::effective_thrust;
  valve.on_delay_s = sometimes(0.05);
  valve.off_delay_s = sometimes(0.05);
  valve.rise_s = sometimes(0.08);
  valve.fall_s = sometimes(0.08);
  valve.noise = sometimes(0.1);
  valve.misalignment_rad = sometimes(0.05);
  if (random.between(0, 1) < 0.1) valve.stuck_open_from_s = random.between(0, 4);
  if (random.between(0, 1) < 0.1) valve.stuck_closed_from_s = random.between(0, 4);
  return valve;
}

Propellant random_propellant(RandomAttitude& random) {
  Propellant propellant;
  if (random.between(0, 1) < 0.5) return propellant;
  propellant.specific_impulse_s = random.between(60, 200);
  propellant.gas_density_kg_m3 = 1.2;
  if (random.between(0, 1) < 0.5) propellant.tank_kg = random.between(0.001, 0.01);
  return propellant;
}

AttitudeSensorParameters random_sensor(RandomAttitude& random) {
  AttitudeSensorParameters sensor;
  if (random.between(0, 1) < 0.5) return sensor;
  sensor.angle_bias_rad = random.vector(0.01);
  sensor.rate_noise_rad_s = random.between(0, 1e-3);
  sensor.angle_noise_rad = random.between(0, 1e-3);
  sensor.laws_samples_per_reading = 2;
  sensor.delay_samples = 3;
  return sensor;
}

AttitudeSpecification random_system(RandomAttitude& random, int i) {
  AttitudeSpecification spec;
  spec.plant.inertia_kg_m2 = random.inertia_kg_m2();
  if (random.between(0, 1) < 0.5) spec.plant.attitude = AttitudeParameters::euler_parameters;
  spec.maneuver.initial_mrp = random.vector(0.5);
  spec.maneuver.initial_rate_rad_s = random.vector(0.1);
  if (random.between(0, 1) < 0.2) {
    // Through the attitude where the parameters change to their shadow.
    spec.plant.shadow_switch_norm = 1.05;
    spec.maneuver.initial_mrp = random.vector(1).normalized();
    spec.maneuver.initial_rate_rad_s = 0.3 * spec.maneuver.initial_mrp + random.vector(0.05);
  }
  spec.law = random_law(random, i, spec.plant.inertia_kg_m2);
  if (tracks(spec.law) && random.between(0, 1) < 0.5)
    spec.maneuver.reference.shape =
        random.between(0, 1) < 0.5
            ? MrpTrajectory{MrpSinusoids{random.vector(0.1), random.vector(1), random.vector(3)}}.shape
            : MrpTrajectory{EigenaxisRotation{random.vector(1).normalized(), 0, 1, 0.5, 2}}.shape;
  if (random.between(0, 1) < 0.5) spec.sample_period_s = random.between(0.02, 0.1);
  if (has_surface(spec.law) && random.between(0, 1) < 0.5) {
    // A sampled one has to be slow beside its samples.
    const double fastest = spec.sample_period_s ? 0.3 / *spec.sample_period_s : 5;
    spec.observer = DisturbanceObserver{random.between(0.2, std::min(3.0, fastest)), spec.plant.inertia_kg_m2,
                                        random.between(0, 1) < 0.5 ? ObserverFeeding::applied_minus_equivalent
                                                                   : ObserverFeeding::applied_total};
  }
  if (spec.sample_period_s) spec.sensor = random_sensor(random);
  spec.disturbances.constant_N_m = random.vector(0.1);
  if (random.between(0, 1) < 0.5)
    spec.disturbances.steps = {{random.between(0, 2), random.vector(0.2)},
                               {random.between(2, 5), random.vector(0.2)}};
  if (random.between(0, 1) < 0.5)
    spec.disturbances.sinusoids = {{random.vector(0.2), random.between(0.5, 5), 1}};
  if (random.between(0, 1) < 0.3) {
    IdealTorque any;
    if (random.between(0, 1) < 0.6)
      any.maximum_N_m = Eigen::Vector3d::Constant(4) + random.vector(2);
    else if (spec.observer && random.between(0, 1) < 0.5)
      spec.observer->feeding = ObserverFeeding::commanded;
    spec.actuator = any;
  } else if (random.between(0, 1) < 0.4) {
    MountedThrusters mounted;
    // At the corners of a cube, two at each, around its edges.
    for (const double x : {-1, 1})
      for (const double y : {-1, 1})
        for (const double z : {-1, 1}) {
          Thruster thruster = random_valve(random);
          thruster.position_m = Eigen::Vector3d(x, y, z) + random.vector(0.1);
          for (const Eigen::Vector3d& direction :
               {Eigen::Vector3d(0, -x * y, 0), Eigen::Vector3d(0, 0, -z * y),
                Eigen::Vector3d(-x * z, 0, 0)}) {
            thruster.thrust_N = random.between(2, 5);
            thruster.direction = (direction + random.vector(0.1)).normalized();
            mounted.thrusters.push_back(thruster);
          }
        }
    if (random.between(0, 1) < 0.5) mounted.allocation = AllocationMethod::linear_programme;
    mounted.modulator = random_modulator(random, spec.sample_period_s.has_value());
    mounted.propellant = random_propellant(random);
    spec.actuator = mounted;
  } else {
    AxisThrusters pairs;
    pairs.torque_N_m = Eigen::Vector3d::Constant(5) + random.vector(2);
    pairs.valve = random_valve(random);
    pairs.modulator = random_modulator(random, spec.sample_period_s.has_value());
    pairs.propellant = random_propellant(random);
    spec.actuator = pairs;
  }
  spec.settling.quantity = static_cast<AttitudeQuantity>(static_cast<int>(random.between(0, 5)));
  spec.settling.tolerance = random.between(0.2, 0.9);
  spec.duration_s = spec.actuator.index() == 2 ? 0.8 : 6;  // to allocate at every instant takes its time
  spec.telemetry_period_s = 0.1;
  spec.seed = static_cast<std::uint64_t>(i);
  return spec;
}

TEST(AttitudeSecondOpinion, agrees_on_random_systems) {
  RandomAttitude random;
  for (int i = 0; i < 100; ++i) {
    const AttitudeSpecification spec = random_system(random, i);
    SCOPED_TRACE(::testing::Message()
                 << i << " " << type_name(spec.law) << (spec.sample_period_s ? " sampled" : "")
                 << (spec.observer ? " observed" : "") << " actuator " << spec.actuator.index());
    expect_agreement(spec, 5e-8, 5e-8);
  }
}

TEST(AttitudeSecondOpinion, sees_another_sequence_when_there_is_one) {
  AttitudeSpecification spec = test::table_1(90, -2.1917, 1.4262);
  const RunReport mine = fly(spec);
  spec.plant.inertia_kg_m2 *= 1.3;
  EXPECT_FALSE(compare(mine, fly(*make_attitude_verification(spec))).same_event_sequence);
}

}  // namespace
}  // namespace slew
