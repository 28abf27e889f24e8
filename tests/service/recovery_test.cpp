// `accepted` survives kill -9 (server/doc/recovery.md).
#include <gtest/gtest.h>
#include <signal.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <random>

#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";

// How many times the server is killed: 20, or as many as SLEW_KILLS says.
int kills_wanted() {
  const char* kills = std::getenv("SLEW_KILLS");
  return kills ? std::atoi(kills) : 20;
}

json request(int i, std::mt19937_64& random) {
  static const std::array presets{"agrawal-bang-1995/rigid-single-sided", "agrawal-bang-1995/rigid-sliding",
                                  "kim-crassidis-1998/case-c-sliding-mode"};
  json body = {{"preset", presets[random() % presets.size()]}, {"label", std::to_string(i)}};
  body["simulation"]["seed"] = random() % 3;
  // Some of them long enough that a kill finds them unfinished.
  if (body["preset"] == kPreset) {
    body["controller"]["gamma"] = 1.05 + 0.05 * static_cast<double>(random() % 5);
    body["simulation"]["duration_s"] = 200;
    body["stop"]["when"] = random() % 2 ? "first_rest" : "duration";
  }
  if (random() % 5 == 0) {
    const bool again = random() % 4 == 0;
    body["timing"] = {{"mode", "real_time"}, {"after_restart", again ? "run_again" : "interrupted"}};
    if (again) {
      body["preset"] = kPreset;
      body["stop"]["when"] = "first_rest";
    }
  }
  return body;
}

std::string digest_of(const json& result) {
  return result.at("provenance").at("digest").at("xxh3_128");
}

// What has been promised, and the text it was promised for.
using Promises = std::map<std::string, json>;

// Up to five requests; what is promised is noted at once, so that a kill finds it noted.
void submit_some(const ServerUnderTest& server, std::mt19937_64& random, int& number, Promises& promises) {
  const auto session = server.session();
  for (auto count = 1 + random() % 5; count > 0; --count) {
    const json body = request(number++, random);
    const auto id = wire::Id::make();
    const auto reply = session->submit(body.dump(), id, std::chrono::seconds(20));
    ASSERT_TRUE(reply);
    ASSERT_TRUE(reply->phase != slew_v1_REJECTED || reply->code == "busy") << reply->json;
    if (reply->phase != slew_v1_REJECTED) promises[id.hex()] = body;
  }
}

// A promise made by an earlier server: the same text is the same request, another text a conflict.
void ask_again(const ServerUnderTest& server, std::mt19937_64& random, const Promises& promises) {
  if (promises.empty()) return;
  const auto& [id, body] = *std::next(promises.begin(), static_cast<long>(random() % promises.size()));
  const auto session = server.session();
  const auto same = session->submit(body.dump(2), *wire::Id::parse(id), std::chrono::seconds(20));
  ASSERT_TRUE(same);
  EXPECT_NE(same->phase, slew_v1_REJECTED) << same->json;
  session->forget(*wire::Id::parse(id));
  json other = body;
  other["label"] = "another";
  const auto refused = session->submit(other.dump(), *wire::Id::parse(id), std::chrono::seconds(20));
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, "conflict") << refused->json;
}

json ended(const ServerUnderTest& server, const std::string& id) {
  json shown;
  for (int i = 0; i < 3000; ++i) {
    shown = server.document({"show", id});
    if (shown.at("ended_unix_ns") != 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return shown;
}

TEST(Recovery, EveryAcceptedRequestHasItsOneEndAfterKillsAtRandomMoments) {
  ServerUnderTest server;
  std::mt19937_64 random(42);
  Promises promises;
  int number = 0;
  for (int kill = 0; kill < kills_wanted(); ++kill) {
    ASSERT_NO_FATAL_FAILURE(submit_some(server, random, number, promises));
    if (random() % 4 == 0) {
      ASSERT_NO_FATAL_FAILURE(ask_again(server, random, promises));
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 50000));
    server.kill();
    // Now and then it is killed while it takes up what the last one left.
    if (random() % 4 == 0) {
      Process early(server.command(), server.state() / "log");
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 200000));
    }
    server.start();
  }

  int interrupted = 0;
  std::map<std::string, std::string> digests;
  for (const auto& [id, body] : promises) {
    SCOPED_TRACE(body.dump());
    ended(server, id);
    const json result = server.document({"result", id});
    EXPECT_EQ(result.at("request_id"), id);
    const bool is_paced = body.contains("timing");
    if (result.at("phase") == "interrupted") {
      EXPECT_TRUE(is_paced);
      EXPECT_EQ(body.at("timing").at("after_restart"), "interrupted");
      ++interrupted;
      continue;
    }
    EXPECT_EQ(result.at("phase"), "completed") << result.at("failure");
    // Flown once or five times: the same bits.
    json key = body;
    key.erase("label");
    key.erase("timing");
    const auto [place, is_new] = digests.emplace(key.dump(), digest_of(result));
    EXPECT_EQ(place->second, digest_of(result));
    if (!is_paced) {
      EXPECT_EQ(server.ctl({"series", id, "--max-samples", "2"}).exit_code, 0);
    }
  }
  EXPECT_EQ(server.document({"history", "--limit", "1"}).at("total"), promises.size());
  EXPECT_GT(interrupted, 0);
  std::cout << kills_wanted() << " kills, " << promises.size() << " promises kept, " << interrupted
            << " of them interrupted\n";
}

