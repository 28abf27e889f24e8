// Published numbers through the library. tests/papers/acceptance.json has one row for each quantity of each
// reference case: the command (arguments of slewctl), where in its document, what, how near, by whom.
#include "tests/papers/acceptance_row.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "server/experiment/planning.hpp"
#include "server/experiment/preset.hpp"

namespace slew {
namespace {

using nlohmann::json;

json table() {
  std::ifstream file(SLEW_ACCEPTANCE_TABLE);
  return json::parse(file);
}

class Ignore final : public SampleSink {
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

// "controller.gamma=0.9" as a merge patch; no array indices.
void set(json& request, const std::string& assignment) {
  const auto equals = assignment.find('=');
  std::string pointer = "/" + assignment.substr(0, equals);
  for (char& c : pointer)
    if (c == '.') c = '/';
  const std::string text = assignment.substr(equals + 1);
  json value = json::parse(text, nullptr, false);
  request[json::json_pointer(pointer)] = value.is_discarded() ? json(text) : std::move(value);
}

json request_of(const json& command) {
  json request = json::object();
  for (std::size_t i = 1; i + 1 < command.size(); i += 2) {
    if (command[i] == "--preset") request["preset"] = command[i + 1];
    if (command[i] == "--set") set(request, command[i + 1]);
  }
  return request;
}

// What slewctl would print for the command with --json.
json document_of(const json& command) {
  auto outcome = prepare(request_of(command).dump());
  if (const auto* rejection = std::get_if<Rejection>(&outcome)) return {{"refused", rejection->sentence}};
  auto& prepared = std::get<Prepared>(outcome);
  if (command[0] == "describe") return describe(prepared);
  if (command[0] == "model") return model(prepared);
  if (prepared.planning) {
    const json plan = plan_maneuver(*prepared.planning);
    if (command[0] == "plan") return plan;
    if (const auto failure = adopt_plan(prepared, plan)) return {{"refused", failure->sentence}};
  }
  const auto run = make_run(prepared);
  Ignore ignore;
  while (run->advance(std::numeric_limits<double>::infinity(), 1 << 20, ignore) == RunStatus::running) {
  }
  return result_document({"", "", "completed", std::nullopt, {}}, prepared, run.get(), std::nullopt);
}

TEST(Acceptance, EveryRowHolds) {
  std::map<std::string, json> documents;
  const json rows = table();
  ASSERT_GT(rows.size(), 50u);
  for (const json& row : rows) {
    SCOPED_TRACE(row.dump());
    const json& command = row.at("command");
    auto& document = documents[command.dump()];
    if (document.is_null()) document = document_of(command);
    test::expect_row(row, document);
  }
}

TEST(Acceptance, EveryRowIsComplete) {
  for (const json& row : table()) {
    SCOPED_TRACE(row.dump());
    EXPECT_TRUE(
        (std::set<std::string>{"run", "describe", "model", "plan"}.contains(row.at("command").at(0))));
    EXPECT_EQ(row.at("command").size() % 2, 1u);
    EXPECT_FALSE(row.at("case").get<std::string>().empty());
    EXPECT_FALSE(row.at("source").get<std::string>().empty());
    const bool has_bound = row.contains("at_least") || row.contains("at_most");
    EXPECT_TRUE(has_bound || row.value("tolerance", -1.0) >= 0);
  }
}

TEST(Acceptance, EveryPresetHasARow) {
  std::set<std::string> flown;
  for (const json& row : table()) flown.insert(request_of(row.at("command")).value("preset", ""));
  for (const Preset& preset : presets()) EXPECT_TRUE(flown.contains(preset.name)) << preset.name;
}

}  // namespace
}  // namespace slew
