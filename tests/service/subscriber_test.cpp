// Subscribers come late, stop reading, and go away; nobody waits for them.
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>

#include "client/library/telemetry.hpp"
#include "idl/wire/reader.hpp"
#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";

// The arguments for a paced run of so many seconds, after the command and before anything else.
std::vector<std::string> paced(const char* command, double duration_s, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments{command,
                                     "--preset",
                                     kPreset,
                                     "--set",
                                     "timing.mode=real_time",
                                     "--set",
                                     "stop.when=duration",
                                     "--set",
                                     "simulation.duration_s=" + std::to_string(duration_s)};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST(Subscriber, WhoJoinsInTheMiddleKnowsPhaseChannelsAndUnits) {
  const ServerUnderTest server;
  const auto id = wire::Id::parse(server.document(paced("submit", 4)).at("experiment_id").get<std::string>());
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  const wire::Domain domain({server.domain(), ""});
  client::Telemetry telemetry(domain);
  bool has_phase = false;
  double first_t_s = -1;
  client::Stream described;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(3);
  while (std::chrono::steady_clock::now() < deadline && (first_t_s < 0 || !has_phase))
    telemetry.poll(
        std::chrono::milliseconds(50),
        {.state =
             [&](const wire::Id& of, const client::Stream& stream, double t_s, std::span<const double> row) {
               if (of != *id || first_t_s >= 0) return;
               first_t_s = t_s;
               described = stream;
               EXPECT_EQ(row.size(), stream.state.size());
             },
         .experiment =
             [&](const slew_v1_Experiment& status) {
               if (wire::Id::from(status.experiment_id) == *id)
                 has_phase = has_phase || status.phase == slew_v1_RUNNING;
             }});
  EXPECT_TRUE(has_phase);
  EXPECT_GT(first_t_s, 0.5);  // it did not wait for the beginning
  ASSERT_EQ(described.state.size(), 4u);
  EXPECT_EQ(described.state[0].name, "angle_rad");
  EXPECT_EQ(described.state[1].unit, "rad/s");
  ASSERT_EQ(described.thrusters.size(), 5u);
  EXPECT_EQ(described.thrusters[0].unit, "N m");
}

TEST(Subscriber, CountsEverySampleThatWasPublished) {
  const ServerUnderTest server;
  const wire::Domain domain({server.domain(), ""});
  client::Telemetry telemetry(domain);
  telemetry.poll(std::chrono::milliseconds(500), {});
  const auto id =
      wire::Id::parse(server.document(paced("submit", 2, {"--set", "telemetry.publish_max_hz=100"}))
                          .at("experiment_id")
                          .get<std::string>());
  slew_v1_Experiment last{};
  std::vector<double> times;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(8);
  while (std::chrono::steady_clock::now() < deadline && !wire::is_terminal(last.phase))
    telemetry.poll(std::chrono::milliseconds(50),
                   {.state =
                        [&](const wire::Id& of, const client::Stream&, double t_s, std::span<const double>) {
                          if (of == *id) times.push_back(t_s);
                        },
                    .experiment =
                        [&](const slew_v1_Experiment& status) {
                          if (wire::Id::from(status.experiment_id) == *id) last = status;
                        }});
  ASSERT_EQ(last.phase, slew_v1_COMPLETED);
  EXPECT_EQ(times.size(), last.published);
  EXPECT_EQ(last.published, 201u);  // 0, 0.01, ... 2.00 s
  EXPECT_EQ(last.sampled, 201u);
  EXPECT_EQ(last.dropped, 0u);
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
  EXPECT_EQ(telemetry.streams().at(*id).lost, 0u);
}

// A writer that never lets go of an instance keeps it for ever.
TEST(Subscriber, SeesThatAnEndedOneHasNoWriterOfTelemetryAnyMore) {
  const ServerUnderTest server;
  const wire::Domain domain({server.domain(), ""});
  wire::Reader<slew_v1_State> state(domain);
  wire::Reader<slew_v1_Thrusters> thrusters(domain);
  while (state.matched() == 0 || thrusters.matched() == 0)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  for (const char* lossless : {"false", "true"}) {
    SCOPED_TRACE(lossless);
    server.document({"run", "--preset", kPreset, "--set", std::string("telemetry.lossless=") + lossless});
    int received = 0, let_go = 0;
    const auto count = [&](const auto&, const dds_sample_info_t& info) {
      if (info.valid_data) ++received;
      if (info.instance_state == DDS_IST_NOT_ALIVE_NO_WRITERS) ++let_go;
    };
    for (int i = 0; i < 100 && let_go < 2; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      state.take(count);
      thrusters.take(count);
    }
    EXPECT_GT(received, 0);
    EXPECT_GE(let_go, 2);
  }
}

// Far faster than this reader takes them, and yet all of them, in order.
TEST(Subscriber, ALosslessReaderCountsEverySampleOfAnAsFastRun) {
  const ServerUnderTest server;
  const wire::Domain domain({server.domain(), ""});
  client::Telemetry telemetry(domain, wire::Delivery::lossless);
  telemetry.poll(std::chrono::milliseconds(500), {});
  const auto id =
      wire::Id::parse(server
                          .document({"submit", "--preset", kPreset, "--set", "telemetry.lossless=true",
                                     "--set", "telemetry.sample_period_s=0.00001"})
                          .at("experiment_id")
                          .get<std::string>());
  slew_v1_Experiment last{};
  std::uint64_t states = 0, thrusters = 0, out_of_order = 0;
  double last_t_s = -1;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (std::chrono::steady_clock::now() < deadline && !wire::is_terminal(last.phase)) {
    telemetry.poll(std::chrono::milliseconds(50),
                   {.state =
                        [&](const wire::Id&, const client::Stream&, double t_s, std::span<const double>) {
                          out_of_order += t_s <= last_t_s;
                          last_t_s = t_s;
                          ++states;
                        },
                    .thrusters = [&](const wire::Id&, const client::Stream&, double,
                                     std::span<const double>) { ++thrusters; },
                    .experiment =
                        [&](const slew_v1_Experiment& status) {
                          if (wire::Id::from(status.experiment_id) == *id) last = status;
                        }});
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
  }
  ASSERT_EQ(last.phase, slew_v1_COMPLETED);
  EXPECT_EQ(last.sampled, 205001u);  // 0 to 2.05 s
  EXPECT_EQ(last.published, last.sampled);
  EXPECT_EQ(last.dropped, 0u);
  EXPECT_EQ(states, last.sampled);
  EXPECT_EQ(thrusters, last.sampled);
  EXPECT_EQ(out_of_order, 0u);
  EXPECT_EQ(telemetry.streams().at(*id).lost, 0u);
  EXPECT_TRUE(server.document({"result", id->hex()}).at("warnings").empty());
}

TEST(Subscriber, OneThatStopsDoesNotHoldALosslessRunForEver) {
  const ServerUnderTest server;
  Process stopped(server.ctl_command({"watch", "--all", "--csv"}), server.state() / "stopped.csv");
  std::this_thread::sleep_for(std::chrono::milliseconds(800));
  stopped.signal(SIGSTOP);
  const json result = server.document({"run", "--preset", kPreset, "--set", "telemetry.lossless=true",
                                       "--set", "telemetry.sample_period_s=0.00001", "--timeout", "60"});
  EXPECT_EQ(result.at("phase"), "completed");
  stopped.signal(SIGCONT);
}

TEST(Subscriber, OneThatStopsReadingDelaysNobody) {
  const ServerUnderTest server;
  Process stopped(server.ctl_command({"watch", "--all", "--csv"}), server.state() / "stopped.csv");
  std::this_thread::sleep_for(std::chrono::milliseconds(800));
  const auto begin_s = [] { return std::chrono::steady_clock::now(); };
  const json before = server.document(paced("run", 1));
  stopped.signal(SIGSTOP);
  // Enough to fill whatever stands between the server and a reader that does not read.
  for (int i = 0; i < 30; ++i)
    EXPECT_EQ(server
                  .ctl({"run", "--preset", kPreset, "--set", "telemetry.publish_max_hz=100000", "--set",
                        "telemetry.sample_period_s=0.0001"})
                  .exit_code,
              0);
  const auto begin = begin_s();
  const json during = server.document(paced("run", 1));
  EXPECT_LT(std::chrono::duration<double>(begin_s() - begin).count(), 3);
  const auto missed = [](const json& result) {
    const json& lateness = result.at("provenance").at("lateness");
    return lateness.at("overruns").get<int>() + lateness.at("oversleeps").get<int>();
  };
  EXPECT_LE(missed(during), missed(before) + 5);
  EXPECT_EQ(during.at("provenance").at("digest"), before.at("provenance").at("digest"));
  stopped.signal(SIGCONT);
}

}  // namespace
