// More than a server can take, all at once: a flood, readers that do not read, readers that die, twins. What
// can not be taken is refused, what was taken is done, and no number changes.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <sstream>

#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";

json digest_of(const json& result) {
  return result.at("provenance").at("digest");
}

Process client(const ServerUnderTest& server, const std::string& program, std::vector<std::string> arguments,
               const std::filesystem::path& output = {}) {
  arguments.insert(arguments.begin(), {std::string(SLEW_CLIENTS) + "/" + program, "--domain",
                                       std::to_string(server.domain()), "--json"});
  return Process(arguments, output);
}

json report(const std::filesystem::path& output) {
  std::ostringstream text;
  text << std::ifstream(output).rdbuf();
  return json::parse(text.str(), nullptr, false);
}

TEST(Overload, AFloodAmongStalledAndDyingReadersChangesNoNumberAndLosesNothing) {
  const ServerUnderTest server;
  const std::vector<std::string> paced{"run", "--preset", kPreset, "--set", "timing.mode=real_time"};
  const json alone = server.document(paced);
  std::vector<Process> readers;
  for (int i = 0; i < 3; ++i) {
    readers.push_back(client(server, "stalling_subscriber", {"--after", "0.2", "--for", "60", "--lossless"}));
    readers.push_back(client(server, "stalling_subscriber", {"--after", "0.2", "--for", "3", "--die"}));
    readers.push_back(client(server, "stalling_subscriber", {"--after", "60", "--for", "60"}));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  for (std::size_t i = 2; i < readers.size(); i += 3) readers[i].signal(SIGSTOP);
  const auto asked = server.state() / "asked";
  const int count = SLEW_IS_SANITIZED ? 300 : 1500;
  Process flood = client(
      server, "requester",
      {"--count", std::to_string(count), "--paced", "0.02", "--preset", kPreset, "--for", "250"}, asked);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(digest_of(server.document(paced)), digest_of(alone));
  // Who dies without a word is noticed by its lease only.
  readers[0].signal(SIGKILL);
  EXPECT_EQ(flood.wait(std::chrono::minutes(5)), 0);
  const json said = report(asked);
  EXPECT_EQ(said.at("unanswered"), 0) << said;
  EXPECT_EQ(said.at("ended").value("completed", 0) + said.at("rejected").value("busy", 0), count) << said;
  EXPECT_LT(server.document({"server"}).at(0).at("resident_bytes").get<double>(), 1e9);
}

// What it holds up is held up no longer than it lives.
TEST(Overload, ALosslessReaderThatHasStalledStillComesToItsEnd) {
  const ServerUnderTest server;
  Process stalled = client(server, "stalling_subscriber", {"--after", "0.5", "--for", "8", "--lossless"});
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  // More batches than its cache holds.
  Process run(server.ctl_command({"run", "--preset", kPreset, "--set", "telemetry.lossless=true", "--set",
                                  "telemetry.sample_period_s=0.00001"}),
              {});
  EXPECT_EQ(stalled.wait(std::chrono::seconds(60)), 0);
  EXPECT_EQ(run.wait(std::chrono::seconds(60)), 0);
}

// What it does not acknowledge is kept for it, but not for ever.
TEST(Overload, AReaderThatNeverAcknowledgesCostsWhatIsPublishedInHalfAMinute) {
  const ServerUnderTest server;
  Process deaf = client(server, "stalling_subscriber", {"--after", "0.5", "--for", "75", "--lossless"});
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  const auto resident_after_a_burst = [&] {
    for (int i = 0; i < 40; ++i)
      EXPECT_EQ(server
                    .ctl({"run", "--preset", kPreset, "--set", "telemetry.sample_period_s=0.0001", "--set",
                          "telemetry.lossless=true"})
                    .exit_code,
                0);
    std::this_thread::sleep_for(std::chrono::seconds(2));
    return server.document({"server"}).at(0).at("resident_bytes").get<double>();
  };
  const double before = server.document({"server"}).at(0).at("resident_bytes").get<double>();
  const double once = resident_after_a_burst();
  std::this_thread::sleep_for(std::chrono::seconds(31));
  const double twice = resident_after_a_burst();
  RecordProperty("before", std::to_string(before));
  RecordProperty("once", std::to_string(once));
  RecordProperty("twice", std::to_string(twice));
  // There is something to keep; the second burst takes the place of the first.
  EXPECT_GT(once - before, 20e6);
  EXPECT_LT(twice - once, 0.5 * (once - before)) << before << ' ' << once << ' ' << twice;
  EXPECT_EQ(deaf.wait(std::chrono::seconds(90)), 0);
}

TEST(Overload, APacedRequestTooManyIsToldSoWithTheFigures) {
  const ServerUnderTest server({"--pacers", "1"});
  const std::vector<std::string> heavy{"submit",   "--json",
                                       "--preset", kPreset,
                                       "--set",    "timing.mode=real_time",
                                       "--set",    "timing.start=held",
                                       "--set",    "simulation.ballast_operations_per_step=100000"};
  int accepted = 0;
  Finished last;
  for (int i = 0; i < 200; ++i) {
    last = server.ctl(heavy);
    if (last.exit_code != 0) break;
    ++accepted;
  }
  EXPECT_GT(accepted, 0);
  EXPECT_EQ(last.exit_code, 7) << last.errors;
  EXPECT_NE(last.errors.find("may be promised"), std::string::npos) << last.errors;
}

// A state directory that was copied: two servers call themselves the same. A request goes to both, and each
// gives the same bits; who asks is answered, and goes on being answered when one of them dies.
TEST(Overload, TwoServersWithOneIdGiveOneAnswer) {
  ServerUnderTest first;
  const json alone = first.document({"run", "--preset", kPreset});
  const TemporaryDirectory copied;
  std::filesystem::copy_file(first.state() / "server_id", copied.path() / "server_id");
  Process twin({SLEWD, "--domain", std::to_string(first.domain()), "--state-dir", copied.path().string()},
               copied.path() / "log");
  for (int i = 0; i < 1000 && report(copied.path() / "log").is_discarded() &&
                  !std::filesystem::exists(copied.path() / "journal.sqlite");
       ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::seconds(1));
  for (int i = 0; i < 5; ++i)
    EXPECT_EQ(digest_of(first.document({"run", "--preset", kPreset})), digest_of(alone));
  EXPECT_EQ(first.ctl({"server"}).exit_code, 0);
  first.kill();
  // The other has all that was asked of it.
  EXPECT_EQ(digest_of(first.document({"run", "--preset", kPreset})), digest_of(alone));
  EXPECT_GE(first.document({"history"}).at("total").get<int>(), 1);
  twin.signal(SIGTERM);
  EXPECT_EQ(twin.wait(std::chrono::seconds(60)), 0);
}

// Clients stay, servers come and go; and the other way round.
TEST(Overload, RestartsOfEitherSideLoseNothing) {
  ServerUnderTest server({"--drain", "0.2"});
  const auto asked = server.state() / "asked";
  Process requester = client(
      server, "requester",
      {"--count", "60", "--per-second", "10", "--paced", "0", "--preset", kPreset, "--for", "200"}, asked);
  for (int i = 0; i < 4; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1200));
    if (i % 2)
      server.kill();
    else
      EXPECT_EQ(server.stop(), 0);
    server.start();
  }
  EXPECT_EQ(requester.wait(std::chrono::minutes(4)), 0) << report(asked);
  const json said = report(asked);
  EXPECT_EQ(said.at("unanswered"), 0);
  EXPECT_EQ(said.at("ended").value("completed", 0) + said.at("rejected").value("draining", 0), 60) << said;
  for (int i = 0; i < 10; ++i) {
    Process brief(server.ctl_command({"run", "--preset", kPreset, "--set", "timing.mode=real_time"}), {});
    std::this_thread::sleep_for(std::chrono::milliseconds(40 * i));
    brief.signal(SIGKILL);
  }
  EXPECT_EQ(server.ctl({"run", "--preset", kPreset}).exit_code, 0);
}

}  // namespace
