// Requests in three axes: what becomes of them. Kim & Crassidis 1998, Case C: 180 deg yaw from p = (0, 0, 1),
// J = diag(125.4, 108.3, 131.1), J^ = 114 kg m^2, lambda -0.3854, K 0.0421, K_m 7.46, T_m 1.33, U_on 0.45,
// U_off 0.25.
#include <cmath>

#include "server/experiment/law_fields.hpp"
#include "server/experiment/schema.hpp"
#include "tests/unit/attitude_requests.hpp"

namespace slew {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using nlohmann::json;
using test::attitude_request;
using test::attitude_specified;
using test::instead_of_sliding_mode;
using test::instead_of_thrusters;
using test::thruster_set;
using test::twelve_thrusters;

constexpr double kRadPerDeg = 3.14159265358979323846 / 180;

TEST(AttitudeRequest, CaseC) {
  const AttitudeSpecification spec = attitude_specified();
  EXPECT_EQ(spec.plant.inertia_kg_m2, Matrix3d(Vector3d(125.4, 108.3, 131.1).asDiagonal()));
  EXPECT_EQ(spec.plant.attitude, AttitudeParameters::mrp);
  EXPECT_FALSE(spec.plant.shadow_switch_norm);
  EXPECT_EQ(spec.maneuver.initial_mrp, Vector3d::UnitZ());
  EXPECT_TRUE(spec.maneuver.reference.is_fixed());
  const auto& law = std::get<SlidingMode>(spec.law);
  EXPECT_EQ(law.lambda_1_s, Vector3d::Constant(-0.3854));
  EXPECT_EQ(law.gain_rad_s2, Vector3d::Constant(0.0421));
  EXPECT_EQ(law.boundary_layer_rad_s, 0.01);
  EXPECT_EQ(law.inertia_kg_m2, Matrix3d(114 * Matrix3d::Identity()));
  EXPECT_FALSE(spec.sample_period_s);
  EXPECT_FALSE(spec.observer);
  EXPECT_TRUE(spec.sensor.is_ideal());
  const auto& pairs = std::get<AxisThrusters>(spec.actuator);
  const auto& pwpf = std::get<PwpfModulator>(pairs.modulator);
  EXPECT_EQ(pairs.torque_N_m, Vector3d::Ones());
  EXPECT_EQ(pwpf.gain, 7.46);
  EXPECT_EQ(pwpf.time_constant_s, 1.33);
  EXPECT_EQ(pwpf.on, 0.45);
  EXPECT_EQ(pwpf.off, 0.25);
  EXPECT_EQ(pwpf.input, ModulatorInput::raw);
  EXPECT_EQ(spec.settling.quantity, AttitudeQuantity::angle);
  EXPECT_TRUE(spec.settling.is_fraction_of_initial);
  EXPECT_EQ(spec.settling.tolerance, 0.01);
  EXPECT_EQ(spec.relative_tolerance, 1e-12);
}

TEST(AttitudeRequest, AnInertiaIsADiagonalOrRows) {
  const auto spec =
      attitude_specified({{"plant", {{"inertia_kg_m2", {{10, 1, 0.5}, {1, 12, -0.25}, {0.5, -0.25, 9}}}}},
                          {"controller", {{"inertia_kg_m2", nullptr}}}});
  Matrix3d inertia;
  inertia << 10, 1, 0.5, 1, 12, -0.25, 0.5, -0.25, 9;
  EXPECT_EQ(spec.plant.inertia_kg_m2, inertia);
  // What a law believes is what is there, where it is left out.
  EXPECT_EQ(std::get<SlidingMode>(spec.law).inertia_kg_m2, inertia);
}

Vector3d initial_mrp(json initial, const json& final) {
  if (!initial.contains("value")) initial["value"] = nullptr;
  return attitude_specified({{"maneuver", {{"initial_attitude", initial}, {"final_attitude", final}}}})
      .maneuver.initial_mrp;
}

TEST(AttitudeRequest, AGivenMrpIsKeptToTheBit) {
  const Vector3d given(0.1, -1.0 / 3, 0.7);
  const json initial = {{"type", "mrp"}, {"value", {given[0], given[1], given[2]}}};
  EXPECT_EQ(initial_mrp(initial, {{"type", "mrp"}, {"value", {0, 0, 0}}}), given);
  EXPECT_EQ(initial_mrp(initial, {{"type", "rotation"}, {"axis", {0, 1, 0}}, {"angle_deg", 0}}), given);
}

TEST(AttitudeRequest, ARotationIsTheTangentOfAQuarter) {
  const Vector3d axis = Vector3d(1, 2, 3).normalized();
  const json none = {{"type", "mrp"}, {"value", {0, 0, 0}}};
  const auto rotation = [](double angle_deg) {
    return json{{"type", "rotation"}, {"axis", {1, 2, 3}}, {"angle_deg", angle_deg}};
  };
  EXPECT_LT((initial_mrp(rotation(120), none) - std::tan(30 * kRadPerDeg) * axis).norm(), 1e-16);
  // The long way round has |p| > 1, and keeps it.
  EXPECT_LT((initial_mrp(rotation(-270), none) + std::tan(67.5 * kRadPerDeg) * axis).norm(), 1e-15);
}

TEST(AttitudeRequest, AttitudesAreToldRelativeToTheFinalOne) {
  const json about_z = {{"type", "rotation"}, {"axis", {0, 0, 1}}, {"angle_deg", 90}};
  const json none = {{"type", "mrp"}, {"value", {0, 0, 0}}};
  EXPECT_LT((initial_mrp(none, about_z) + std::tan(22.5 * kRadPerDeg) * Vector3d::UnitZ()).norm(), 1e-16);
  EXPECT_LT(initial_mrp(about_z, about_z).norm(), 1e-16);
  // Euler parameters of any length, and of either sign: the other way round.
  const json q = {{"type", "euler_parameters"}, {"value", {3, 0, 4, 0}}};
  const json minus_q = {{"type", "euler_parameters"}, {"value", {-3, 0, -4, 0}}};
  EXPECT_LT((initial_mrp(q, none) - Vector3d(0, 0.5, 0)).norm(), 1e-16);
  EXPECT_LT((initial_mrp(minus_q, none) + Vector3d(0, 2, 0)).norm(), 1e-15);
  // First about z, then about the new x: as seen from there, about x.
  const Vector4<double> both = euler_parameters<double>(Vector3d(0, 0, std::tan(22.5 * kRadPerDeg)));
  Vector4<double> turned;
  const double c = std::cos(15 * kRadPerDeg), s = std::sin(15 * kRadPerDeg);
  turned << both[0] * c, both[0] * s, both[3] * s, both[3] * c;
  const json composed = {{"type", "euler_parameters"},
                         {"value", {turned[0], turned[1], turned[2], turned[3]}}};
  EXPECT_LT((initial_mrp(composed, about_z) - std::tan(7.5 * kRadPerDeg) * Vector3d::UnitX()).norm(), 1e-15);
}

// A new law needs one file, one line and one entry in the schema: this is what holds them together.
TEST(AttitudeRequest, EveryLawHasItsEntryWithTheNamesOfItsFields) {
  const json& controller = schema_document("request").at("/properties/controller"_json_pointer);
  for_each_law([&](auto law) {
    using Law = decltype(law);
    SCOPED_TRACE(Law::kType);
    LawWriter writer;
    law.fields(writer);
    std::set<std::string> fields{"type"};
    if (!Law::kIsProgram) fields.insert("evaluation");
    for (const auto& [name, value] : writer.document().items()) fields.insert(name);
    std::set<std::string> entry;
    for (const json& branch : controller.at("allOf"))
      if (branch.at("/if/properties/type/const"_json_pointer) == Law::kType)
        for (const auto& [name, property] : branch.at("/then/properties"_json_pointer).items())
          entry.insert(name);
    EXPECT_EQ(entry, fields);
  });
}

TEST(AttitudeRequest, EveryLaw) {
  const json continuous = {{"type", "continuous"}};
  const auto law_of = [&](json law) {
    if (!law.contains("end_s")) law["evaluation"] = continuous;
    return attitude_specified({{"controller", instead_of_sliding_mode(std::move(law))}}).law;
  };
  const auto surface = std::get<LinearSurface>(law_of({{"type", "linear_surface"},
                                                       {"slope_1_s", {0.4, 0.5, 0.6}},
                                                       {"gain_N_m", 2},
                                                       {"boundary_layer_rad_s", 0.02}}));
  EXPECT_EQ(surface.slope_1_s, Vector3d(0.4, 0.5, 0.6));
  EXPECT_EQ(surface.gain_N_m, Vector3d::Constant(2));
  EXPECT_EQ(surface.inertia_kg_m2(2, 2), 131.1);
  const auto quaternion = std::get<QuaternionFeedback>(
      law_of({{"type", "quaternion_feedback"}, {"attitude_gain_1_s2", 0.2}, {"rate_gain_1_s", 0.5}}));
  EXPECT_EQ(quaternion.attitude_gain_1_s2, 0.2);
  EXPECT_EQ(quaternion.gyroscopic_compensation, 1);
  EXPECT_EQ(std::get<RateDamping>(law_of({{"type", "rate_damping"}, {"damping_N_m_s", 7}})).damping_N_m_s,
            Vector3d::Constant(7));
  const auto program = std::get<TorqueProgram>(law_of({{"type", "torque_program"},
                                                       {"initial_torque_N_m", {1, -1, 0}},
                                                       {"switch_times_y_s", {1, 2.5}},
                                                       {"end_s", 4}}));
  EXPECT_EQ(program.initial_torque_N_m, Vector3d(1, -1, 0));
  EXPECT_TRUE(program.switch_times_s[0].empty());
  EXPECT_EQ(program.switch_times_s[1], (std::vector<double>{1, 2.5}));
  EXPECT_EQ(program.end_s, 4);
}

TEST(AttitudeRequest, AnObserverBelievesWhatTheLawBelieves) {
  const auto observer_of = [](json estimator, json controller = json::object()) {
    estimator["type"] = "disturbance_observer";
    return *attitude_specified({{"estimator", estimator}, {"controller", controller}}).observer;
  };
  const DisturbanceObserver plain = observer_of(json::object());
  EXPECT_EQ(plain.pole_rad_s, 10);
  EXPECT_EQ(plain.feeding, ObserverFeeding::applied_minus_equivalent);
  EXPECT_EQ(plain.inertia_kg_m2(0, 0), 114);
  EXPECT_EQ(observer_of({{"inertia_kg_m2", {1, 2, 2}}}).inertia_kg_m2(1, 1), 2);
  EXPECT_EQ(observer_of(json::object(), {{"inertia_kg_m2", nullptr}}).inertia_kg_m2(0, 0), 125.4);
  EXPECT_EQ(observer_of({{"feeding", "applied_total"}}).feeding, ObserverFeeding::applied_total);
  EXPECT_EQ(observer_of({{"feeding", "commanded"}}).feeding, ObserverFeeding::commanded);
}

TEST(AttitudeRequest, DisturbancesOfABody) {
  const auto spec = attitude_specified({{"disturbances",
                                         {{{"type", "body_constant"}, {"torque_N_m", {1, 2, 3}}},
                                          {{"type", "body_step"}, {"from_s", 7}, {"torque_N_m", {0, 0, 1}}},
                                          {{"type", "body_step"}, {"from_s", 3}, {"torque_N_m", {0, 1, 0}}},
                                          {{"type", "body_step"}, {"from_s", 0}, {"torque_N_m", {1, 0, 0}}},
                                          {{"type", "body_sinusoid"},
                                           {"amplitude_N_m", {0.1, -0.1, 0.1}},
                                           {"frequency_hz", 2},
                                           {"phase_deg", 90}}}}});
  EXPECT_EQ(spec.disturbances.constant_N_m, Vector3d(2, 2, 3));
  ASSERT_EQ(spec.disturbances.steps.size(), 2u);
  EXPECT_EQ(spec.disturbances.steps[0].from_s, 3);
  EXPECT_EQ(spec.disturbances.sinusoids[0].amplitude_N_m, Vector3d(0.1, -0.1, 0.1));
  EXPECT_DOUBLE_EQ(spec.disturbances.sinusoids[0].frequency_rad_s, 720 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(spec.disturbances.sinusoids[0].phase_rad, 90 * kRadPerDeg);
}

TEST(AttitudeRequest, WhatASampledLawSees) {
  const auto spec =
      attitude_specified({{"controller", {{"evaluation", {{"type", "sampled"}, {"period_s", 0.1}}}}},
                          {"sensors",
                           {{"type", "sampled_attitude"},
                            {"angle_noise_deg", 0.1},
                            {"rate_bias_deg_s", {0, 0, 1}},
                            {"rate_quantum_deg_s", 0.5},
                            {"laws_samples_per_reading", 3},
                            {"delay_samples", 2}}}});
  EXPECT_EQ(spec.sample_period_s, 0.1);
  EXPECT_DOUBLE_EQ(spec.sensor.angle_noise_rad, 0.1 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(spec.sensor.rate_bias_rad_s[2], kRadPerDeg);
  EXPECT_DOUBLE_EQ(spec.sensor.rate_quantum_rad_s, 0.5 * kRadPerDeg);
  EXPECT_EQ(spec.sensor.laws_samples_per_reading, 3);
  EXPECT_EQ(spec.sensor.delay_samples, 2);
}

TEST(AttitudeRequest, AThrusterSaysWhatItsSetDoesNot) {
  json thrusters = twelve_thrusters();
  thrusters[1].merge_patch({{"direction", {0, 0, -2}},
                            {"thrust_N", 5},
                            {"on_delay_s", 0.02},
                            {"minimum_on_time_of", "effective_thrust"},
                            {"stuck_closed_from_s", 30}});
  const auto spec = attitude_specified(
      {{"actuator", thruster_set(thrusters, {{"thrust_N", 2},
                                             {"on_delay_s", 0.01},
                                             {"rise_s", 0.003},
                                             {"misalignment_deg", 1},
                                             {"allocation", {{"type", "linear_programme"}}},
                                             {"specific_impulse_s", 220},
                                             {"tank_kg", 3}})}});
  const auto& set = std::get<MountedThrusters>(spec.actuator);
  ASSERT_EQ(set.thrusters.size(), 12u);
  const Thruster &first = set.thrusters[0], &second = set.thrusters[1];
  EXPECT_EQ(first.thrust_N, 2);
  EXPECT_EQ(first.on_delay_s, 0.01);
  EXPECT_EQ(first.rise_s, 0.003);
  EXPECT_DOUBLE_EQ(first.misalignment_rad, kRadPerDeg);
  EXPECT_EQ(first.minimum_on_time_of, MinimumOnTimeOf::valve_command);
  EXPECT_EQ(first.stuck_closed_from_s, std::numeric_limits<double>::infinity());
  EXPECT_EQ(torque_N_m(first), 2 * Vector3d::UnitX());
  EXPECT_EQ(second.thrust_N, 5);
  EXPECT_EQ(second.direction, -Vector3d::UnitZ());
  EXPECT_EQ(second.on_delay_s, 0.02);
  EXPECT_EQ(second.rise_s, 0.003);
  EXPECT_EQ(second.minimum_on_time_of, MinimumOnTimeOf::effective_thrust);
  EXPECT_EQ(second.stuck_closed_from_s, 30);
  EXPECT_EQ(set.allocation, AllocationMethod::linear_programme);
  EXPECT_EQ(set.propellant.specific_impulse_s, 220);
  EXPECT_EQ(set.propellant.tank_kg, 3);
}

TEST(AttitudeRequest, OtherActuatorsAndModulators) {
  const auto wheels = attitude_specified({{"actuator", instead_of_thrusters({{"type", "ideal_torque"}})}});
  EXPECT_FALSE(std::get<IdealTorque>(wheels.actuator).maximum_N_m);
  const auto bounded = attitude_specified(
      {{"actuator", instead_of_thrusters({{"type", "ideal_torque"}, {"maximum_torque_N_m", {4, 5, 6}}})}});
  EXPECT_EQ(*std::get<IdealTorque>(bounded.actuator).maximum_N_m, Vector3d(4, 5, 6));
  const auto modulator = [](json block) {
    return std::get<AxisThrusters>(
               attitude_specified({{"actuator", {{"modulator", block}}},
                                   {"controller", {{"evaluation", {{"type", "sampled"}, {"period_s", 1}}}}}})
                   .actuator)
        .modulator;
  };
  EXPECT_EQ(
      std::get<SchmittModulator>(modulator({{"type", "schmitt_trigger"}, {"on", 0.6}, {"off", 0.1}})).off,
      0.1);
  EXPECT_EQ(std::get<PulseWidthModulator>(modulator({{"type", "pulse_width"}, {"minimum_on_time_s", 0.02}}))
                .minimum_on_time_s,
            0.02);
  EXPECT_EQ(std::get<PwpfModulator>(modulator({{"input", "clipped"}})).input, ModulatorInput::clipped);
  EXPECT_EQ(std::get<PwpfModulator>(modulator({{"input", "scaled"}})).input, ModulatorInput::scaled);
}

TEST(AttitudeRequest, SettlingIsOfAnAngleOrOfParameters) {
  const auto settling = [](json quantity, json tolerance) {
    return attitude_specified(
               {{"metrics", {{"settling", {{"quantity", quantity}, {"tolerance", tolerance}}}}}})
        .settling;
  };
  const auto angle = settling("angle_deg", {{"type", "absolute"}, {"value_deg", 2}, {"value", nullptr}});
  EXPECT_DOUBLE_EQ(angle.tolerance, 2 * kRadPerDeg);
  EXPECT_FALSE(angle.is_fraction_of_initial);
  const auto norm = settling("mrp_norm", {{"type", "absolute"}, {"value", 0.02}});
  EXPECT_EQ(norm.quantity, AttitudeQuantity::mrp_norm);
  EXPECT_EQ(norm.tolerance, 0.02);
  EXPECT_EQ(settling("mrp_3", {{"type", "fraction_of_initial"}, {"value", 0.05}}).quantity,
            AttitudeQuantity::mrp_3);
}

TEST(AttitudeRequest, AReferenceThatMoves) {
  const auto reference = [](json block) {
    return attitude_specified({{"maneuver", {{"reference", block}}}}).maneuver.reference;
  };
  const auto sinusoids = std::get<MrpSinusoids>(
      reference({{"type", "sinusoids"}, {"amplitude", {0.1, 0.2, 0}}, {"frequency_hz", {0.5, 1, 0}}}).shape);
  EXPECT_EQ(sinusoids.amplitude, Vector3d(0.1, 0.2, 0));
  EXPECT_DOUBLE_EQ(sinusoids.frequency_rad_s[0], 180 * kRadPerDeg);
  const auto rotation = std::get<EigenaxisRotation>(reference({{"type", "eigenaxis_rotation"},
                                                               {"axis", {0, 3, 4}},
                                                               {"initial_angle_deg", 90},
                                                               {"from_s", 5},
                                                               {"duration_s", 60}})
                                                        .shape);
  EXPECT_LT((rotation.axis - Vector3d(0, 0.6, 0.8)).norm(), 1e-16);
  EXPECT_DOUBLE_EQ(rotation.initial_angle_rad, 90 * kRadPerDeg);
  EXPECT_EQ(rotation.final_angle_rad, 0);
  EXPECT_EQ(rotation.duration_s, 60);
}

TEST(AttitudeRequest, WarnsOfAnObserverThatWindsUp) {
  const auto warnings = [](json changes) {
    changes["estimator"]["type"] = "disturbance_observer";
    return test::prepared(attitude_request(changes)).warnings;
  };
  const json commanded = {{"estimator", {{"feeding", "commanded"}}}};
  ASSERT_EQ(warnings(commanded).size(), 1u);
  EXPECT_NE(warnings(commanded)[0].find("winds up"), std::string::npos);
  EXPECT_TRUE(warnings(json::object()).empty());
  json wheels = commanded;
  wheels["actuator"] = instead_of_thrusters({{"type", "ideal_torque"}});
  EXPECT_TRUE(warnings(wheels).empty());
  wheels["actuator"]["maximum_torque_N_m"] = {1, 1, 1};
  EXPECT_EQ(warnings(wheels).size(), 1u);
}

}  // namespace
}  // namespace slew
