// When a request begins, and what becomes of one that does not.
#include <gtest/gtest.h>

#include <chrono>
#include <ctime>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";

std::int64_t unix_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

// In the form of requests, to the millisecond.
std::string utc(std::int64_t at_unix_ns) {
  const std::time_t seconds = at_unix_ns / 1'000'000'000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[64];
  std::strftime(text, sizeof text, "%FT%T", &parts);
  const auto milliseconds = std::to_string(1000 + at_unix_ns / 1'000'000 % 1000).substr(1);
  return std::string(text) + "." + milliseconds + "Z";
}

std::string submit(const ServerUnderTest& server, const std::vector<std::string>& settings) {
  std::vector<std::string> arguments{"submit", "--preset", kPreset};
  for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
  const json submitted = server.document(arguments);
  return submitted.is_object() ? submitted.at("experiment_id").get<std::string>() : "";
}

// What `show` says once the experiment is in one of these phases.
json await(const ServerUnderTest& server, const std::string& id, const std::vector<std::string>& phases) {
  json shown;
  for (int i = 0; i < 400; ++i) {
    shown = server.document({"show", id});
    for (const std::string& phase : phases)
      if (shown.at("phase") == phase) return shown;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  ADD_FAILURE() << id << " stays " << shown.at("phase");
  return shown;
}

TEST(Timing, BeginsAtTheWallTimeAndNotBefore) {
  const ServerUnderTest server;
  for (const char* mode : {"as_fast_as_possible", "real_time"}) {
    SCOPED_TRACE(mode);
    const std::int64_t start = (unix_ns() / 1'000'000 + 1500) * 1'000'000;
    const std::string id =
        submit(server, {std::string("timing.mode=") + mode, "timing.start=\"" + utc(start) + "\""});
    if (unix_ns() < start - 500'000'000) {
      EXPECT_EQ(await(server, id, {"held", "running"}).at("phase"), "held");
    }
    const json shown = await(server, id, {"completed"});
    EXPECT_GE(shown.at("started_unix_ns").get<std::int64_t>(), start);
  }
}

TEST(Timing, AHeldOneMayBeBegunEarly) {
  const ServerUnderTest server;
  const std::string id = submit(server, {"timing.start=\"" + utc(unix_ns() + 600'000'000'000) + "\""});
  await(server, id, {"held"});
  EXPECT_EQ(server.ctl({"resume", id}).exit_code, 0);
  await(server, id, {"completed"});
}

TEST(Timing, ATimeThatHasPassedIsRefused) {
  const ServerUnderTest server;
  const Finished late =
      server.ctl({"submit", "--preset", kPreset, "--set", "timing.start=\"2020-02-29T00:00:00Z\""});
  EXPECT_EQ(late.exit_code, 2);
  EXPECT_NE(late.errors.find("/timing/start"), std::string::npos) << late.errors;
  for (const char* nonsense :
       {"tomorrow", "2027-02-29T00:00:00Z", "2027-02-28T00:00:00+01:00", "2027-02-28"}) {
    const Finished refused = server.ctl(
        {"submit", "--preset", kPreset, "--set", std::string("timing.start=\"") + nonsense + "\""});
    EXPECT_EQ(refused.exit_code, 2) << nonsense;
    EXPECT_NE(refused.errors.find("/timing/start"), std::string::npos) << refused.errors;
  }
}

TEST(Timing, ExpiresUnlessItHasBegun) {
  const ServerUnderTest server;
  const std::string held = submit(server, {"timing.start=held", "timing.expires_s=0.3"});
  const std::string begun =
      submit(server, {"timing.mode=real_time", "timing.expires_s=0.3", "simulation.duration_s=1.5"});
  const Finished waited =
      server.ctl({"run", "--preset", kPreset, "--set", "timing.start=held", "--set", "timing.expires_s=0.2"});
  EXPECT_EQ(waited.exit_code, 4);
  EXPECT_EQ(await(server, held, {"expired", "completed"}).at("phase"), "expired");
  EXPECT_EQ(await(server, begun, {"expired", "completed"}).at("phase"), "completed");
  EXPECT_EQ(server.document({"result", held}).at("phase"), "expired");
}

// Behind many others of the same client: called off, it does not wait for its turn.
TEST(Timing, WhatWaitsInTheQueueIsCalledOffAtOnce) {
  const ServerUnderTest server({"--workers", "1"});
  const std::vector<std::string> dear{"simulation.ballast_operations_per_step=1000000"};
  std::vector<std::string> ids;
  for (int i = 0; i < 10; ++i) ids.push_back(submit(server, dear));
  const std::string last = submit(server, dear);
  EXPECT_EQ(server.ctl({"cancel", last}).exit_code, 0);
  const json shown = await(server, last, {"cancelled"});
  EXPECT_EQ(shown.at("started_unix_ns"), 0);
  EXPECT_NE(server.document({"show", ids.front()}).at("phase"), "completed");
  for (const std::string& id : ids) EXPECT_EQ(server.ctl({"cancel", id}).exit_code, 0);
}

}  // namespace
