// Whatever is done to a valid request, it is either flown or refused with reasons that point somewhere.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "server/experiment/experiment.hpp"
#include "server/experiment/preset.hpp"
#include "server/experiment/schema.hpp"

namespace slew {
namespace {

using nlohmann::json;

class Ignore final : public SampleSink {
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

const std::vector<std::string>& valid_requests() {
  static const auto all = [] {
    std::vector<std::string> texts;
    for (const Preset& preset : presets()) {
      auto outcome = prepare(json({{"preset", preset.name}}).dump());
      json resolved = json::parse(std::get<Prepared>(outcome).resolved);
      texts.push_back(resolved.dump());
      resolved.erase("preset");
      texts.push_back(resolved.dump(1));
      texts.push_back(json({{"preset", preset.name}}).dump());
    }
    return texts;
  }();
  return all;
}

// A prepared request makes sense to everything that comes after; a refused one says why.
void expect_an_answer(const std::string& text) {
  const auto outcome = prepare(text);
  if (const auto* prepared = std::get_if<Prepared>(&outcome)) {
    EXPECT_TRUE(schema_violations("request", json::parse(prepared->resolved)).empty());
    EXPECT_FALSE(describe(*prepared).dump().empty());
    const auto run = make_run(*prepared);
    Ignore ignore;
    run->advance(prepared->duration_s, 200, ignore);
    const json result =
        result_document({"e", "r", "cancelled", std::nullopt, {}}, *prepared, run.get(), std::nullopt);
    EXPECT_TRUE(schema_violations("result", result).empty()) << text;
    return;
  }
  const auto& rejection = std::get<Rejection>(outcome);
  EXPECT_FALSE(rejection.violations.empty());
  EXPECT_FALSE(rejection.sentence.empty());
  EXPECT_LT(rejection.sentence.size(), 2000u);
  for (const Violation& violation : rejection.violations) {
    EXPECT_FALSE(violation.problem.empty());
    EXPECT_LE(violation.given.size(), 200u);
    EXPECT_TRUE(violation.pointer.empty() || violation.pointer.front() == '/') << violation.pointer;
    // Goes over the wire as JSON.
    EXPECT_NO_THROW(to_json(violation).dump());
  }
}

TEST(RequestMutation, OfBytes) {
  std::mt19937 random(11);
  for (int i = 0; i < 4000; ++i) {
    std::string text = valid_requests()[random() % valid_requests().size()];
    for (auto n = 1 + random() % 4; n > 0; --n) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random() % 256);
          break;
        case 1:
          text.erase(at, 1 + random() % 10);
          if (text.empty()) text = "{";
          break;
        case 2:
          text.insert(at, text.substr(random() % text.size(), random() % 20));
          break;
        default:
          text.insert(at, 1, "{}[]\",:0-e."[random() % 11]);
      }
    }
    SCOPED_TRACE(text);
    expect_an_answer(text);
  }
}

// All places in a document.
void collect(const json& value, const json::json_pointer& at, std::vector<json::json_pointer>& places) {
  if (!at.empty()) places.push_back(at);
  if (value.is_object())
    for (const auto& [name, child] : value.items()) collect(child, at / name, places);
  if (value.is_array())
    for (std::size_t i = 0; i < value.size(); ++i) collect(value[i], at / i, places);
}

TEST(RequestMutation, OfValues) {
  const std::vector<json> strange = {nullptr,
                                     true,
                                     0,
                                     -1,
                                     1e-300,
                                     -0.0,
                                     1e300,
                                     4.9e-324,
                                     1e6,
                                     9007199254740993,
                                     18446744073709551615u,
                                     "",
                                     "sampled",
                                     "continuous",
                                     "end_box",
                                     "x",
                                     json::array(),
                                     json::object(),
                                     json::array({1, 2}),
                                     1e-6,
                                     0.5,
                                     1000,
                                     json::object({{"type", "none"}}),
                                     json::object({{"type", 1}})};
  std::mt19937 random(12);
  for (int i = 0; i < 6000; ++i) {
    json request = json::parse(valid_requests()[random() % valid_requests().size()]);
    for (auto n = 1 + random() % 3; n > 0; --n) {
      std::vector<json::json_pointer> places;
      collect(request, json::json_pointer(), places);
      if (places.empty()) break;
      const json::json_pointer& place = places[random() % places.size()];
      json& parent = request.at(place.parent_pointer());
      if (random() % 5 == 0 && parent.is_object()) {
        const json value = parent.at(place.back());
        parent.erase(place.back());
        if (random() % 2) parent[place.back() + "_"] = value;
      } else {
        request.at(place) = strange[random() % strange.size()];
      }
    }
    SCOPED_TRACE(request.dump());
    expect_an_answer(request.dump());
  }
}

}  // namespace
}  // namespace slew
