// Requests for on-off laws: what becomes of them, and what is refused with which sentence.
#include <gtest/gtest.h>

#include "server/experiment/axis_request.hpp"
#include "server/experiment/experiment.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr double kRadPerDeg = 3.14159265358979323846 / 180;

json request(json changes = json::object()) {
  json document = {{"plant", {{"type", "rigid_axis"}, {"inertia_kg_m2", 2}}},
                   {"maneuver", {{"type", "single_axis"}, {"final_angle_deg", 30}}},
                   {"controller", {{"type", "switching_function"}, {"evaluation", {{"type", "ideal"}}}}},
                   {"actuator", {{"type", "on_off_pair"}, {"torque_N_m", 0.5}}},
                   {"simulation", {{"duration_s", 100}}}};
  document.merge_patch(changes);
  return document;
}

OnOffAxisSpecification specified(const json& changes) {
  auto outcome = prepare(request(changes).dump());
  if (auto* rejection = std::get_if<Rejection>(&outcome)) {
    for (const Violation& violation : rejection->violations) ADD_FAILURE() << to_json(violation);
    return {};
  }
  return specify_on_off_axis(json::parse(std::get<Prepared>(outcome).resolved));
}

std::vector<std::string> refused(const json& changes) {
  const auto outcome = prepare(request(changes).dump());
  std::vector<std::string> pointers;
  if (const auto* rejection = std::get_if<Rejection>(&outcome))
    for (const Violation& violation : rejection->violations) {
      EXPECT_FALSE(violation.problem.empty());
      EXPECT_FALSE(violation.allowed.empty()) << violation.pointer;
      pointers.push_back(violation.pointer);
    }
  return pointers;
}

using Pointers = std::vector<std::string>;

