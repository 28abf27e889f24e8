#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "server/experiment/experiment.hpp"
#include "server/experiment/preset.hpp"
#include "server/experiment/schema.hpp"
#include "tests/unit/prepared.hpp"

namespace slew {
namespace {

using nlohmann::json;
using test::prepared;

constexpr double kDegPerRad = 180 / std::numbers::pi;

class Ignore final : public SampleSink {
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

std::unique_ptr<Run> flown(std::unique_ptr<Run> run) {
  Ignore ignore;
  while (run->advance(std::numeric_limits<double>::infinity(), 1 << 20, ignore) == RunStatus::running) {
  }
  return run;
}

json result(const Prepared& p, bool verify = false) {
  const auto run = flown(make_run(p));
  std::optional<Verification> verification;
  if (verify) verification = compare(run->report(), flown(make_verification(p))->report());
  return result_document({"e", "r", "completed", std::nullopt, {}}, p, run.get(), verification);
}

void expect_fits(const json& document) {
  for (const Violation& violation : schema_violations("result", document))
    ADD_FAILURE() << violation.pointer << ": " << violation.problem << " " << violation.given;
}

TEST(Result, FitsItsSchemaForEveryPreset) {
  for (const Preset& preset : presets()) {
    SCOPED_TRACE(preset.name);
    expect_fits(result(prepared({{"preset", preset.name}})));
  }
}

// Every optional part at once.
TEST(Result, FitsItsSchemaWhenFull) {
  const Prepared p =
      prepared({{"preset", "agrawal-bang-1995/rigid-single-sided-minimum-on-time"},
                {"actuator", {{"lever_arm_m", 2}, {"specific_impulse_s", 60}, {"gas_density_kg_m3", 1.2}}},
                {"simulation", {{"verify", true}}},
                {"outputs", {{"at_s", {0, 0.5, 1}}}}});
  const json document = result(p, true);
  expect_fits(document);
  const json& metrics = document.at("metrics");
  const double impulse = metrics.at("angular_impulse_N_m_s");
  EXPECT_DOUBLE_EQ(metrics.at("propellant_kg"), impulse / (2 * 60 * 9.80665));
  EXPECT_DOUBLE_EQ(metrics.at("gas_volume_m3"), impulse / (2 * 60 * 9.80665) / 1.2);
  EXPECT_DOUBLE_EQ(metrics.at("control_effort_N2_s"),
                   metrics.at("control_effort_N2_m2_s").get<double>() / (2 * 2));
  EXPECT_TRUE(document.at("verification").at("same_event_sequence"));
}

// A run that never began, and one that failed.
TEST(Result, FitsItsSchemaWithoutARun) {
  const Prepared p = prepared({{"preset", "agrawal-bang-1995/rigid-single-sided"}});
  const json expired =
      result_document({"e", "r", "expired", std::nullopt, {"too late"}}, p, nullptr, std::nullopt);
  expect_fits(expired);
  EXPECT_TRUE(expired.at("metrics").is_null());
  EXPECT_EQ(expired.at("warnings"), json::array({"too late"}));
  const auto run = make_run(p);
  const json failed =
      result_document({"e", "r", "failed", RunFailure{"diverged", "the state grew beyond all bounds"}, {}}, p,
                      run.get(), std::nullopt);
  expect_fits(failed);
  EXPECT_EQ(failed.at("failure").at("code"), "diverged");
}

// The schema names what the document has, and nothing less: a field that is dropped, renamed or added shows.
TEST(Result, SchemaCatchesAMissingAndAnAddedMetric) {
  json document = result(prepared({{"preset", "agrawal-bang-1995/rigid-single-sided"}}));
  json missing = document, added = document, wrong = document;
  missing["metrics"].erase("coast_s");
  added["metrics"]["coast_min"] = 1;
  wrong["metrics"]["firings"]["total"] = "two";
  EXPECT_EQ(schema_violations("result", missing).size(), 1u);
  EXPECT_EQ(schema_violations("result", added).size(), 1u);
  EXPECT_EQ(schema_violations("result", wrong).size(), 1u);
}

TEST(Result, AnglesAreInDegreesAndStatesInRadians) {
  const Prepared p = prepared({{"preset", "agrawal-bang-1995/rigid-double-sided"}});
  const json document = result(p);
  const json& metrics = document.at("metrics");
  const double error_rad = metrics.at("final_state").at("error_rad");
  EXPECT_NEAR(error_rad, 0.1, 0.002);
  EXPECT_DOUBLE_EQ(metrics.at("final_error_deg"), error_rad * kDegPerRad);
}

TEST(Result, OutputsAreAtExactlyTheTimesAskedFor) {
  const json document = result(prepared({{"preset", "agrawal-bang-1995/rigid-single-sided"},
                                         {"outputs", {{"at_s", {0.7071067811865476, 0.1}}}}}));
  const json& outputs = document.at("outputs");
  ASSERT_EQ(outputs.at("rows").size(), 2u);
  EXPECT_EQ(outputs.at("channels").at(0), "t_s");
  EXPECT_EQ(outputs.at("channels").at(1), "angle_rad");
  EXPECT_EQ(outputs.at("rows").at(0).size(), outputs.at("channels").size());
  EXPECT_EQ(outputs.at("rows").at(0).at(0), 0.1);
  EXPECT_EQ(outputs.at("rows").at(1).at(0), 0.7071067811865476);
  // Full acceleration of 1 rad/s^2 until then: theta = t^2 / 2.
  EXPECT_NEAR(outputs.at("rows").at(0).at(1).get<double>(), 0.005, 1e-15);
  EXPECT_NEAR(outputs.at("rows").at(1).at(1).get<double>(), 0.25, 1e-14);
}

TEST(Result, EventsAreCappedAndCounted) {
  const json document = result(prepared({{"preset", "agrawal-bang-1995/rigid-classical-gamma-0-9"}}));
  const json& events = document.at("events");
  EXPECT_GT(events.at("total").get<std::size_t>(), kReportedEvents);
  EXPECT_EQ(events.at("reported"), kReportedEvents);
  EXPECT_EQ(events.at("list").size(), kReportedEvents);
}

TEST(Result, SaysWhatItsBitsDependOn) {
  const Prepared p = prepared(
      {{"preset", "agrawal-bang-1995/rigid-single-sided"}, {"simulation", {{"seed", 9007199254740991}}}});
  const json provenance = result(p).at("provenance");
  EXPECT_EQ(provenance.at("request"), json::parse(p.resolved));
  EXPECT_EQ(provenance.at("seed"), 9007199254740991);
  EXPECT_EQ(provenance.at("platform"), platform());
  EXPECT_NE(platform().find("glibc"), std::string::npos);
  EXPECT_EQ(provenance.at("digest").at("xxh3_128").get<std::string>().size(), 32u);
  // Through text and back, every double is the same double.
  const json document = result(p);
  EXPECT_EQ(json::parse(document.dump()), document);
}

}  // namespace
}  // namespace slew
