// A flexible structure in the service: paced, watched, paused, called off and kept like any other plant, and
// the same bits whatever the pace.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "client/library/telemetry.hpp"
#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kTracking = "sung-lee-kim-2001/tracking-control-a";
const std::string kOpen = "sung-lee-kim-2001/open-loop";

std::string digest_of(const json& result) {
  return result.at("provenance").at("digest").at("xxh3_128");
}

std::vector<std::string> command(const char* verb, const std::string& preset,
                                 const std::vector<std::string>& settings) {
  std::vector<std::string> arguments{verb, "--preset", preset};
  for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
  return arguments;
}

std::string submit(const ServerUnderTest& server, const std::string& preset,
                   const std::vector<std::string>& settings) {
  return server.document(command("submit", preset, settings)).at("experiment_id");
}

// What `show` says once the experiment is in this phase.
json await(const ServerUnderTest& server, const std::string& id, const std::string& phase) {
  json shown;
  for (int i = 0; i < 500; ++i) {
    shown = server.document({"show", id});
    if (shown.at("phase") == phase) return shown;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  ADD_FAILURE() << id << " stays " << shown.at("phase");
  return shown;
}

TEST(StructureService, TheSameBitsAtEveryPace) {
  const ServerUnderTest server;
  for (const std::string& preset : {kTracking, kOpen}) {
    SCOPED_TRACE(preset);
    const json fast = server.document(command("run", preset, {"simulation.duration_s=3"}));
    EXPECT_TRUE(fast.at("provenance").at("lateness").is_null());
    for (const std::vector<std::string>& pace :
         {std::vector<std::string>{"timing.mode=real_time"},
          {"timing.mode=scaled", "timing.rate=2.5", "telemetry.publish_max_hz=200"}}) {
      std::vector<std::string> settings = pace;
      settings.push_back("simulation.duration_s=3");
      const json paced = server.document(command("run", preset, settings));
      EXPECT_EQ(digest_of(paced), digest_of(fast)) << pace.front();
      EXPECT_EQ(paced.at("metrics"), fast.at("metrics"));
      EXPECT_FALSE(paced.at("provenance").at("lateness").is_null());
    }
  }
}

TEST(StructureService, RunsAtItsPaceWhileItIsWatchedAndPaused) {
  const ServerUnderTest server;
  const wire::Domain domain({server.domain(), ""});
  client::Telemetry telemetry(domain);
  telemetry.poll(std::chrono::milliseconds(500), {});
  const std::string id =
      submit(server, kTracking,
             {"timing.mode=scaled", "timing.rate=2", "timing.start=held", "simulation.duration_s=6",
              "telemetry.sample_period_s=0.02", "telemetry.publish_max_hz=200"});
  const auto wire_id = wire::Id::parse(id);
  slew_v1_Experiment last{};
  std::vector<double> times;
  std::set<std::string> names;
  const auto watch = [&](std::chrono::milliseconds how_long, bool to_the_end) {
    const auto deadline = std::chrono::steady_clock::now() + how_long;
    while (std::chrono::steady_clock::now() < deadline && !(to_the_end && wire::is_terminal(last.phase)))
      telemetry.poll(std::chrono::milliseconds(20),
                     {.state =
                          [&](const wire::Id& of, const client::Stream& stream, double t_s,
                              std::span<const double> row) {
                            if (of != *wire_id) return;
                            times.push_back(t_s);
                            for (const auto& channel : stream.state) names.insert(channel.name);
                            for (const double value : row) EXPECT_TRUE(std::isfinite(value));
                          },
                      .experiment =
                          [&](const slew_v1_Experiment& status) {
                            if (wire::Id::from(status.experiment_id) == *wire_id) last = status;
                          }});
  };
  await(server, id, "held");
  EXPECT_EQ(server.ctl({"resume", id}).exit_code, 0);
  watch(std::chrono::milliseconds(800), false);
  EXPECT_EQ(server.ctl({"pause", id}).exit_code, 0);
  await(server, id, "paused");
  watch(std::chrono::milliseconds(100), false);
  const double paused_at_s = server.document({"show", id}).at("t_sim_s");
  // Two simulated seconds to each of the wall, and the time that slewctl takes.
  EXPECT_GT(paused_at_s, 1);
  EXPECT_LT(paused_at_s, 5);
  const std::size_t seen = times.size();
  EXPECT_GT(seen, 40u);
  watch(std::chrono::milliseconds(300), false);
  EXPECT_EQ(times.size(), seen);
  EXPECT_EQ(server.document({"show", id}).at("t_sim_s"), paused_at_s);
  EXPECT_EQ(server.ctl({"step", id, "0.25"}).exit_code, 0);
  await(server, id, "paused");
  EXPECT_NEAR(server.document({"show", id}).at("t_sim_s").get<double>(), paused_at_s + 0.25, 1e-9);
  EXPECT_EQ(server.ctl({"rate", id, "10"}).exit_code, 0);
  EXPECT_EQ(server.ctl({"resume", id}).exit_code, 0);
  watch(std::chrono::seconds(10), true);
  ASSERT_EQ(last.phase, slew_v1_COMPLETED);
  EXPECT_EQ(last.dropped, 0u);
  EXPECT_EQ(times.size(), last.published);
  EXPECT_EQ(telemetry.streams().at(*wire_id).lost, 0u);
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
  EXPECT_TRUE(names.contains("command_angle_rad")) << json(names).dump();
  const json fast = server.document(
      command("run", kTracking, {"simulation.duration_s=6", "telemetry.sample_period_s=0.02"}));
  EXPECT_EQ(digest_of(server.document({"result", id})), digest_of(fast));
}

TEST(StructureService, IsCalledOffAndKept) {
  const ServerUnderTest server;
  const std::string id = submit(server, kOpen, {"timing.mode=real_time", "telemetry.sample_period_s=0.02"});
  await(server, id, "running");
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  EXPECT_EQ(server.ctl({"cancel", id}).exit_code, 0);
  await(server, id, "cancelled");
  const json result = server.document({"result", id});
  EXPECT_EQ(result.at("phase"), "cancelled");
  EXPECT_LT(result.at("metrics").at("end_time_s").get<double>(), 6);
  // What it flew until then can be read, and so can what flew to its end.
  const json part = server.document({"series", id, "--channels", "command_angle_rad"});
  ASSERT_GT(part.at("t_s").size(), 10u);
  EXPECT_LT(part.at("t_s").back().get<double>(), 6);
  const json whole_run =
      server.document(command("run", kOpen, {"simulation.duration_s=8", "telemetry.sample_period_s=0.02"}));
  const json whole =
      server.document({"series", whole_run.at("experiment_id"), "--channels", "command_angle_rad"});
  ASSERT_EQ(whole.at("t_s").size(), 401u);
  EXPECT_NEAR(whole.at("t_s").back().get<double>(), 8, 1e-12);
  // The command ends at 6.4415 s, at 30 deg.
  EXPECT_NEAR(whole.at("columns").at("command_angle_rad").back().get<double>(), std::acos(-1) / 6, 1e-6);
  // The one that was called off flew the same as far as it came.
  for (std::size_t i = 0; i < part.at("t_s").size(); ++i) {
    if (part.at("t_s").at(i) != whole.at("t_s").at(i)) break;
    ASSERT_EQ(part.at("columns").at("command_angle_rad").at(i),
              whole.at("columns").at("command_angle_rad").at(i))
        << i;
  }
}

}  // namespace
