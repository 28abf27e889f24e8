// Requests for flexible structures: what is made of them, and why some are refused.
#include "server/experiment/structure_request.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "server/experiment/derived_structures.hpp"
#include "server/experiment/experiment.hpp"
#include "tests/unit/prepared.hpp"

namespace slew {
namespace {

using nlohmann::json;
using test::prepared;

const std::string kTracking = "sung-lee-kim-2001/tracking-control-a";
const std::string kOpen = "sung-lee-kim-2001/open-loop";

class Ignore final : public SampleSink {
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

json resolved(const std::string& preset) {
  json request = json::parse(prepared({{"preset", preset}}).resolved);
  request.erase("preset");
  return request;
}

/// Pointer and problem of every violation.
std::vector<std::pair<std::string, std::string>> reasons(const json& request) {
  const auto outcome = prepare(request.dump());
  std::vector<std::pair<std::string, std::string>> all;
  if (const auto* rejection = std::get_if<Rejection>(&outcome))
    for (const Violation& violation : rejection->violations)
      all.emplace_back(violation.pointer, violation.problem);
  return all;
}

void expect_reason(const json& request, const std::string& pointer, const std::string& words) {
  bool is_there = false;
  std::string all;
  for (const auto& [place, problem] : reasons(request)) {
    is_there = is_there || (place == pointer && problem.find(words) != std::string::npos);
    all += place + ": " + problem + "\n";
  }
  EXPECT_TRUE(is_there) << pointer << ": " << words << " is not among\n" << all;
}

TEST(StructureRequest, BadFramesAreRefusedWithASentence) {
  json request = resolved(kTracking);
  request["plant"]["nodes"].push_back({{"position_m", {5, 5, 5}}});
  expect_reason(request, "/plant/nodes/14", "no member connects");

  request = resolved(kTracking);
  request["plant"]["nodes"][7]["position_m"] = request["plant"]["nodes"][6]["position_m"];
  expect_reason(request, "/plant/beams/6/to_node", "at one place");

  request = resolved(kTracking);
  request["plant"]["sections"]["mast"]["mass_per_length_kg_m"] = 0;
  expect_reason(request, "/plant/sections/mast/mass_per_length_kg_m", "no mass");

  request = resolved(kTracking);
  request["plant"]["nodes"][0]["held"] = json::array();
  expect_reason(request, "/plant/nodes", "nothing of the structure is held");

  request = resolved(kTracking);
  request["plant"]["beams"][6]["released_at_to"] = {"rx", "ry", "rz"};
  expect_reason(request, "/plant/nodes", "mechanism");

  request = resolved(kTracking);
  request["plant"]["axis"] = {0, 0, 0};
  expect_reason(request, "/plant/axis", "no direction");

  request = resolved(kTracking);
  request["plant"]["antenna_node"] = 40;
  expect_reason(request, "/plant/antenna_node", "no such node");
}

TEST(StructureRequest, VectorsThatDoNotExistAreRefused) {
  json request = resolved(kTracking);
  json& shifts = request["plant"]["coordinates"]["shifts_rad_s"];
  shifts = {5.63878989, 10};
  const json model_of = model(prepared({{"preset", kTracking}}));
  shifts[0] = model_of.at("/plant/free_frequencies_rad_s/2"_json_pointer);
  expect_reason(request, "/plant/coordinates", "natural frequency");
  shifts = json::array();
  for (int i = 0; i < 40; ++i) shifts.push_back(10 + i);
  expect_reason(request, "/plant/coordinates", "more than the 78 degrees of freedom");

  request = resolved(kTracking);
  request["controller"]["design"] = {{"type", "clamped_modes"}, {"count", 200}};
  expect_reason(request, "/controller/design", "only 78 modes");
  request["controller"]["design"] = {{"type", "clamped_modes"}, {"count", 1}};
  expect_reason(request, "/controller/tracking/modes", "only 1 modes");
  request["controller"]["design"] = {{"type", "all_modes"}};
  expect_reason(request, "/estimator", "too fast, or too many");
}

TEST(StructureRequest, DesignsThatDoNotExistAreRefused) {
  json request = resolved(kTracking);
  // The hub cannot be pushed: nothing makes its displacement stable.
  request["actuator"]["groups"].erase(0);
  expect_reason(request, "/actuator/groups", "no stabilising solution");
  request = resolved(kTracking);
  request["actuator"]["groups"].push_back({{"name", "again"}, {"node", 0}, {"motions", {"ux"}}});
  expect_reason(request, "/actuator/groups", "depend on each other");

  // Out of its plane a plane structure's motion is not seen in the plane.
  request = resolved(kTracking);
  request["plant"]["nodes"] = {{{"position_m", {0, 0, 0}}, {"held", {"all"}}}, {{"position_m", {0, 0, 2}}}};
  request["plant"]["beams"] = {{{"from_node", 0}, {"to_node", 1}, {"section", "mast"}}};
  request["plant"]["antenna_node"] = 1;
  request["plant"]["coordinates"] = {{"type", "clamped_modes"}, {"count", 4}};
  request["plant"]["elements_per_member"] = 4;
  request["actuator"]["groups"][2]["node"] = 1;
  request["sensors"]["groups"] = {{{"node", 1}, {"motions", {"ux"}}}};
  expect_reason(request, "/sensors/groups", "do not see mode");
}

TEST(StructureRequest, WhatDoesNotFitIsRefusedEitherWay) {
  json request = resolved(kTracking);
  request["estimator"] = {{"type", "none"}};
  expect_reason(request, "/estimator/type", "needs the elastic states");
  request = resolved(kOpen);
  request["estimator"] = {{"type", "kalman_filter"}};
  expect_reason(request, "/estimator/type", "loop is open");
  request = resolved(kTracking);
  request["metrics"]["settling"]["tolerance"] = {{"type", "fraction_of_initial"}, {"value", 0.1}};
  expect_reason(request, "/metrics/settling/tolerance/type", "a fraction of that is nothing");
  request = resolved(kTracking);
  request["actuator"]["groups"][0]["motions"] = {"ux", "rx"};
  expect_reason(request, "/actuator/groups/0/motions", "not the same unit");
  request = resolved(kTracking);
  request["guidance"] = {{"type", "none"}};
  expect_reason(request, "/guidance/type", "command of a guidance");
  request = resolved(kTracking);
  request["maneuver"]["initial_rate_deg_s"] = 1;
  expect_reason(request, "/maneuver/initial_rate_deg_s", "begins at rest");
  request = resolved(kTracking);
  request["controller"] = resolved("agrawal-bang-1995/rigid-single-sided")["controller"];
  expect_reason(request, "/controller/type", "does not say what actuators");

  json rigid = resolved("agrawal-bang-1995/rigid-single-sided");
  rigid["controller"] = {{"type", "open_loop"}};
  expect_reason(rigid, "/controller/type", "for a flexible structure");
  rigid = resolved("kim-crassidis-1998/case-a-sliding-mode");
  rigid["guidance"] = {{"type", "sine_squared_pulses"}, {"torque_N_m", 1}, {"pulse_rad_s", 1}};
  expect_reason(rigid, "/guidance/type", "flown by flexible structures only");
}

TEST(StructureRequest, APulseThatOverlapsIsFlownWithAWord) {
  const Prepared made = prepared({{"preset", kOpen}, {"maneuver", {{"final_angle_deg", 3}}}});
  ASSERT_EQ(made.warnings.size(), 1u);
  EXPECT_NE(made.warnings[0].find("no coast"), std::string::npos);
}

// Slews from anywhere to anywhere. The other way round what is centrifugal keeps its sign.
TEST(StructureRequest, TheInitialAngleIsNoMatter) {
  const auto pointing = [](double from_deg, double to_deg) {
    const auto run =
        make_run(prepared({{"preset", kOpen},
                           {"maneuver", {{"initial_angle_deg", from_deg}, {"final_angle_deg", to_deg}}},
                           {"simulation", {{"duration_s", 1}}}}));
    Ignore ignore;
    while (run->advance(std::numeric_limits<double>::infinity(), 1 << 20, ignore) == RunStatus::running) {
    }
    return run->report().metrics;
  };
  const Metrics forward = pointing(0, 30), shifted = pointing(10, 40), back = pointing(30, 0);
  EXPECT_NEAR(shifted.structure->relative.peak_rad[0], forward.structure->relative.peak_rad[0], 1e-12);
  EXPECT_NEAR(back.structure->relative.peak_rad[0], forward.structure->relative.peak_rad[0], 1e-4);
  EXPECT_NE(back.structure->relative.peak_rad[0], forward.structure->relative.peak_rad[0]);
  EXPECT_NEAR(shifted.final_state[0] - forward.final_state[0], 10 * std::numbers::pi / 180, 1e-12);
}

TEST(StructureRequest, WhatIsDerivedIsKept) {
  prepared({{"preset", kTracking}, {"simulation", {{"duration_s", 3.25}}}});
  const std::size_t before = structures_derived();
  const Prepared other = prepared({{"preset", kTracking},
                                   {"maneuver", {{"final_angle_deg", 20}}},
                                   {"simulation", {{"duration_s", 3.25}, {"seed", 4}}}});
  EXPECT_EQ(structures_derived(), before);
  EXPECT_NEAR(std::get<StructureSpecification>(other.system).system->command.at(100).angle_rad,
              20 * std::numbers::pi / 180, 1e-12);
  prepared({{"preset", kTracking},
            {"controller", {{"reaching_gain_1_s", 21}}},
            {"simulation", {{"duration_s", 3.25}}}});
  EXPECT_EQ(structures_derived(), before + 1);
}

TEST(StructureRequest, ModelTellsReductionsApart) {
  const json document = model(prepared(
      {{"preset", kTracking},
       {"plant",
        {{"coordinates",
          {{"type", "clamped_modes"}, {"count", 6}, {"shifts_rad_s", nullptr}, {"loads", nullptr}}}}},
       {"controller",
        {{"design",
          {{"type", "krylov_vectors"},
           {"shifts_rad_s", {55, 10, 10}},
           {"loads", {{{"node", 7}, {"motions", {"ux", "uy"}}}}}}}}},
       {"outputs", {{"responses_at_rad_s", {10, 17, 25, 42}}}}}));
  const json& at = document.at("responses").at("at");
  // The reference: Krylov vectors 2.8, 3.5, 10 % off at 17, 25 and 42 rad/s, six clamped modes 0.15, 0.8, 2.9
  // %.
  const double krylov[] = {4e-7, 0.028, 0.035, 0.10}, clamped[] = {0.003, 0.0015, 0.008, 0.029};
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_NEAR(at[i].at("design_error_damped").get<double>(), krylov[i], 0.07 * krylov[i]) << i;
    EXPECT_NEAR(at[i].at("plant_error_damped").get<double>(), clamped[i], 0.07 * clamped[i]) << i;
  }
  EXPECT_LT(at[0].at("design_error").get<double>(), 1e-6);
  EXPECT_NEAR(document.at("frequency_errors").at("design").at(4).get<double>(), 0.29, 0.01);
}

TEST(StructureRequest, DescribesAndDraws) {
  for (const char* preset :
       {"sung-lee-kim-2001/rigid-body", "benchmark/free-free-beam", "benchmark/four-bay-truss"}) {
    const Prepared made = prepared({{"preset", preset}});
    const json document = describe(made);
    EXPECT_GT(document.at("plant").at("mass_kg").get<double>(), 0);
    EXPECT_EQ(design_curves(made).at("type"), "structure");
    EXPECT_EQ(design_curves(made).at("curve").size(), 201u);
  }
}

}  // namespace
}  // namespace slew
