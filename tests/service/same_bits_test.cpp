// The same request gives the same bits, whatever the pace, the telemetry, the number of workers or the load.
#include <gtest/gtest.h>

#include <map>

#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kSampled = "agrawal-bang-1995/rigid-single-sided";
const std::string kOnTime = "agrawal-bang-1995/rigid-single-sided-minimum-on-time";

std::string digest_of(const json& result) {
  return result.at("provenance").at("digest").at("xxh3_128");
}

// Frozen, so that every build (release, sanitizers, another compiler) is held to the same bits. The rigid
// axis needs only + - * / and sqrt, which every processor rounds alike.
const std::map<std::string, std::string> kFrozen = {{kSampled, "bed7a9397c83ef5fb88414adb6d5ee86"},
                                                    {kOnTime, "d2496abbd9eef2572cd8742badcb045d"}};

TEST(SameBits, WhateverThePaceAndTheTelemetry) {
  for (const char* workers : {"1", "8"}) {
    const ServerUnderTest server({"--workers", workers});
    for (const auto& [preset, frozen] : kFrozen)
      for (const std::vector<std::string>& how :
           {std::vector<std::string>{},
            {"timing.mode=real_time"},
            {"telemetry.sample_period_s=0.001"},
            {"telemetry.sample_period_s=1"},
            {"telemetry.publish_max_hz=0"},
            {"telemetry.publish_max_hz=200"},
            {"timing.mode=scaled", "timing.rate=7.5", "telemetry.publish_max_hz=200"},
            {"outputs.at_s=[0.5,1.25]"}}) {
        std::vector<std::string> arguments{"run", "--preset", preset};
        for (const std::string& setting : how) arguments.insert(arguments.end(), {"--set", setting});
        EXPECT_EQ(digest_of(server.document(arguments)), frozen)
            << preset << ", " << workers << " workers, " << (how.empty() ? "" : how.front());
      }
  }
}

TEST(SameBits, PauseStepAndRateLeaveNoTrace) {
  const ServerUnderTest server;
  const json submitted = server.document({"submit", "--preset", kOnTime, "--set", "timing.mode=scaled",
                                          "--set", "timing.rate=0.1", "--set", "timing.start=held"});
  const std::string id = submitted.at("experiment_id");
  const auto phase = [&] { return server.document({"show", id}).at("phase").get<std::string>(); };
  const auto await = [&](const std::string& wanted) {
    for (int i = 0; i < 200; ++i) {
      if (phase() == wanted) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  };
  EXPECT_TRUE(await("held"));
  EXPECT_EQ(server.ctl({"step", id, "0.4"}).exit_code, 0);
  EXPECT_TRUE(await("paused"));
  EXPECT_NEAR(server.document({"show", id}).at("t_sim_s").get<double>(), 0.4, 1e-9);
  EXPECT_EQ(server.ctl({"resume", id}).exit_code, 0);
  EXPECT_TRUE(await("running"));
  EXPECT_EQ(server.ctl({"rate", id, "0.05"}).exit_code, 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_EQ(server.ctl({"pause", id}).exit_code, 0);
  EXPECT_TRUE(await("paused"));
  const double paused_at = server.document({"show", id}).at("t_sim_s");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(server.document({"show", id}).at("t_sim_s"), paused_at);
  EXPECT_EQ(server.ctl({"rate", id, "20"}).exit_code, 0);
  EXPECT_EQ(server.ctl({"resume", id}).exit_code, 0);
  EXPECT_TRUE(await("completed"));
  EXPECT_EQ(digest_of(server.document({"result", id})), kFrozen.at(kOnTime));
  EXPECT_EQ(server.ctl({"rate", id, "-1"}).exit_code, 2);
}

// 100 requests from 8 client processes at once, as-fast and real time mixed.
TEST(SameBits, UnderTheLoadOfEightClients) {
  const ServerUnderTest server;
  const auto request = [](int i) {
    json body = {{"preset", i % 3 ? kSampled : kOnTime}, {"label", std::to_string(i)}};
    body["controller"]["gamma"] = 1.05 + 0.01 * (i % 10);
    if (i % 4 == 0) body["timing"]["mode"] = "real_time";
    return body;
  };
  std::map<int, std::string> alone;
  for (int i = 0; i < 60; ++i) {  // 60: every combination of the settings above comes once
    json body = request(i);
    body.erase("timing");
    alone[i] = digest_of(server.document({"run", "-"}, body.dump()));
  }
  // Eight shells' worth of clients, each submitting its share one after the other.
  std::vector<std::thread> clients;
  std::mutex mutex;
  std::map<int, json> results;
  for (int client = 0; client < 8; ++client)
    clients.emplace_back([&, client] {
      for (int i = client; i < 100; i += 8) {
        const auto finished =
            server.ctl({"run", "-", "--json", "--quiet", "--client-id", "client-" + std::to_string(client)},
                       request(i).dump());
        const std::lock_guard lock(mutex);
        EXPECT_EQ(finished.exit_code, 0) << finished.errors;
        results[i] = json::parse(finished.output, nullptr, false);
      }
    });
  for (auto& client : clients) client.join();
  ASSERT_EQ(results.size(), 100u);
  for (const auto& [i, result] : results) {
    ASSERT_TRUE(result.is_object()) << i;
    EXPECT_EQ(digest_of(result), alone.at(i % 60)) << i;
  }
  const json history = server.document({"history", "--limit", "1"});
  EXPECT_EQ(history.at("total"), 160);
}

}  // namespace
