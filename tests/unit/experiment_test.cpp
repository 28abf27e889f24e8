#include "server/experiment/experiment.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "server/experiment/preset.hpp"
#include "tests/unit/prepared.hpp"

namespace slew {
namespace {

using nlohmann::json;
using test::prepared;

constexpr const char* kPreset = "agrawal-bang-1995/rigid-single-sided";

json with_preset(json changes = json::object()) {
  changes["preset"] = kPreset;
  return changes;
}

OnOffAxisSpecification on_off(const Prepared& prepared) {
  return std::get<OnOffAxisSpecification>(prepared.system);
}

Rejection rejected(const std::string& text) {
  auto outcome = prepare(text);
  if (auto* rejection = std::get_if<Rejection>(&outcome)) return std::move(*rejection);
  ADD_FAILURE() << "accepted: " << text.substr(0, 200);
  return {};
}

Rejection rejected(const json& request) {
  return rejected(request.dump());
}

std::vector<std::string> pointers(const Rejection& rejection) {
  std::vector<std::string> found;
  for (const Violation& violation : rejection.violations) found.push_back(violation.pointer);
  return found;
}

using Pointers = std::vector<std::string>;

TEST(Prepare, APresetAndChangesInIt) {
  const Prepared p = prepared(with_preset({{"plant", {{"inertia_kg_m2", 2}}},
                                           {"timing", {{"mode", "scaled"}, {"rate", 10}, {"start", "held"}}},
                                           {"label", "mine"}}));
  EXPECT_EQ(p.preset, kPreset);
  EXPECT_EQ(p.label, "mine");
  EXPECT_EQ(on_off(p).plant.inertia_kg_m2, 2);
  EXPECT_EQ(on_off(p).law.deadband, Deadband::single_sided);
  EXPECT_EQ(on_off(p).stop, StopCondition::first_rest);
  EXPECT_EQ(p.timing.mode, TimingMode::scaled);
  EXPECT_EQ(p.timing.rate, 10);
  EXPECT_EQ(p.timing.start, TimingStart::held);
  EXPECT_EQ(p.telemetry.publish_max_hz, 50);
  EXPECT_FALSE(p.verify);
}

// What the server keeps is complete: flown again it is the same, preset or no preset.
TEST(Prepare, TheResolvedRequestIsCompleteByItself) {
  for (const Preset& preset : presets()) {
    SCOPED_TRACE(preset.name);
    const Prepared p = prepared({{"preset", preset.name}});
    json alone = json::parse(p.resolved);
    EXPECT_EQ(prepared(alone).resolved, p.resolved);
    alone.erase("preset");
    const Prepared again = prepared(alone);
    alone = json::parse(again.resolved);
    alone["preset"] = preset.name;
    EXPECT_EQ(alone, json::parse(p.resolved));
    EXPECT_EQ(again.system.index(), p.system.index());
    if (std::holds_alternative<OnOffAxisSpecification>(p.system)) {
      EXPECT_EQ(on_off(again).law.deadband_rad, on_off(p).law.deadband_rad);
    }
  }
}

TEST(Prepare, NullRemovesWhatThePresetBrought) {
  const Prepared p = prepared({{"preset", "agrawal-bang-1995/rigid-single-sided-minimum-on-time"},
                               {"controller", {{"end_box", nullptr}}},
                               {"stop", {{"when", "duration"}}}});
  EXPECT_FALSE(on_off(p).law.end_box);
}

TEST(Prepare, OneRadianInDegreesIsOneRadian) {
  const Prepared p = prepared({{"preset", "agrawal-bang-1995/rigid-single-sided-wide-deadband"}});
  EXPECT_EQ(on_off(p).maneuver.final_angle_rad, 1);
  EXPECT_EQ(on_off(p).law.deadband_rad, on_off(p).maneuver.final_angle_rad);
}

// gamma of the paper, and beliefs in numbers, are the same law (Agrawal & Bang 1995, Eq. 7).
TEST(Prepare, TheModelErrorIsAFactorOrABelief) {
  EXPECT_DOUBLE_EQ(error_factor(on_off(prepared(with_preset()))), 1.1);
  const Prepared belief = prepared(with_preset(
      {{"plant", {{"inertia_kg_m2", 10}}},
       {"controller", {{"gamma", 1}, {"inertia_kg_m2", 9}, {"torque_N_m", 2}, {"gamma_bar", 1.5}}},
       {"actuator", {{"torque_N_m", 4}}}}));
  EXPECT_DOUBLE_EQ(on_off(belief).law.inertia_kg_m2, 9);
  EXPECT_DOUBLE_EQ(error_factor(on_off(belief)), 1.5 * (9.0 / 2) / (10.0 / 4));
}

TEST(Prepare, DisturbancesAddUpAndOutputTimesAreSorted) {
  const Prepared p = prepared(with_preset(
      {{"disturbances",
        {{{"type", "constant"}, {"torque_N_m", 0.25}}, {{"type", "constant"}, {"torque_N_m", -0.125}}}},
       {"outputs", {{"at_s", {3, 1, 2}}}}}));
  EXPECT_EQ(on_off(p).disturbances.constant_N_m, 0.125);
  EXPECT_EQ(on_off(p).output_times_s, (std::vector<double>{1, 2, 3}));
}

TEST(Prepare, WhatIsLegalAndYetWorthAWord) {
  EXPECT_TRUE(prepared(with_preset()).warnings.empty());
  EXPECT_EQ(prepared(with_preset({{"controller", {{"deadband", {{"width_deg", 60}}}}}})).warnings.size(), 1u);
  EXPECT_EQ(prepared(with_preset({{"controller", {{"gamma", 0.9}}}})).warnings.size(), 1u);
  EXPECT_EQ(
      prepared(with_preset({{"disturbances", {{{"type", "constant"}, {"torque_N_m", -1}}}}})).warnings.size(),
      1u);
}

// ---- what is refused

TEST(Refusal, NothingThatIsNotARequest) {
  const std::string valid = with_preset().dump();
  std::string invalid_utf8 = valid;
  invalid_utf8.insert(2, "\xff");
  for (const std::string& text :
       {std::string(), std::string("{"), std::string("[]"), std::string("null"), valid + valid, invalid_utf8,
        valid + std::string(1, '\0'), std::string(10000, '[') + std::string(10000, ']'),
        "{\"label\":\"" + std::string(2 << 20, 'x') + "\"}",
        std::string(R"({"preset":"agrawal-bang-1995/rigid-single-sided","plant":{"inertia_kg_m2":NaN}})"),
        std::string(R"({"preset":"agrawal-bang-1995/rigid-single-sided","plant":{"inertia_kg_m2":1e999}})"),
        std::string(R"({"preset":"agrawal-bang-1995/rigid-single-sided","plant":{},"plant":{}})")}) {
    const Rejection rejection = rejected(text);
    EXPECT_EQ(rejection.code, "invalid");
    EXPECT_EQ(rejection.violations.size(), 1u) << text.substr(0, 200);
    EXPECT_LT(rejection.sentence.size(), 1000u);
  }
}

TEST(Refusal, OneWrongThing) {
  const auto one = [](const char* pointer, const json& value) {
    json request = with_preset();
    request[json::json_pointer(pointer)] = value;
    const Rejection rejection = rejected(request);
    EXPECT_EQ(pointers(rejection), Pointers{pointer}) << value;
    if (rejection.violations.empty()) return;
    EXPECT_FALSE(rejection.violations[0].allowed.empty());
    EXPECT_FALSE(rejection.violations[0].problem.empty());
    EXPECT_NE(rejection.sentence.find(pointer), std::string::npos);
  };
  one("/plant/inertia_kg_m2", 0);
  one("/plant/inertia_kg_m2", -1);
  one("/plant/inertia_kg_m2", "1");
  one("/plant/inertia_kg_m2", 1e300);
  one("/plant", 5);
  one("/plant", json::array());
  one("/actuator/torque_N_m", 0);
  one("/actuator/minimum_on_time_s", -0.01);
  one("/maneuver/final_angle_deg", true);
  one("/maneuver/final_angle_deg", 1e7);
  one("/controller/evaluation/period_s", 1e-9);
  one("/controller/evaluation/period_s", 0);
  one("/controller/gamma_bar", -1);
  one("/simulation/duration_s", 1e9);
  one("/simulation/duration_s", 0);
  one("/simulation/duration_s", -1);
  one("/simulation/seed", 1.5);
  one("/simulation/seed", -1);
  one("/telemetry/sample_period_s", 1e-9);
  one("/telemetry/publish_max_hz", -1);
  one("/timing/mode", "yesterday");
  one("/timing/start", 0);
  one("/outputs/at_s", json::array({1, 2, 1e9}).dump());
  one("/outputs/at_s", std::vector<double>(1001, 1));
  one("/disturbances", json::object());
  one("/label", std::string(81, 'x'));
  one("/stop/when", "bored");
  one("/preset", "../../etc/passwd");
  one("/preset", 7);
  one("/sensors/type", "gyro");
  one("/surprise", 1);
}

TEST(Refusal, PhysicsInTheSameForm) {
  const auto refused = [](const json& changes, const Pointers& expected) {
    EXPECT_EQ(pointers(rejected(with_preset(changes))), expected) << changes;
  };
  // Continuous evaluation without anything that regularises it.
  refused({{"controller", {{"evaluation", {{"type", "continuous"}, {"period_s", nullptr}}}}}},
          {"/actuator/minimum_on_time_s"});
  refused({{"stop", {{"when", "end_box"}}}}, {"/stop/when"});
  refused({{"actuator", {{"specific_impulse_s", 60}}}}, {"/actuator/lever_arm_m"});
  refused({{"actuator", {{"lever_arm_m", 1}, {"gas_density_kg_m3", 1}}}}, {"/actuator/specific_impulse_s"});
  refused({{"timing", {{"mode", "scaled"}}}}, {"/timing/rate"});
  refused({{"timing", {{"rate", 2}}}}, {"/timing/rate"});
  refused({{"timing", {{"mode", "scaled"}, {"rate", 1001}}}}, {"/timing/rate"});
  refused({{"outputs", {{"at_s", {1, 5, 5.5}}}}}, {"/outputs/at_s/2"});
  // Each legal, together too much: 1e9 controller samples, 1e9 telemetry samples.
  refused({{"simulation", {{"duration_s", 1e6}}}, {"telemetry", {{"sample_period_s", 10}}}},
          {"/controller/evaluation/period_s"});
  refused({{"telemetry", {{"sample_period_s", 1e-6}}}}, {"/telemetry/sample_period_s"});
}

TEST(Refusal, ContinuousSaysWhatRegularises) {
  const Rejection rejection = rejected(
      with_preset({{"controller", {{"evaluation", {{"type", "continuous"}, {"period_s", nullptr}}}}}}));
  ASSERT_EQ(rejection.violations.size(), 1u);
  EXPECT_NE(rejection.violations[0].allowed.find("a minimum on-time"), std::string::npos);
  EXPECT_NE(rejection.violations[0].allowed.find("\"sampled\""), std::string::npos);
}

TEST(Refusal, EverythingAtOnce) {
  const Rejection rejection =
      rejected(with_preset({{"manoeuvre", 1},
                            {"bogus", {{"a", 1}}},
                            {"plant", {{"inertia_kg_m2", -1}, {"mass_kg", 3}}},
                            {"controller", {{"deadband", {{"type", "triple"}}}}},
                            {"simulation", {{"duration_s", 1e9}, {"seed", "x"}}},
                            {"disturbances", {{{"type", "constant"}}, {{"type", "wind"}}}},
                            {"timing", {{"mode", "scaled"}}},
                            {"stop", {{"when", "end_box"}}}}));
  EXPECT_EQ(pointers(rejection),
            (Pointers{"/bogus", "/controller/deadband/type", "/disturbances/0/torque_N_m",
                      "/disturbances/1/type", "/manoeuvre", "/plant/inertia_kg_m2", "/plant/mass_kg",
                      "/simulation/duration_s", "/simulation/seed", "/stop/when", "/timing/rate"}));
  EXPECT_NE(rejection.sentence.find("11 reasons"), std::string::npos);
}

TEST(Refusal, AnUnknownPresetHidesNothingElse) {
  const Rejection rejection =
      rejected(json({{"preset", "agrawal-bang-1995/rigid-single-side"}, {"manuever", 1}}));
  ASSERT_EQ(pointers(rejection), (Pointers{"/preset", "/manuever"}));
  EXPECT_NE(rejection.violations[0].problem.find(kPreset), std::string::npos);
  EXPECT_NE(rejection.violations[1].problem.find("maneuver"), std::string::npos);
}

TEST(Refusal, WhatCameFromThePresetIsSaidSo) {
  const Rejection rejection = rejected(with_preset({{"controller", {{"deadband", {{"type", "none"}}}}}}));
  ASSERT_EQ(pointers(rejection), Pointers{"/controller/deadband/width_deg"});
  EXPECT_NE(rejection.violations[0].problem.find("comes from the preset"), std::string::npos);
}

// However much is wrong, the answer stays small.
TEST(Refusal, IsBounded) {
  json many = with_preset(), deep = with_preset();
  for (int i = 0; i < 50000; ++i) many["k" + std::to_string(i)] = json::object();
  for (int i = 0; i < 1000; ++i) deep["disturbances"].push_back({{"type", "wind"}});
  for (const json& request : {many, deep, with_preset({{std::string(1000000, 'k'), 1}}),
                              json({{"preset", std::string(1000000, 'p')}})}) {
    const Rejection rejection = rejected(request);
    EXPECT_FALSE(rejection.violations.empty());
    EXPECT_LE(rejection.violations.size(), 100u);
    EXPECT_LE(rejection.sentence.size(), 2000u);
    std::size_t bytes = 0;
    for (const Violation& violation : rejection.violations) bytes += to_json(violation).dump().size();
    EXPECT_LT(bytes, 200000u);
  }
}

}  // namespace
}  // namespace slew
