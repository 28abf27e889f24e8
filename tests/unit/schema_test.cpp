#include "server/experiment/schema.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "server/experiment/limits.hpp"
#include "server/propagation/gain_schedule.hpp"
#include "server/simulation/run.hpp"

namespace slew {
namespace {

using nlohmann::json;

json rigid_request() {
  return json::parse(R"({
    "plant": {"type": "rigid_axis", "inertia_kg_m2": 13},
    "maneuver": {"type": "single_axis", "final_angle_deg": 50},
    "controller": {"type": "switching_function", "evaluation": {"type": "sampled", "period_s": 0.01}},
    "actuator": {"type": "on_off_pair", "torque_N_m": 0.3},
    "simulation": {"duration_s": 20}})");
}

std::vector<std::string> pointers(const std::vector<Violation>& violations) {
  std::vector<std::string> found;
  for (const Violation& violation : violations) found.push_back(violation.pointer);
  return found;
}

using Pointers = std::vector<std::string>;

TEST(Schema, AllAreThere) {
  EXPECT_EQ(schema_names(), (Pointers{"limits", "query", "reply", "request", "result"}));
  EXPECT_THROW(schema_document("nothing"), std::out_of_range);
}

TEST(Schema, AFittingRequestHasNoViolations) {
  EXPECT_EQ(pointers(schema_violations("request", rigid_request())), Pointers{});
}

TEST(Schema, EveryUnknownFieldIsNamedWithTheNearestKnownOne) {
  json request = rigid_request();
  request["manoeuvre"] = 1;
  request["plant"]["inertia_kg_m"] = 1;
  request["plant"]["mass_kg"] = 1;
  request["controller"]["evaluation"]["perod_s"] = 1;
  const auto violations = schema_violations("request", request);
  ASSERT_EQ(pointers(violations), (Pointers{"/controller/evaluation/perod_s", "/manoeuvre",
                                            "/plant/inertia_kg_m", "/plant/mass_kg"}));
  EXPECT_NE(violations[0].problem.find("did you mean \"period_s\""), std::string::npos);
  EXPECT_NE(violations[1].problem.find("did you mean \"maneuver\""), std::string::npos);
  EXPECT_NE(violations[2].problem.find("did you mean \"inertia_kg_m2\""), std::string::npos);
  EXPECT_EQ(violations[3].problem.find("did you mean"), std::string::npos);
  EXPECT_EQ(violations[3].allowed, "one of \"type\", \"inertia_kg_m2\"");
}

TEST(Schema, OnlyTheChosenBranchSpeaks) {
  json request = rigid_request();
  request["controller"]["deadband"] = {{"type", "single_sided"}, {"width_deg", -1}};
  request["metrics"]["settling"]["tolerance"] = {{"type", "fraction_of_initial"}, {"value_deg", 0.01}};
  EXPECT_EQ(pointers(schema_violations("request", request)),
            (Pointers{"/controller/deadband/width_deg", "/metrics/settling/tolerance/value",
                      "/metrics/settling/tolerance/value_deg"}));
}

TEST(Schema, AnUnknownTypeListsThoseThereAre) {
  json request = rigid_request();
  request["controller"]["deadband"] = {{"type", "triple_sided"}, {"width_deg", 1}};
  const auto violations = schema_violations("request", request);
  ASSERT_EQ(pointers(violations), Pointers{"/controller/deadband/type"});
  EXPECT_EQ(violations[0].given, "\"triple_sided\"");
  EXPECT_EQ(violations[0].allowed, "one of \"none\", \"double_sided\", \"single_sided\"");
}

TEST(Schema, SaysWhatIsAllowed) {
  json request = rigid_request();
  request["simulation"] = {{"duration_s", 1e9}, {"seed", "one"}, {"verify", 1}};
  request.erase("plant");
  const auto violations = schema_violations("request", request);
  ASSERT_EQ(pointers(violations),
            (Pointers{"/plant", "/simulation/duration_s", "/simulation/seed", "/simulation/verify"}));
  EXPECT_EQ(violations[0].problem, "a required field is missing");
  EXPECT_EQ(violations[1].given, "1000000000.0");
  EXPECT_EQ(violations[1].allowed, "a number, greater than 0, at most 1000000");
  EXPECT_EQ(violations[2].allowed, "an integer, at least 0, at most 9007199254740991");
  EXPECT_EQ(violations[3].allowed, "a boolean");
}

TEST(Schema, DefaultsAreFilledInDepthAndByBranch) {
  json request = rigid_request();
  request["controller"]["deadband"] = {{"type", "single_sided"}, {"width_deg", 2}};
  fill_defaults("request", request);
  EXPECT_EQ(request.at("/timing/mode"_json_pointer), "as_fast_as_possible");
  EXPECT_EQ(request.at("/metrics/settling/tolerance/value"_json_pointer), 0.01);
  EXPECT_EQ(request.at("/controller/gamma_bar"_json_pointer), 1);
  EXPECT_EQ(request.at("/controller/deadband/width_deg"_json_pointer), 2);
  EXPECT_EQ(request.at("/maneuver/initial_angle_deg"_json_pointer), 0);
  EXPECT_EQ(request.at("/telemetry/publish_max_hz"_json_pointer), 50);
  EXPECT_FALSE(request.at("timing").contains("rate"));
  EXPECT_EQ(pointers(schema_violations("request", request)), Pointers{});
  const json once = request;
  fill_defaults("request", request);
  EXPECT_EQ(request, once);
}

// Calls with every schema of a named field, and the way to it.
void for_each_field(const json& schema, const std::string& path,
                    const std::function<void(const std::string&, const json&)>& visit) {
  if (schema.is_array())
    for (const json& part : schema) for_each_field(part, path, visit);
  if (!schema.is_object()) return;
  for (const auto& [keyword, value] : schema.items()) {
    if (keyword == "if") continue;
    if (keyword != "properties") {
      for_each_field(value, path, visit);
      continue;
    }
    for (const auto& [name, field] : value.items()) {
      visit(path + "/" + name, field);
      for_each_field(field, path + "/" + name, visit);
    }
  }
}

TEST(Schema, EveryFieldOfARequestIsDescribed) {
  int fields = 0;
  for_each_field(schema_document("request"), "", [&](const std::string& path, const json& field) {
    ++fields;
    // A branch names `type` again without saying more of it.
    EXPECT_TRUE(field.empty() || field.contains("description")) << path;
  });
  EXPECT_GT(fields, 40);
  for (const auto& [name, definition] : schema_document("limits").at("definitions").items())
    EXPECT_TRUE(definition.contains("description")) << name;
  for (const auto& [name, limit] : schema_document("limits").at("properties").items())
    EXPECT_TRUE(limit.contains("description") && limit.contains("const")) << name;
}

TEST(Schema, EveryDefaultFitsItsOwnField) {
  for_each_field(schema_document("request"), "", [](const std::string& path, const json& field) {
    if (!field.contains("default") || !field.at("default").is_number()) return;
    const double value = field.at("default");
    std::vector<json> bounds{field};
    for (const json& part : field.value("allOf", json::array())) {
      const std::string reference = part.at("$ref");
      bounds.push_back(
          schema_document("limits").at(json::json_pointer(reference.substr(reference.find('#') + 1))));
    }
    for (const json& bound : bounds) {
      EXPECT_GE(value, bound.value("minimum", value)) << path;
      EXPECT_LE(value, bound.value("maximum", value)) << path;
    }
  });
}

TEST(Schema, LimitsAreTheOnesTheCodeUses) {
  const json& stated = schema_document("limits").at("properties");
  EXPECT_EQ(stated.at("reported_events").at("const"), kReportedEvents);
  EXPECT_EQ(stated.at("max_request_bytes").at("const"), limits().max_request_bytes);
  EXPECT_EQ(stated.at("max_filter_work").at("const"), kMostFilterWork);
  EXPECT_EQ(limits().max_rate, 1000);
}

TEST(Schema, TheNearestName) {
  const std::vector<std::string> known{"gamma", "gamma_bar", "deadband"};
  EXPECT_EQ(nearest("gama", known), "gamma");
  EXPECT_EQ(nearest("gammabar", known), "gamma_bar");
  EXPECT_EQ(nearest("dead_band", known), "deadband");
  EXPECT_EQ(nearest("xyz", known), "");
  EXPECT_EQ(nearest(std::string(1 << 20, 'x'), known), "");
}

}  // namespace
}  // namespace slew