void expect_paced_ends_as_asked(ServerUnderTest& server, const std::function<void()>& end_the_server) {
  std::map<std::string, std::string> ids;
  for (const char* after : {"interrupted", "run_again"})
    ids[after] = server
                     .document({"submit", "--preset", kPreset, "--set", "timing.mode=real_time", "--set",
                                std::string("timing.after_restart=") + after})
                     .at("experiment_id");
  for (const auto& [after, id] : ids)
    for (int i = 0; i < 500 && server.document({"show", id}).at("phase") != "running"; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  end_the_server();
  server.start();
  EXPECT_EQ(ended(server, ids["interrupted"]).at("phase"), "interrupted");
  EXPECT_EQ(server.ctl({"run", "--preset", kPreset}).exit_code, 0);
  EXPECT_EQ(ended(server, ids["run_again"]).at("phase"), "completed");
  EXPECT_EQ(digest_of(server.document({"result", ids["run_again"]})),
            digest_of(server.document({"run", "--preset", kPreset})));
}

TEST(Recovery, APacedRunSaysInterruptedOrRunsAgainAsItsRequestAsks) {
  ServerUnderTest server({"--drain", "0.1"});
  {
    SCOPED_TRACE("killed");
    expect_paced_ends_as_asked(server, [&] { server.kill(); });
  }
  SCOPED_TRACE("stopped");
  expect_paced_ends_as_asked(server, [&] { EXPECT_EQ(server.stop(), 0); });
}

// One that always takes the server down must not take it down for ever.
TEST(Recovery, WhatTookTheServerDownFiveTimesIsNotFlownAgain) {
  ServerUnderTest server({"--workers", "1"});
  // In a slice of a second and more, so that a kill finds it there.
  const std::string id = server
                             .document({"submit", "--preset", kPreset, "--set",
                                        "simulation.ballast_operations_per_step=10000000", "--set",
                                        "simulation.duration_s=10000", "--set", "stop.when=duration", "--set",
                                        "telemetry.sample_period_s=10"})
                             .at("experiment_id");
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(server.document({"show", id}).at("ended_unix_ns"), 0) << i;
    for (int k = 0; k < 500 && server.document({"show", id}).at("phase") != "running"; ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    server.kill();
    server.start();
  }
  const json shown = ended(server, id);
  EXPECT_EQ(shown.at("phase"), "failed");
  EXPECT_EQ(server.document({"result", id}).at("failure").at("code"), "took_the_server_down");
  EXPECT_EQ(server.ctl({"run", "--preset", kPreset}).exit_code, 0);
}

TEST(Recovery, ADrainEndsWhatItCanAndInterruptsWhatIsPaced) {
  ServerUnderTest server({"--drain", "0.5"});
  const std::string paced =
      server
          .document({"submit", "--preset", kPreset, "--set", "timing.mode=real_time", "--set",
                     "simulation.duration_s=100", "--set", "stop.when=duration"})
          .at("experiment_id");
  const std::string held = server
                               .document({"submit", "--preset", kPreset, "--set", "timing.mode=real_time",
                                          "--set", "timing.start=held"})
                               .at("experiment_id");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_EQ(server.stop(), 0);
  server.start();
  EXPECT_EQ(server.document({"result", paced}).at("phase"), "interrupted");
  EXPECT_GT(server.document({"show", paced}).at("t_sim_s").get<double>(), 0.1);
  EXPECT_EQ(server.document({"result", held}).at("phase"), "interrupted");
}

TEST(Recovery, WhoeverWaitsOutlivesTheServer) {
  ServerUnderTest server;
  // Long enough to be killed, short enough to be flown again.
  Process waiting(
      server.ctl_command({"run", "--preset", kPreset, "--json", "--set", "simulation.duration_s=9000",
                          "--set", "stop.when=duration", "--set", "telemetry.sample_period_s=1"}),
      server.state() / "waiting");
  for (int i = 0; i < 200 && server.document({"list"}).at("total") == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  server.kill();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  server.start();
  EXPECT_EQ(waiting.wait(std::chrono::seconds(60)), 0);
}

TEST(Recovery, OneServerPerStateDirectory) {
  const ServerUnderTest server;
  const auto second =
      run({SLEWD, "--domain", std::to_string(server.domain()), "--state-dir", server.state().string()});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.errors.find("another server uses"), std::string::npos);
}

TEST(Recovery, AJournalThatIsNotOneIsLeftAlone) {
  ServerUnderTest server;
  server.stop();
  const auto journal = server.state() / "journal.sqlite";
  std::filesystem::remove(server.state() / "journal.sqlite-wal");
  std::filesystem::remove(server.state() / "journal.sqlite-shm");
  const std::string text(8192, 'x');
  std::ofstream(journal, std::ios::trunc) << text;
  const auto refused =
      run({SLEWD, "--domain", std::to_string(server.domain()), "--state-dir", server.state().string()});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.errors.find("journal"), std::string::npos);
  std::ostringstream after;
  after << std::ifstream(journal).rdbuf();
  EXPECT_EQ(after.str(), text);
}

}  // namespace
