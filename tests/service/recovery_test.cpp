// `accepted` survives kill -9 (server/doc/recovery.md).
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <map>
#include <random>

#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";

json request(int i, bool paced) {
  json body = {{"preset", kPreset}, {"label", std::to_string(i)}};
  body["controller"]["gamma"] = 1.05 + 0.05 * (i % 5);
  // Long enough that a kill finds some of them unfinished.
  body["simulation"]["duration_s"] = 200;
  body["stop"]["when"] = i % 2 ? "first_rest" : "duration";
  if (paced) body["timing"] = {{"mode", "real_time"}, {"after_restart", i % 4 ? "interrupted" : "run_again"}};
  if (paced && i % 4 == 0) body["stop"]["when"] = "first_rest";
  return body;
}

std::string digest_of(const json& result) {
  return result.at("provenance").at("digest").at("xxh3_128");
}

TEST(Recovery, EveryAcceptedRequestHasItsOneAnswerAfterTwentyKills) {
  ServerUnderTest server;
  std::mt19937_64 random(42);
  std::map<std::string, json> accepted;  // request_id -> request
  int number = 0;
  for (int kill = 0; kill < 20; ++kill) {
    {
      const auto session = server.session();
      const int count = 1 + static_cast<int>(random() % 6);
      for (int i = 0; i < count; ++i) {
        const json body = request(number, number % 5 == 4);
        ++number;
        const auto id = wire::Id::make();
        const auto reply = session->submit(body.dump(), id, std::chrono::seconds(10));
        if (reply && reply->phase != slew_v1_REJECTED) accepted[id.hex()] = body;
      }
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 20000));
      server.kill();
    }
    server.start();
  }
  EXPECT_EQ(accepted.size(), static_cast<std::size_t>(number));

  int interrupted = 0;
  std::map<std::string, std::string> digests;
  for (const auto& [id, body] : accepted) {
    SCOPED_TRACE(body.dump());
    json shown;
    for (int i = 0; i < 600; ++i) {
      shown = server.document({"show", id});
      if (shown.at("ended_unix_ns") != 0) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    const json result = server.document({"result", id});
    EXPECT_EQ(result.at("request_id"), id);
    const bool is_paced = body.contains("timing");
    if (result.at("phase") == "interrupted") {
      EXPECT_TRUE(is_paced);
      EXPECT_EQ(body.at("timing").at("after_restart"), "interrupted");
      ++interrupted;
      continue;
    }
    EXPECT_EQ(result.at("phase"), "completed");
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
  EXPECT_EQ(server.document({"history", "--limit", "1"}).at("total"), accepted.size());
  EXPECT_GT(interrupted, 0);
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
