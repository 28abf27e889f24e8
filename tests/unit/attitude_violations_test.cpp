// Requests in three axes that are refused: where, and with which sentence.
#include "tests/unit/attitude_requests.hpp"

namespace slew {
namespace {

using nlohmann::json;
using test::attitude_request;
using test::instead_of_sliding_mode;
using test::instead_of_thrusters;
using test::thruster_set;
using test::twelve_thrusters;

using Pointers = std::vector<std::string>;

Pointers refused(const json& changes) {
  return test::refused_at(attitude_request(changes));
}

// The first sentence.
std::string problem(const json& changes) {
  const auto outcome = prepare(attitude_request(changes).dump());
  const auto* rejection = std::get_if<Rejection>(&outcome);
  return rejection ? rejection->violations.front().problem : "";
}

bool says(const json& changes, const std::string& words) {
  return problem(changes).find(words) != std::string::npos;
}

TEST(AttitudeViolations, NoneOfASoundRequest) {
  EXPECT_EQ(refused(json::object()), Pointers{});
}

TEST(AttitudeViolations, OfAnInertia) {
  const auto inertia = [](json value) { return json{{"plant", {{"inertia_kg_m2", std::move(value)}}}}; };
  EXPECT_EQ(refused(inertia({{1, 0.1, 0}, {0.2, 1, 0}, {0, 0, 1}})), Pointers{"/plant/inertia_kg_m2/1/0"});
  EXPECT_TRUE(says(inertia({{1, 0.1, 0}, {0.2, 1, 0}, {0, 0, 1}}), "J_xy and its mirror differ"));
  EXPECT_EQ(refused(inertia({1, 1, 0})), Pointers{"/plant/inertia_kg_m2"});
  EXPECT_TRUE(says(inertia({{1, 2, 0}, {2, 1, 0}, {0, 0, 1}}), "not positive definite"));
  EXPECT_TRUE(says(inertia({{1, 2, 0}, {2, 1, 0}, {0, 0, 1}}), "[-"));
  // The largest of the three is named: the moments and the axis nearest to it.
  EXPECT_TRUE(says(inertia({1, 2.5, 1}), "principal moments are [1, 1, 2.5]"));
  EXPECT_TRUE(says(inertia({1, 2.5, 1}), "near body y"));
  EXPECT_EQ(refused(inertia({1, 2, 1})), Pointers{});
  EXPECT_TRUE(says(inertia(json::parse("[1, [0, 1, 0], 1]")), "neither a diagonal nor a matrix"));
  EXPECT_EQ(refused(inertia({1, 1})), Pointers{"/plant/inertia_kg_m2"});
  EXPECT_EQ(refused(inertia({"1", 1, 1})), Pointers{"/plant/inertia_kg_m2/0"});
}

TEST(AttitudeViolations, ABeliefMayBeOfNoBodyThereIs) {
  EXPECT_EQ(refused({{"controller", {{"inertia_kg_m2", {1, 5, 1}}}}}), Pointers{});
  EXPECT_EQ(refused({{"controller", {{"inertia_kg_m2", {1, 5, -1}}}}}),
            Pointers{"/controller/inertia_kg_m2"});
  EXPECT_EQ(refused({{"estimator", {{"type", "disturbance_observer"}, {"inertia_kg_m2", {0, 1, 1}}}}}),
            Pointers{"/estimator/inertia_kg_m2"});
}

TEST(AttitudeViolations, OfAttitudes) {
  const auto initial = [](json attitude) {
    attitude["value"] = attitude.value("value", json());
    return json{{"maneuver", {{"initial_attitude", std::move(attitude)}}}};
  };
  EXPECT_EQ(refused(initial({{"type", "rotation"}, {"axis", {0, 0, 0}}, {"angle_deg", 10}})),
            Pointers{"/maneuver/initial_attitude/axis"});
  EXPECT_EQ(refused(initial({{"type", "euler_parameters"}, {"value", {0, 0, 0, 0}}})),
            Pointers{"/maneuver/initial_attitude/value"});
  EXPECT_EQ(refused(initial({{"type", "rotation"}, {"axis", {0, 0, 1}}, {"angle_deg", 360}})),
            Pointers{"/maneuver/initial_attitude/angle_deg"});
  EXPECT_EQ(refused(initial({{"type", "euler_parameters"}, {"value", {-1, 0, 0, 0}}})),
            Pointers{"/maneuver/initial_attitude"});
  EXPECT_TRUE(says(initial({{"type", "euler_parameters"}, {"value", {-1, 0, 0, 0}}}), "a whole turn"));
  EXPECT_EQ(refused({{"maneuver",
                      {{"reference",
                        {{"type", "eigenaxis_rotation"},
                         {"axis", {0, 0, 0}},
                         {"initial_angle_deg", 1},
                         {"duration_s", 1}}}}}}),
            Pointers{"/maneuver/reference/axis"});
}

TEST(AttitudeViolations, OfLaws) {
  EXPECT_EQ(refused({{"controller", {{"lambda_1_s", 0.3854}}}}), Pointers{"/controller/lambda_1_s"});
  EXPECT_EQ(refused({{"controller", {{"lambda_1_s", {-1, -1, 0}}}}}), Pointers{"/controller/lambda_1_s/2"});
  EXPECT_EQ(refused({{"controller", {{"boundary_layer_rad_s", 0}}}}),
            Pointers{"/controller/boundary_layer_rad_s"});
  EXPECT_EQ(refused({{"controller", {{"lambda_1_s", nullptr}}}}), Pointers{"/controller/lambda_1_s"});
  const json program = instead_of_sliding_mode({{"type", "torque_program"},
                                                {"initial_torque_N_m", {1, 1, 1}},
                                                {"switch_times_x_s", {0, 1, 3, 2}},
                                                {"end_s", 4}});
  EXPECT_EQ(refused({{"controller", program}}),
            (Pointers{"/controller/switch_times_x_s/0", "/controller/switch_times_x_s/3"}));
  json sampled = program;
  sampled["switch_times_x_s"] = {1};
  EXPECT_EQ(refused({{"controller", sampled}}), Pointers{});
  sampled["evaluation"] = {{"type", "sampled"}, {"period_s", 0.1}};
  EXPECT_EQ(refused({{"controller", sampled}}), Pointers{"/controller/evaluation"});
}

TEST(AttitudeViolations, OfWhatALawCannotDo) {
  const json damping = instead_of_sliding_mode(
      {{"type", "rate_damping"}, {"damping_N_m_s", 1}, {"evaluation", {{"type", "continuous"}}}});
  const json observed = {{"controller", damping}, {"estimator", {{"type", "disturbance_observer"}}}};
  EXPECT_EQ(refused(observed), Pointers{"/estimator/type"});
  EXPECT_TRUE(says(observed, "sliding surface"));
  const json moving = {{"type", "sinusoids"}, {"amplitude", {0, 0, 0.1}}, {"frequency_hz", {0, 0, 0.1}}};
  EXPECT_EQ(refused({{"controller", damping}, {"maneuver", {{"reference", moving}}}}),
            Pointers{"/maneuver/reference/type"});
  EXPECT_EQ(refused({{"maneuver", {{"reference", moving}}}}), Pointers{});
  EXPECT_EQ(refused({{"maneuver", {{"reference", moving}}}, {"plant", {{"shadow_switch_norm", 1.1}}}}),
            Pointers{"/plant/shadow_switch_norm"});
  const json seen = {{"type", "sampled_attitude"}};
  const json wide = {{"modulator", {{"type", "pulse_width"}}}};
  EXPECT_EQ(refused({{"sensors", seen}, {"actuator", wide}}),
            (Pointers{"/actuator/modulator/type", "/sensors/type"}));
  const json program =
      instead_of_sliding_mode({{"type", "torque_program"}, {"initial_torque_N_m", {1, 1, 1}}, {"end_s", 4}});
  EXPECT_EQ(refused({{"sensors", seen}, {"actuator", wide}, {"controller", program}}),
            (Pointers{"/actuator/modulator/type", "/sensors/type"}));
  EXPECT_EQ(refused({{"sensors", seen},
                     {"actuator", wide},
                     {"controller", {{"evaluation", {{"type", "sampled"}, {"period_s", 0.1}}}}}}),
            Pointers{});
  EXPECT_EQ(refused({{"stop", {{"when", "first_rest"}}}}), Pointers{"/stop/when"});
  EXPECT_EQ(refused({{"stop", {{"when", "end_box"}}}}), Pointers{"/stop/when"});
}

TEST(AttitudeViolations, OfThrusters) {
  EXPECT_EQ(refused({{"actuator", {{"modulator", {{"on", 0.2}}}}}}), Pointers{"/actuator/modulator/off"});
  EXPECT_EQ(refused({{"actuator", {{"tank_kg", 1}}}}),
            (Pointers{"/actuator/lever_arm_m", "/actuator/specific_impulse_s"}));
  EXPECT_EQ(refused({{"actuator",
                      thruster_set(twelve_thrusters(), {{"specific_impulse_s", 220}, {"tank_kg", 1}})}}),
            Pointers{});
  json thrusters = twelve_thrusters();
  thrusters[3]["direction"] = {0, 0, 0};
  EXPECT_EQ(refused({{"actuator", thruster_set(thrusters, {{"thrust_N", nullptr}})}}).size(), 13u);
  // Without those towards +y.
  thrusters = twelve_thrusters();
  thrusters.erase(5);
  thrusters.erase(4);
  EXPECT_EQ(refused({{"actuator", thruster_set(thrusters)}}), Pointers{"/actuator/thrusters"});
  EXPECT_TRUE(says({{"actuator", thruster_set(thrusters)}}, "about +y"));
  EXPECT_EQ(refused({{"actuator", thruster_set(json::array())}}), Pointers{"/actuator/thrusters"});
}

TEST(AttitudeViolations, OfSettling) {
  const auto settling = [](json quantity, json tolerance) {
    return json{{"metrics", {{"settling", {{"quantity", quantity}, {"tolerance", tolerance}}}}}};
  };
  const std::string block = "/metrics/settling/tolerance";
  EXPECT_EQ(refused(settling("mrp_1", {{"type", "absolute"}, {"value_deg", 1}})),
            (Pointers{block + "/value", block + "/value_deg"}));
  EXPECT_EQ(refused(settling("angle_deg", {{"type", "absolute"}, {"value", 1}})),
            (Pointers{block + "/value", block + "/value_deg"}));
  EXPECT_EQ(refused(settling("angle_deg", {{"type", "absolute"}})), Pointers{block + "/value_deg"});
}

TEST(AttitudeViolations, OfWhatWouldTakeTooManySteps) {
  EXPECT_EQ(refused({{"simulation", {{"duration_s", 1e5}}},
                     {"telemetry", {{"sample_period_s", 1}}},
                     {"actuator", {{"modulator", {{"time_constant_s", 1e-4}}}}}}),
            Pointers{"/actuator/modulator"});
  EXPECT_EQ(refused({{"estimator", {{"type", "disturbance_observer"}, {"pole_rad_s", 1e7}}}}),
            Pointers{"/estimator/pole_rad_s"});
  EXPECT_EQ(refused({{"disturbances",
                      {{{"type", "body_sinusoid"}, {"amplitude_N_m", {0, 0, 1}}, {"frequency_hz", 1e6}}}}}),
            Pointers{"/disturbances"});
}

// Every part of a request for another number of axes is refused where it stands, and for no other reason.
TEST(AttitudeViolations, OfPartsWithAnotherNumberOfAxes) {
  const json three =
      attitude_request({{"estimator", {{"type", "disturbance_observer"}}},
                        {"sensors", {{"type", "sampled_attitude"}}},
                        {"controller", {{"evaluation", {{"type", "sampled"}, {"period_s", 0.1}}}}},
                        {"disturbances", {{{"type", "body_constant"}, {"torque_N_m", {0, 0, 1}}}}},
                        {"metrics", {{"settling", {{"quantity", "mrp_3"}}}}}});
  EXPECT_EQ(test::refused_at(three), Pointers{});
  json one = json::parse(R"({
    "plant": {"type": "rigid_axis", "inertia_kg_m2": 2},
    "maneuver": {"type": "single_axis", "final_angle_deg": 30},
    "controller": {"type": "attitude_rate_feedback", "attitude_gain_N_m_rad": 1, "rate_gain_N_m_s_rad": 2},
    "actuator": {"type": "proportional"},
    "estimator": {"type": "first_order_angle", "gain_1_s": 3},
    "disturbances": [{"type": "constant", "torque_N_m": 0.1}],
    "simulation": {"duration_s": 10}})");
  EXPECT_EQ(test::refused_at(one), Pointers{});
  const std::vector<std::pair<const char*, std::string>> parts = {{"maneuver", "/maneuver/type"},
                                                                  {"controller", "/controller/type"},
                                                                  {"actuator", "/actuator/type"},
                                                                  {"estimator", "/estimator/type"},
                                                                  {"disturbances", "/disturbances/0/type"}};
  for (const auto& [part, pointer] : parts) {
    json changed = three;
    changed[part] = one.at(part);
    if (part == std::string("controller")) changed["estimator"] = {{"type", "none"}};
    EXPECT_EQ(test::refused_at(changed), Pointers{pointer}) << part;
    changed = one;
    changed[part] = three.at(part);
    if (part == std::string("controller")) changed["estimator"] = {{"type", "none"}};
    EXPECT_EQ(test::refused_at(changed), Pointers{pointer}) << part;
  }
  json changed = one;
  changed["sensors"] = three.at("sensors");
  changed["metrics"] = three.at("metrics");
  EXPECT_EQ(test::refused_at(changed), (Pointers{"/metrics/settling/quantity", "/sensors/type"}));
}

TEST(AttitudeViolations, OfTheWholeAtOnce) {
  const json changes = {{"plant", {{"inertia_kg_m2", {1, 3, 1}}}},
                        {"controller", {{"lambda_1_s", 1}}},
                        {"actuator", {{"modulator", {{"off", 1}}}}},
                        {"sensors", {{"type", "sampled_attitude"}}},
                        {"stop", {{"when", "end_box"}}}};
  EXPECT_EQ(refused(changes), (Pointers{"/actuator/modulator/off", "/controller/lambda_1_s",
                                        "/plant/inertia_kg_m2", "/sensors/type", "/stop/when"}));
}

}  // namespace
}  // namespace slew