TEST(AxisRequest, ASchmittTriggerIsABandWithHysteresis) {
  const auto spec = specified({{"controller",
                                {{"type", "schmitt_trigger"},
                                 {"rate_gain_s", 5},
                                 {"on_deg", 3},
                                 {"off_deg", 1},
                                 {"evaluation", {{"type", "continuous"}}}}}});
  EXPECT_EQ(spec.law.deadband, Deadband::double_sided);
  EXPECT_DOUBLE_EQ(spec.law.deadband_rad, 3 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(spec.law.hysteresis_rad, 2 * kRadPerDeg);
  EXPECT_EQ(spec.law.rate_gain_s, 5);
  EXPECT_EQ(spec.law.gamma_bar, 0);
}

TEST(AxisRequest, DisturbancesOfEveryKind) {
  const auto spec =
      specified({{"disturbances",
                  {{{"type", "constant"}, {"torque_N_m", 0.01}},
                   {{"type", "fraction_of_thrust"}, {"fraction", -0.06}},
                   {{"type", "step"}, {"from_s", 7}, {"torque_N_m", 0.02}},
                   {{"type", "step"}, {"from_s", 3}, {"torque_N_m", -0.02}},
                   {{"type", "sinusoid"}, {"amplitude_N_m", 0.03}, {"frequency_hz", 2}, {"phase_deg", 90}},
                   {{"type", "friction"}, {"torque_N_m", 0.04}}}}});
  EXPECT_DOUBLE_EQ(spec.disturbances.constant_N_m, 0.01 - 0.03);
  ASSERT_EQ(spec.disturbances.steps.size(), 2u);
  EXPECT_EQ(spec.disturbances.steps[0].from_s, 3);
  EXPECT_DOUBLE_EQ(spec.disturbances.sinusoids[0].frequency_rad_s, 4 * std::acos(-1.0));
  EXPECT_DOUBLE_EQ(spec.disturbances.sinusoids[0].phase_rad, 90 * kRadPerDeg);
  EXPECT_EQ(spec.disturbances.friction_N_m, 0.04);
}

TEST(AxisRequest, SlidingWithoutRegularisationIsRefused) {
  const json continuous = {{"controller", {{"evaluation", {{"type", "continuous"}}}}}};
  EXPECT_EQ(refused(continuous), Pointers{"/actuator/minimum_on_time_s"});
  for (const json& regularised :
       {json{{"controller", {{"hysteresis_deg", 0.1}}}}, json{{"actuator", {{"switching_delay_s", 0.1}}}},
        json{{"actuator", {{"minimum_on_time_s", 0.1}}}}}) {
    json changes = continuous;
    changes.merge_patch(regularised);
    EXPECT_EQ(refused(changes), Pointers{}) << regularised;
  }
}

TEST(AxisRequest, AnIdealLawHasNothingThatTakesTime) {
  EXPECT_EQ(
      refused({{"controller", {{"hysteresis_deg", 0.1}}},
               {"actuator", {{"switching_delay_s", 0.1}, {"minimum_on_time_s", 0.1}}}}),
      (Pointers{"/actuator/minimum_on_time_s", "/actuator/switching_delay_s", "/controller/hysteresis_deg"}));
  const json box = {{"controller", {{"end_box", {{"angle_deg", 1}, {"rate_deg_s", 1}}}}}};
  EXPECT_EQ(refused(box), Pointers{"/controller/end_box"});
  json stopped = box;
  stopped["stop"] = {{"when", "end_box"}};
  EXPECT_EQ(refused(stopped), Pointers{});
  EXPECT_EQ(refused({{"controller",
                      {{"type", "schmitt_trigger"}, {"rate_gain_s", 1}, {"on_deg", 3}, {"off_deg", 1}}}}),
            Pointers{"/controller/evaluation/type"});
}

TEST(AxisRequest, WhatDoesNotFitTogetherIsRefused) {
  EXPECT_EQ(refused({{"controller",
                      {{"type", "schmitt_trigger"},
                       {"rate_gain_s", 1},
                       {"on_deg", 1},
                       {"off_deg", 1},
                       {"evaluation", {{"type", "continuous"}}}}}}),
            Pointers{"/controller/off_deg"});
  EXPECT_EQ(refused({{"controller",
                      {{"deadband", {{"type", "single_sided"}, {"width_deg", 1}}},
                       {"hysteresis_deg", 2},
                       {"evaluation", {{"type", "continuous"}}}}}}),
            Pointers{"/controller/hysteresis_deg"});
  EXPECT_EQ(refused({{"controller",
                      {{"type", "firing_program"},
                       {"evaluation", nullptr},
                       {"firings",
                        {{{"from_s", 1}, {"to_s", 3}, {"direction", 1}},
                         {{"from_s", 2}, {"to_s", 2}, {"direction", -1}}}}}}}),
            (Pointers{"/controller/firings/1/from_s", "/controller/firings/1/to_s"}));
  EXPECT_EQ(refused({{"controller", {{"evaluation", {{"type", "sampled"}, {"period_s", 0.001}}}}},
                     {"actuator", {{"switching_delay_s", 1}}}}),
            Pointers{"/actuator/switching_delay_s"});
  EXPECT_EQ(refused({{"actuator", {{"torque_N_m", 0}}}}), Pointers{"/actuator/torque_N_m"});
  const json overdamped = {
      {"plant",
       {{"type", "flexible_axis"},
        {"modes", {{{"frequency_hz", 1}, {"damping_ratio", 1.5}, {"coupling_sqrt_kg_m", 0.1}}}}}}};
  EXPECT_EQ(refused(overdamped), Pointers{"/plant/modes/0/damping_ratio"});
}

TEST(AxisRequest, AMotionWithoutAClosedFormIsRefusedBeforeItFlies) {
  const json resonance = {
      {"plant", {{"type", "flexible_axis"}, {"modes", {{{"frequency_hz", 1}, {"coupling_sqrt_kg_m", 0}}}}}},
      {"disturbances", {{{"type", "sinusoid"}, {"amplitude_N_m", 0.1}, {"frequency_hz", 1}}}}};
  EXPECT_EQ(refused(resonance), Pointers{"/plant"});
  const json carried = {
      {"plant",
       {{"type", "flexible_axis"}, {"modes", {{{"frequency_hz", 1}, {"coupling_sqrt_kg_m", 1.5}}}}}}};
  EXPECT_EQ(refused(carried), Pointers{"/plant/inertia_kg_m2"});
}

TEST(AxisRequest, Warnings) {
  const auto warned = [](const json& changes, const char* words) {
    const auto outcome = prepare(request(changes).dump());
    const auto* prepared = std::get_if<Prepared>(&outcome);
    if (!prepared) return false;
    return std::any_of(prepared->warnings.begin(), prepared->warnings.end(),
                       [&](const std::string& warning) { return warning.find(words) != std::string::npos; });
  };
  EXPECT_TRUE(warned({{"controller",
                       {{"type", "linear_switching_function"},
                        {"rate_gain_s", 1},
                        {"evaluation", {{"type", "continuous"}}}}},
                      {"actuator", {{"switching_delay_s", 1}}}},
                     "grows without bound"));
  EXPECT_TRUE(warned({{"controller", {{"deadband", {{"type", "single_sided"}, {"width_deg", 30}}}}}},
                     "nothing fires"));
  EXPECT_TRUE(warned({{"disturbances", {{{"type", "fraction_of_thrust"}, {"fraction", 1}}}}}, "cannot hold"));
  EXPECT_TRUE(warned({{"disturbances", {{{"type", "friction"}, {"torque_N_m", 0.5}}}}}, "cannot start"));
  EXPECT_TRUE(
      warned({{"plant",
               {{"type", "flexible_axis"},
                {"modes", {{{"frequency_hz", 1}, {"damping_ratio", -0.01}, {"coupling_sqrt_kg_m", 0.1}}}}}}},
             "negative damping"));
}

}  // namespace
}  // namespace slew
