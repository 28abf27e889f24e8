// Bad input gets a clear answer, and the server stays up.
#include <gtest/gtest.h>

#include <random>

#include "idl/wire/text.hpp"
#include "idl/wire/writer.hpp"
#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

constexpr const char* kGood = R"({"preset":"agrawal-bang-1995/rigid-single-sided"})";

std::string with(const std::string& fields) {
  return R"({"preset":"agrawal-bang-1995/rigid-single-sided",)" + fields + "}";
}

TEST(BadInput, IsRejectedWithViolationsAndTheServerStaysUp) {
  const ServerUnderTest server;
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"broken JSON", R"({"preset":)"},
      {"nothing", ""},
      {"invalid UTF-8", "{\"label\":\"\xC3\x28\"}"},
      {"duplicate keys", R"({"label":"a","label":"b"})"},
      {"not an object", "[1,2,3]"},
      {"wrong types", with(R"("plant":{"inertia_kg_m2":"one"})")},
      {"NaN", with(R"("plant":{"inertia_kg_m2":NaN})")},
      {"1e999", with(R"("plant":{"inertia_kg_m2":1e999})")},
      {"zero inertia", with(R"("plant":{"inertia_kg_m2":0})")},
      {"negative inertia", with(R"("plant":{"inertia_kg_m2":-1})")},
      {"2 MiB", with("\"label\":\"" + std::string(2 << 20, 'x') + "\"")},
      {"10,000 nested arrays", std::string(10000, '[') + std::string(10000, ']')},
      {"a path for a preset", R"({"preset":"../../etc/passwd"})"},
      {"a duration of 1e9 s", with(R"("simulation":{"duration_s":1e9})")},
      {"a sample period of 1e-9 s", with(R"("controller":{"evaluation":{"period_s":1e-9}})")},
      {"too many samples", with(R"("simulation":{"duration_s":1e6},"telemetry":{"sample_period_s":1e-6})")},
      {"continuous without a minimum on-time",
       with(R"("controller":{"evaluation":{"type":"continuous","period_s":null}})")},
      {"a field nobody knows", with(R"("plant":{"inertia_kgm2":1})")},
  };
  const auto session = server.session();
  for (const auto& [what, text] : bad) {
    SCOPED_TRACE(what);
    const auto reply = session->submit(text, wire::Id::make(), std::chrono::seconds(10));
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->phase, slew_v1_REJECTED);
    EXPECT_EQ(reply->code, "invalid");
    const json document = json::parse(reply->json);
    ASSERT_FALSE(document.at("violations").empty());
    EXPECT_FALSE(document.at("sentence").get<std::string>().empty());
    for (const json& violation : document.at("violations")) {
      EXPECT_FALSE(violation.at("problem").get<std::string>().empty());
      EXPECT_FALSE(violation.at("allowed").get<std::string>().empty());
      EXPECT_LE(violation.at("given").get<std::string>().size(), 200u);
    }
    EXPECT_EQ(server.ctl({"run", "-"}, text).exit_code, 2);
  }
  EXPECT_EQ(server.ctl({"run", "-"}, kGood).exit_code, 0);
}

TEST(BadInput, EveryViolationIsToldAtOnce) {
  const ServerUnderTest server;
  const auto finished = server.ctl(
      {"run", "-", "--json"},
      with(
          R"("plant":{"inertia_kg_m2":-1,"mass":3},"simulation":{"duration_s":1e9},"timng":{},"actuator":{"torque_N_m":"x"})"));
  EXPECT_EQ(finished.exit_code, 2);
  const json document = json::parse(finished.output);
  std::vector<std::string> pointers;
  for (const json& violation : document.at("violations")) pointers.push_back(violation.at("pointer"));
  EXPECT_EQ(pointers, (std::vector<std::string>{"/actuator/torque_N_m", "/plant/inertia_kg_m2", "/plant/mass",
                                                "/simulation/duration_s", "/timng"}));
  EXPECT_NE(finished.errors.find("did you mean \"timing\""), std::string::npos);
}

TEST(BadInput, TheSameRequestIdIsTheSameRequest) {
  const ServerUnderTest server;
  const std::string id = wire::Id::make().hex();
  const json first = json::parse(server.ctl({"submit", "-", "--json", "--request-id", id}, kGood).output);
  // Another layout of the same JSON is the same request, before and after a restart.
  const json second = json::parse(
      server.ctl({"submit", "-", "--json", "--request-id", id}, std::string("  ") + kGood + "\n").output);
  EXPECT_EQ(second.at("experiment_id"), first.at("experiment_id"));
  EXPECT_EQ(server.document({"history"}).at("total"), 1);
}

TEST(BadInput, AnotherRequestUnderTheSameIdIsAConflict) {
  const ServerUnderTest server;
  const std::string id = wire::Id::make().hex();
  EXPECT_EQ(server.ctl({"run", "-", "--request-id", id}, kGood).exit_code, 0);
  for (const std::string& other : {with(R"("label":"other")"), std::string("not even JSON")}) {
    const auto finished = server.ctl({"run", "-", "--json", "--request-id", id}, other);
    EXPECT_EQ(finished.exit_code, 2);
    EXPECT_EQ(json::parse(finished.output).at("code"), "conflict");
  }
  EXPECT_EQ(server.ctl({"run", "-", "--request-id", "xyz"}, kGood).exit_code, 2);
  EXPECT_EQ(server.document({"history"}).at("total"), 1);
}

TEST(BadInput, ARawWriterOfGarbageHarmsNobody) {
  const ServerUnderTest server;
  {
    const wire::Domain domain({server.domain(), ""});
    wire::Writer<slew_v1_Request> request(domain);
    wire::Writer<slew_v1_Control> control(domain);
    wire::Writer<slew_v1_Query> query(domain);
    while (request.matched() == 0 || control.matched() == 0 || query.matched() == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::mt19937_64 random(1);
    const auto garbage = [&](std::size_t length) {
      std::string text(length, '\0');
      for (char& c : text) c = static_cast<char>(random() % 255 + 1);
      return text;
    };
    for (int i = 0; i < 500; ++i) {
      const std::string text = garbage(random() % (i % 50 == 0 ? 300000 : 300));
      const auto id = i % 5 == 0 ? wire::Id{} : wire::Id::make();
      slew_v1_Request asked{};
      id.store(asked.request_id);
      wire::store(garbage(64), asked.client_id);
      wire::store(garbage(128), asked.sender);
      asked.json = wire::borrowed(text);
      request.write(asked);
      request.unregister(asked);
      slew_v1_Control steered{};
      id.store(steered.request_id);
      wire::Id::make().store(steered.experiment_id);
      steered.action = static_cast<slew_v1_Action>(random() % 5);
      steered.value = i % 3 ? std::numeric_limits<double>::quiet_NaN() : -1;
      control.write(steered);
      control.unregister(steered);
      slew_v1_Query queried{};
      id.store(queried.request_id);
      wire::store(i % 2 ? garbage(32) : "series", queried.kind);
      queried.json = wire::borrowed(text);
      query.write(queried);
      query.unregister(queried);
    }
  }
  const json result = server.document({"run", "-"}, kGood);
  EXPECT_EQ(result.at("phase"), "completed");
  // Told once a second.
  int malformed = 0;
  for (int i = 0; i < 30 && malformed == 0; ++i) {
    malformed = server.document({"server"}).at(0).at("malformed");
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_GT(malformed, 0);
}

}  // namespace
