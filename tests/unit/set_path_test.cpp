// --set plant.modes.0.frequency_hz=0.139
#include "client/slewctl/set_path.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace {

using nlohmann::json;
using slew::ctl::set_path;

json after(const std::string& assignment, json document = json::object(), const json& base = json::object()) {
  set_path(document, base, assignment);
  return document;
}

TEST(SetPath, MakesObjectsOnTheWay) {
  EXPECT_EQ(after("a.b.c=1.5"), json::parse(R"({"a":{"b":{"c":1.5}}})"));
}

TEST(SetPath, TakesJsonOrText) {
  EXPECT_EQ(after("a=real_time"), json({{"a", "real_time"}}));
  EXPECT_EQ(after("a=\"real_time\""), json({{"a", "real_time"}}));
  EXPECT_EQ(after("a=[1,2]"), json::parse(R"({"a":[1,2]})"));
  EXPECT_EQ(after("a=null"), json({{"a", nullptr}}));
  EXPECT_EQ(after("a=b=c"), json({{"a", "b=c"}}));
  EXPECT_EQ(after("a="), json({{"a", ""}}));
}

TEST(SetPath, CountsIntoArraysOfThePreset) {
  const json base = json::parse(R"({"plant":{"modes":[{"f":1,"z":2},{"f":3}]}})");
  const json changed = after("plant.modes.0.f=9", json::object(), base);
  // A merge patch replaces arrays whole, so the rest of it must be there.
  EXPECT_EQ(changed, json::parse(R"({"plant":{"modes":[{"f":9,"z":2},{"f":3}]}})"));
  EXPECT_EQ(after("plant.modes.2.f=4", changed, base).at("plant").at("modes").size(), 3u);
}

TEST(SetPath, SaysWhatIsWrong) {
  EXPECT_THROW(after("no_equals"), std::invalid_argument);
  EXPECT_THROW(after("=1"), std::invalid_argument);
  EXPECT_THROW(after("a..b=1"), std::invalid_argument);
  EXPECT_THROW(after("a.x=1", json::parse(R"({"a":[1]})")), std::invalid_argument);
  EXPECT_THROW(after("a.5=1", json::parse(R"({"a":[1]})")), std::invalid_argument);
}

}  // namespace
