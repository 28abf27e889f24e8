// Requests that shape what is commanded (guidance.shaper), what describe and result say of them, and which
// are refused.
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "server/experiment/planning.hpp"
#include "server/experiment/preset.hpp"
#include "server/experiment/schema.hpp"
#include "tests/unit/attitude_requests.hpp"
#include "tests/unit/single_axis_cases.hpp"

namespace slew {
namespace {

using nlohmann::json;
using test::prepared;
using test::refused_at;
using Pointers = std::vector<std::string>;

constexpr const char* kPulses = "benchmark/pulses-zero-vibration";
constexpr const char* kStep = "benchmark/step-zero-vibration";
constexpr const char* kControls = "benchmark/controls-zero-vibration";

json with(const char* preset, json changes = json::object()) {
  changes["preset"] = preset;
  return changes;
}

json with_shaper(const char* preset, json shaper) {
  json request = with(preset, {{"guidance", {{"shaper", std::move(shaper)}}}});
  if (!preset_document(preset)->at("request").contains("guidance")) request["guidance"]["type"] = "none";
  return request;
}

std::vector<Violation> violations(const json& request) {
  const auto outcome = prepare(request.dump());
  if (const auto* rejection = std::get_if<Rejection>(&outcome)) return rejection->violations;
  return {};
}

json result_of(const json& request) {
  const Prepared made = prepared(request);
  const auto run = make_run(made);
  test::Recorder recorder;
  while (run->advance(std::numeric_limits<double>::infinity(), 1 << 20, recorder) == RunStatus::running) {
  }
  return result_document({"", "", "completed", std::nullopt, {}}, made, run.get(), std::nullopt);
}

TEST(ShaperRequest, BecomesImpulses) {
  const auto pulses = std::get<OnOffAxisSpecification>(prepared(with(kPulses)).system);
  EXPECT_EQ(pulses.shaper.type, ShaperType::zero_vibration);
  EXPECT_EQ(pulses.shaper.modes, (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(pulses.impulses.size(), 4u);
  const json shaper = {{"type", "zero_vibration_derivative"},
                       {"modes", json::array()},
                       {"known_modes", {{{"frequency_hz", 0.25}, {"damping_ratio", 0.1}}}}};
  const auto step = std::get<LinearAxisSpecification>(prepared(with_shaper(kStep, shaper)).system);
  EXPECT_EQ(step.shaper.type, ShaperType::zero_vibration_and_derivative);
  ASSERT_EQ(step.impulses.size(), 3u);
  EXPECT_NEAR(step.impulses[1].time_s, 2 / std::sqrt(1 - 0.01), 1e-14);
  // The first mode, where nothing is said of modes.
  const auto first = std::get<OnOffAxisSpecification>(
      prepared(with("benchmark/pulses-unshaped", {{"guidance", {{"shaper", {{"type", "zero_vibration"}}}}}}))
          .system);
  EXPECT_EQ(first.shaper.modes, std::vector<std::size_t>{0});
  const auto none = std::get<OnOffAxisSpecification>(prepared(with("benchmark/pulses-unshaped")).system);
  EXPECT_TRUE(none.impulses.empty());
}

// A frame's modes are its plant's too; a rigid axis has those of its loop.
TEST(ShaperRequest, FitsFramesAndRigidLoops) {
  const json frame =
      with("agrawal-bang-1995/flexible-frame-elbow-heavy",
           {{"controller",
             {{"type", "firing_program"}, {"firings", {{{"from_s", 0}, {"to_s", 5}, {"direction", 1}}}}}},
            {"guidance", {{"type", "none"}, {"shaper", {{"type", "zero_vibration"}, {"modes", {1}}}}}},
            {"actuator", {{"type", "proportional"}, {"torque_N_m", 0.3}}}});
  json cleaned = frame;
  for (const char* field : {"gamma", "gamma_bar", "deadband", "end_box", "evaluation", "hysteresis_deg"})
    cleaned["controller"][field] = nullptr;
  cleaned["stop"]["when"] = "duration";
  const auto spec = std::get<OnOffAxisSpecification>(prepared(cleaned).system);
  EXPECT_EQ(spec.impulses.size(), 2u);
  const json loop = with_shaper("bryson-1994/proportional-attitude-rate", {{"type", "zero_vibration"}});
  const auto rigid = std::get<LinearAxisSpecification>(prepared(loop).system);
  ASSERT_EQ(rigid.impulses.size(), 2u);
  // Poles at -1 +- j: half a damped period is pi.
  EXPECT_NEAR(rigid.impulses[1].time_s, std::numbers::pi, 1e-12);
}

TEST(ShaperRequest, DescribeShowsModesAndImpulses) {
  for (const auto& [preset, type] :
       {std::pair{kPulses, "torque"}, {kStep, "angle"}, {kControls, "controls"}}) {
    const json command = describe(prepared(with(preset))).at("command");
    EXPECT_EQ(command.at("type"), type);
    EXPECT_GE(command.at("modes").size(), 2u);
    EXPECT_EQ(command.at("shaped_modes").size(), 2u);
    ASSERT_EQ(command.at("impulses").size(), 4u);
    EXPECT_NEAR(command.at("arrival_s").get<double>() - command.at("unshaped_end_s").get<double>(),
                command.at("impulses").back().at("time_s").get<double>(), 1e-12);
  }
  const json unshaped = describe(prepared(with("benchmark/step-unshaped"))).at("command");
  EXPECT_TRUE(unshaped.at("impulses").empty());
  EXPECT_EQ(unshaped.at("modes").size(), 7u);
  EXPECT_TRUE(describe(prepared(with("agrawal-bang-1995/flexible-robust"))).at("command").is_null());
  EXPECT_TRUE(describe(prepared(with("sung-lee-kim-2001/open-ideal"))).at("command").contains("impulses"));
}

TEST(ShaperRequest, TheResultTellsWhatIsLeft) {
  const auto left = [](const char* preset) {
    const json result = result_of(with(preset));
    EXPECT_TRUE(schema_violations("result", result).empty()) << preset;
    const json& from = result.at("plan").is_null() ? result.at("metrics") : result.at("plan");
    return from.at("vibration").at("modes").at(0).at("residual_deg").get<double>();
  };
  EXPECT_GT(left("benchmark/pulses-unshaped"), 0.4);
  EXPECT_LT(left(kPulses), 1e-12);
  EXPECT_GT(left("benchmark/step-unshaped"), 0.4);
  EXPECT_LT(left(kStep), 1e-12);
  EXPECT_GT(left("benchmark/controls-unshaped"), 4);
  EXPECT_LT(left(kControls), 1e-12);
  EXPECT_TRUE(
      result_of(with("agrawal-bang-1995/rigid-single-sided")).at("metrics").at("vibration").is_null());
}

// A law that follows the plan follows the shaped one, whatever its thrusters are.
TEST(ShaperRequest, WhatIsFollowedIsShapedToo) {
  json request = with(kControls, {{"maneuver", {{"reference", {{"type", "planned"}}}}},
                                  {"controller",
                                   {{"type", "sliding_mode"},
                                    {"lambda_1_s", -0.5},
                                    {"gain_rad_s2", 0.02},
                                    {"evaluation", {{"type", "continuous"}}}}}});
  const json result = result_of(request);
  EXPECT_LT(result.at("metrics").at("final_error_deg"), 0.01);
  EXPECT_NEAR(result.at("plan").at("time_s").get<double>(), 17.0194529, 1e-6);
}

TEST(ShaperRequest, TheRigidPlantHasNothingToShapeFor) {
  const json zero = {{"type", "zero_vibration"}};
  json rigid = with(kPulses, {{"plant", {{"type", "rigid_axis"}, {"modes", nullptr}}}});
  EXPECT_EQ(refused_at(rigid), Pointers{"/guidance/shaper/type"});
  EXPECT_NE(violations(rigid)[0].problem.find("rigid axis"), std::string::npos);
  EXPECT_EQ(refused_at(with(kPulses, {{"plant", {{"modes", json::array()}}}})),
            Pointers{"/guidance/shaper/type"});
  EXPECT_EQ(refused_at(with_shaper("kim-crassidis-1998/case-c-sliding-mode", zero)),
            Pointers{"/guidance/shaper/type"});
  json none = with(kControls, {{"guidance", {{"vibration", nullptr}}}});
  EXPECT_EQ(refused_at(none), Pointers{"/guidance/shaper/type"});
  // Poles of which none oscillates.
  json slow = with_shaper("bryson-1994/proportional-attitude-rate", zero);
  slow["controller"]["rate_gain_N_m_s_rad"] = 10;
  EXPECT_EQ(refused_at(slow), Pointers{"/guidance/shaper/modes/0"});
  EXPECT_NE(violations(slow)[0].problem.find("closed loop"), std::string::npos);
}

TEST(ShaperRequest, LawsAndThrustersThatDoNotGiveParts) {
  const json zero = {{"type", "zero_vibration"}};
  for (const char* preset : {"agrawal-bang-1995/flexible-robust", "agrawal-bang-1995/flexible-sliding",
                             "bryson-1994/linear-switching", "bryson-1994/problem-3-3-1-from-30deg"})
    EXPECT_EQ(refused_at(with_shaper(preset, zero)), Pointers{"/guidance/shaper/type"}) << preset;
  const json on_off = with_shaper("agrawal-bang-1995/flexible-pulse", zero);
  EXPECT_EQ(refused_at(on_off), Pointers{"/actuator/type"});
  EXPECT_NE(violations(on_off)[0].problem.find("part of a firing"), std::string::npos);
  json couples =
      with(kControls, {{"actuator",
                        {{"type", "axis_thrusters"},
                         {"maximum_torque_N_m", nullptr},
                         {"torque_N_m", {2, 2, 2}},
                         {"modulator", {{"type", "schmitt_trigger"}, {"on", 0.5}, {"off", 0.25}}}}}});
  EXPECT_EQ(refused_at(couples), Pointers{"/actuator/modulator/type"});
  json smooth = with(kControls, {{"guidance",
                                  {{"controls",
                                    {{"type", "impulses"},
                                     {"sequences", nullptr},
                                     {"switch_times_s", nullptr},
                                     {"first_peaks", {0, 0, 1}},
                                     {"last_peaks", {0, 0, -1}},
                                     {"widths", {0.1, 0.1, 0.1}}}}}}});
  EXPECT_EQ(refused_at(smooth), Pointers{"/guidance/controls/type"});
  // What is searched for has no field for it.
  EXPECT_EQ(refused_at(with_shaper("benchmark/reorientation", zero)), Pointers{"/guidance/shaper"});
}

TEST(ShaperRequest, EveryViolationAtOnce) {
  const json modes = {{"type", "zero_vibration"},
                      {"modes", {1, 9, 0}},
                      {"known_modes",
                       {{{"frequency_hz", 0}},
                        {{"frequency_hz", 1}, {"damping_ratio", 1}},
                        {{"frequency_hz", -2}, {"damping_ratio", -0.1}}}}};
  EXPECT_EQ(
      refused_at(with_shaper(kPulses, modes)),
      (Pointers{"/guidance/shaper/known_modes/0/frequency_hz", "/guidance/shaper/known_modes/1/damping_ratio",
                "/guidance/shaper/known_modes/2/damping_ratio", "/guidance/shaper/known_modes/2/frequency_hz",
                "/guidance/shaper/modes/2"}));
  for (const char* preset : {kPulses, kStep, kControls}) {
    const json unknown = {{"type", "zero_vibration"}, {"modes", {1, 9, 200}}};
    EXPECT_EQ(refused_at(with_shaper(preset, unknown)),
              (Pointers{"/guidance/shaper/modes/1", "/guidance/shaper/modes/2"}))
        << preset;
    EXPECT_EQ(violations(with_shaper(preset, unknown))[0].given, "9");
    const json nothing = {{"type", "zero_vibration"}, {"modes", json::array()}};
    EXPECT_EQ(refused_at(with_shaper(preset, nothing)), Pointers{"/guidance/shaper/modes"}) << preset;
    json many = {{"type", "zero_vibration_derivative"}, {"modes", {1, 2, 1, 2, 1, 2, 1}}};
    EXPECT_EQ(refused_at(with_shaper(preset, many)), Pointers{"/guidance/shaper"}) << preset;
  }
  json growing = with(
      kPulses,
      {{"plant", {{"modes", {{{"frequency_hz", 0.2}, {"damping_ratio", -0.01}, {"coupling_sqrt_kg_m", 1}}}}}},
       {"guidance", {{"shaper", {{"modes", {1}}}}}}});
  EXPECT_EQ(refused_at(growing), Pointers{"/guidance/shaper/modes/0"});
}

// Every impulse is one more copy of the command.
TEST(ShaperRequest, NotMorePiecesThanThereMayBe) {
  EXPECT_EQ(schema_document("limits").at("properties").at("max_shaper_impulses").at("const"), kMostImpulses);
  json firings = json::array();
  for (int i = 0; i < 501; ++i) firings.push_back({{"from_s", i}, {"to_s", i + 0.5}, {"direction", 1}});
  json program = with(kPulses, {{"controller", {{"firings", firings}}}});
  EXPECT_EQ(refused_at(program), Pointers{"/guidance/shaper"});
  program["controller"]["firings"].erase(500);
  EXPECT_EQ(refused_at(program), Pointers{});
  // Two signs by 3^5 impulses.
  const json five = {{"type", "zero_vibration_derivative"}, {"modes", {1, 2, 1, 2, 1}}};
  EXPECT_EQ(refused_at(with_shaper(kControls, five)), Pointers{"/guidance/shaper"});
  EXPECT_EQ(refused_at(with_shaper(kStep, five)), Pointers{});
}

// Proportional thrusters have a full torque where a program fires them, and nowhere else.
TEST(ShaperRequest, TheTorqueOfProportionalThrusters) {
  EXPECT_EQ(refused_at(with(kPulses, {{"actuator", {{"torque_N_m", nullptr}}}})),
            Pointers{"/actuator/torque_N_m"});
  EXPECT_EQ(refused_at(with(kStep, {{"actuator", {{"torque_N_m", 1}}}})), Pointers{"/actuator/torque_N_m"});
}

TEST(ShaperRequest, WhatIsLegalAndWorthAWord) {
  const auto warnings = [](const json& request) { return prepared(request).warnings; };
  EXPECT_TRUE(warnings(with(kPulses)).empty());
  EXPECT_EQ(warnings(with(kPulses, {{"simulation", {{"duration_s", 15}}}})).size(), 1u);
  EXPECT_EQ(warnings(with(kStep, {{"simulation", {{"duration_s", 10}}}})).size(), 1u);
  EXPECT_EQ(warnings(with(kStep, {{"maneuver", {{"initial_rate_deg_s", 1}}}})).size(), 1u);
  const auto elsewhere =
      warnings(with(kControls, {{"maneuver", {{"initial_attitude", {{"axis", {0, 0.2, 1}}}}}}}));
  ASSERT_EQ(elsewhere.size(), 1u);
  EXPECT_NE(elsewhere[0].find("principal axis"), std::string::npos);
}

TEST(ShaperRequest, NeedsNoTypeOfGuidance) {
  const json shaper = {{"type", "zero_vibration"}, {"modes", {1}}};
  const auto brief = prepared(with("benchmark/step-unshaped", {{"guidance", {{"shaper", shaper}}}}));
  const auto whole =
      prepared(with("benchmark/step-unshaped", {{"guidance", {{"type", "none"}, {"shaper", shaper}}}}));
  EXPECT_EQ(brief.resolved, whole.resolved);
}

// Controls are flown while the request is taken in, and others wait for the same intake.
TEST(ShaperRequest, ControlsThatSpinTheBodyUpAreRefused) {
  const auto found = violations(with("benchmark/controls-unshaped", {{"guidance", {{"time_s", 10000}}}}));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].pointer, "/guidance");
  EXPECT_NE(found[0].problem.find("deg/s"), std::string::npos) << found[0].problem;
}

}  // namespace
}  // namespace slew
