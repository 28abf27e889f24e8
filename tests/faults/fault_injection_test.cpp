// Whatever the system does to the server: what was accepted ends, what cannot be taken is refused in words,
// and one experiment's trouble is nobody else's.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <iostream>

#include "tests/faults/faulty_server.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";

json digest_of(const json& result) {
  return result.at("provenance").at("digest");
}

std::string submit_paced(const ServerUnderTest& server, std::vector<std::string> more = {}) {
  std::vector<std::string> command{"submit", "--preset", kPreset, "--set", "timing.mode=real_time"};
  command.insert(command.end(), more.begin(), more.end());
  return server.document(command).at("experiment_id");
}

// Its phase when it has ended, or after half a minute.
std::string phase_at_the_end(const ServerUnderTest& server, const std::string& id) {
  json shown;
  for (int i = 0; i < 1500; ++i) {
    shown = server.document({"show", id});
    if (shown.at("ended_unix_ns") != 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return shown.at("phase");
}

// ---- the disk
// -----------------------------------------------------------------------------------------------

class Disk : public testing::TestWithParam<Fault> {};

TEST_P(Disk, ThatRefusesIsToldAndNothingAcceptedIsLost) {
  FaultyServer faulty;
  ServerUnderTest& server = faulty.server;
  server.start();
  const json alone = server.document({"run", "--preset", kPreset});
  const std::string under_way = submit_paced(server);
  faulty.faults.arm(GetParam());

  // New work cannot be promised; the sentence names the journal.
  const Finished refused = server.ctl({"run", "--preset", kPreset});
  EXPECT_EQ(refused.exit_code, 7);
  EXPECT_NE(refused.errors.find("journal"), std::string::npos) << refused.errors;
  // What is under way flies on, and what is asked is answered.
  for (int i = 0; i < 600 && server.document({"show", under_way}).at("t_sim_s").get<double>() < 2; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_GE(server.document({"show", under_way}).at("t_sim_s").get<double>(), 2);
  EXPECT_EQ(server.document({"history"}).at("total"), 2);
  EXPECT_EQ(server.document({"result", alone.at("experiment_id")}), alone);
  EXPECT_GT(faulty.faults.injected(), 0);

  // The disk is well again: the end that was owed is written.
  faulty.faults.disarm();
  EXPECT_EQ(phase_at_the_end(server, under_way), "completed");
  EXPECT_EQ(digest_of(server.document({"result", under_way})), digest_of(alone));
  EXPECT_EQ(server.ctl({"run", "--preset", kPreset}).exit_code, 0);
  EXPECT_EQ(server.stop(), 0);
}

// A client that hears nothing asks again after a second: the promise is not given before it can be kept.
TEST(FaultInjection, ARequestThatIsRepeatedIsNotAcceptedBeforeItIsOnTheDisk) {
  FaultyServer faulty;
  ServerUnderTest& server = faulty.server;
  server.start();
  const auto session = server.session();
  faulty.faults.arm(Fault::slow_disk);
  const auto said = session->submit(json{{"preset", kPreset}, {"timing", {{"start", "held"}}}}.dump(),
                                    wire::Id::make(), std::chrono::seconds(30));
  ASSERT_TRUE(said);
  EXPECT_EQ(said->phase, slew_v1_ACCEPTED) << said->json;
  EXPECT_GT(faulty.faults.injected(), 0);
  faulty.faults.disarm();
  // What is shown is what the journal holds.
  const auto shown =
      session->query("show", json{{"id", said->experiment_id.hex()}}.dump(), std::chrono::seconds(10));
  ASSERT_TRUE(shown);
  EXPECT_TRUE(shown->is_ok()) << shown->json;
}

TEST(FaultInjection, ADiskThatIsSlowerThanTheDrainIsToldByTheExitCodeAndLosesNothing) {
  FaultyServer faulty({"--drain", "0.2"});
  ServerUnderTest& server = faulty.server;
  server.start();
  std::vector<std::string> ids;
  for (int i = 0; i < 8; ++i)
    ids.push_back(
        server.document({"submit", "--preset", kPreset, "--set", "timing.start=held"}).at("experiment_id"));
  faulty.faults.arm(Fault::slow_disk);
  for (const std::string& id : ids) EXPECT_EQ(server.ctl({"resume", id}).exit_code, 0);
  server.process().signal(SIGTERM);
  // Results go on being committed while everything else is taken apart.
  EXPECT_EQ(server.process().wait(std::chrono::seconds(120)), 1) << server.log();
  EXPECT_GT(faulty.faults.injected(), 2);
  faulty.faults.disarm();
  server.start();
  for (const std::string& id : ids) {
    if (server.document({"show", id}).at("phase") == "held") server.ctl({"resume", id});
    EXPECT_EQ(phase_at_the_end(server, id), "completed");
  }
}

TEST_P(Disk, ThatRefusesAtTheStartIsToldByTheExitCodeAndASentence) {
  FaultyServer faulty;
  ServerUnderTest& server = faulty.server;
  faulty.faults.arm(GetParam());
  Process refused(server.command(),
                  server.state().parent_path() / (server.state().filename().string() + ".log"));
  EXPECT_EQ(refused.wait(std::chrono::seconds(30)), 1);
  const auto log = server.state().parent_path() / (server.state().filename().string() + ".log");
  std::ostringstream text;
  text << std::ifstream(log).rdbuf();
  std::filesystem::remove(log);
  EXPECT_NE(text.str().find("slewd: the "), std::string::npos) << text.str();
  EXPECT_NE(text.str().find(server.state().string()), std::string::npos) << text.str();
  faulty.faults.disarm();
  server.start();
  EXPECT_EQ(server.ctl({"run", "--preset", kPreset}).exit_code, 0);
}

TEST_P(Disk, ThatFailsWhileTheSeriesIsWrittenCostsTheSeriesAndLeavesNothingBehind) {
  FaultyServer faulty;
  ServerUnderTest& server = faulty.server;
  server.start();
  const std::string id = submit_paced(server);
  faulty.faults.arm(GetParam());
  // Until it has landed and could be neither archived nor committed.
  for (int i = 0; i < 1500 && server.log().find("not archived") == std::string::npos; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  faulty.faults.disarm();
  EXPECT_EQ(phase_at_the_end(server, id), "completed");
  const json result = server.document({"result", id});
  ASSERT_EQ(result.at("warnings").size(), 1u);
  EXPECT_NE(result.at("warnings").at(0).get<std::string>().find("could not be archived"), std::string::npos);
  EXPECT_EQ(server.ctl({"series", id}).exit_code, 1);
  EXPECT_TRUE(std::filesystem::is_empty(server.state() / "series"));
}

INSTANTIATE_TEST_SUITE_P(FaultInjection, Disk, testing::Values(Fault::disk_full, Fault::disk_read_only),
                         [](const auto& one) { return one.param == Fault::disk_full ? "Full" : "ReadOnly"; });

// One life with a call that fails and one without: whatever was accepted has its end.
void live_with_an_error_at(std::int64_t nth, std::int64_t& calls, std::int64_t& injected) {
  FaultyServer faulty({"--drain", "0.2"});
  ServerUnderTest& server = faulty.server;
  const std::string id = wire::Id::make().hex();
  const std::vector<std::string> submit{"submit", "--preset", kPreset, "--request-id", id, "--json"};
  faulty.faults.arm(Fault::io_error_once, nth);
  bool is_accepted = false;
  {
    Process first(server.command(), server.state() / "log");
    // Either it serves or it ends with a sentence.
    auto connect = server.ctl_command({"list", "--connect", "30"});
    Process probe(connect, {});
    int heard = -1;
    for (int i = 0; i < 3000 && first.is_running() && probe.is_running(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (first.is_running()) heard = probe.wait(std::chrono::seconds(30));
    if (first.is_running()) {
      EXPECT_TRUE(heard == 0 || heard == 1) << heard;
      const Finished said = server.ctl(submit);
      EXPECT_TRUE(said.exit_code == 0 || said.exit_code == 7) << said.exit_code << said.errors;
      is_accepted = said.exit_code == 0;
      if (is_accepted)
        for (int i = 0; i < 200 && server.ctl({"result", id}).exit_code != 0; ++i)
          std::this_thread::sleep_for(std::chrono::milliseconds(10));
      first.signal(SIGTERM);
      EXPECT_EQ(first.wait(std::chrono::seconds(60)), 0) << server.log();
    } else {
      EXPECT_EQ(first.wait(std::chrono::seconds(1)), 1) << server.log();
      EXPECT_NE(server.log().find("slewd: "), std::string::npos) << server.log();
    }
  }
  calls = faulty.faults.calls();
  injected = faulty.faults.injected();
  faulty.faults.disarm();
  server.start();
  if (is_accepted) {
    EXPECT_EQ(phase_at_the_end(server, id), "completed");
    EXPECT_EQ(server.document({"history"}).at("total"), 1);
  }
  EXPECT_EQ(server.ctl({"run", "--preset", kPreset}).exit_code, 0);
}

TEST(FaultInjection, AnIoErrorAtEveryCallLosesNothingThatWasAccepted) {
  std::int64_t all = 0, injected = 0, total = 0;
  live_with_an_error_at(-1, all, injected);
  ASSERT_GT(all, 30);
  for (std::int64_t nth = 1; nth <= all; ++nth) {
    SCOPED_TRACE(nth);
    std::int64_t calls = 0;
    live_with_an_error_at(nth, calls, injected);
    total += injected;
  }
  // Which calls there are depends a little on who comes first.
  EXPECT_GT(total, all * 8 / 10);
  std::cout << total << " errors in lives of " << all << " calls\n";
}

// ---- the clock
// ----------------------------------------------------------------------------------------------

TEST(FaultInjection, AWallClockThatJumpsByAnHourChangesNoFlight) {
  FaultyServer faulty;
  ServerUnderTest& server = faulty.server;
  server.start();
  const json alone = server.document({"run", "--preset", kPreset});
  const auto held = [&](const std::string& expires_s) {
    return submit_paced(server, {"--set", "timing.start=held", "--set", "timing.expires_s=" + expires_s});
  };
  for (const std::int64_t jump_s : {3600, -3600}) {
    SCOPED_TRACE(jump_s);
    const std::string patient = held("1800"), impatient = held("2");
    const std::string flying = submit_paced(server);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    faulty.faults.set_clock_forward(jump_s);
    EXPECT_EQ(phase_at_the_end(server, flying), "completed");
    EXPECT_EQ(digest_of(server.document({"result", flying})), digest_of(alone));
    // Half an hour has not passed; two seconds have.
    EXPECT_EQ(phase_at_the_end(server, impatient), "expired");
    EXPECT_EQ(server.document({"show", patient}).at("phase"), "held");
    EXPECT_EQ(server.ctl({"resume", patient}).exit_code, 0);
    EXPECT_EQ(phase_at_the_end(server, patient), "completed");
    EXPECT_EQ(server.ctl({"run", "--preset", kPreset}).exit_code, 0);
    EXPECT_EQ(server.ctl({"server"}).exit_code, 0);
    faulty.faults.set_clock_forward(0);
  }
  EXPECT_EQ(server.stop(), 0);
}

// ---- memory
// -------------------------------------------------------------------------------------------------

TEST(FaultInjection, OutOfMemoryInOneExperimentIsItsOwnEnd) {
  FaultyServer faulty({"--workers", "1"});
  ServerUnderTest& server = faulty.server;
  server.start();
  const std::vector<std::string> victim{"run", "--preset", kPreset, "--set",
                                        "telemetry.sample_period_s=0.001"};
  const std::string request = json{{"preset", kPreset}, {"telemetry", {{"sample_period_s", 0.001}}}}.dump();
  const json well = server.document(victim);
  faulty.faults.arm(Fault::no_memory, -1);
  server.document(victim);
  const std::int64_t all = faulty.faults.calls();
  ASSERT_GT(all, 5);
  const auto session = server.session();
  int failed = 0;
  const std::int64_t stride = std::max<std::int64_t>(1, all / 50);
  for (std::int64_t nth = 1; nth <= all; nth += stride) {
    SCOPED_TRACE(nth);
    const bool has_neighbour = nth % 10 == 1;
    const std::string neighbour = has_neighbour ? submit_paced(server) : "";
    const auto id = wire::Id::make();
    faulty.faults.arm(Fault::no_memory, nth);
    session->submit(request, id, std::chrono::seconds(20));
    const auto end = session->wait_for_end(id, std::chrono::seconds(30));
    const bool is_hit = faulty.faults.injected() > 0;
    faulty.faults.disarm();
    ASSERT_TRUE(end && server.process().is_running()) << server.log();
    if (end->phase == slew_v1_FAILED) {
      EXPECT_TRUE(is_hit);
      EXPECT_EQ(end->code, "out_of_memory") << end->json;
      ++failed;
    } else {
      EXPECT_EQ(end->phase, slew_v1_COMPLETED) << end->json;
    }
    if (has_neighbour) {
      EXPECT_EQ(phase_at_the_end(server, neighbour), "completed");
    }
  }
  EXPECT_GT(failed, 3);
  EXPECT_EQ(digest_of(server.document(victim)), digest_of(well));
  std::cout << failed << " of " << all << " pieces of memory were missed\n";
}

TEST(FaultInjection, WhatExperimentsRecordTogetherIsBounded) {
  const ServerUnderTest server({"--sample-memory", "4"});
  const Finished large =
      server.ctl({"run", "--json", "--preset", kPreset, "--set", "stop.when=duration", "--set",
                  "simulation.duration_s=100", "--set", "telemetry.sample_period_s=0.0005"});
  EXPECT_EQ(large.exit_code, 1);
  const json failure = json::parse(large.output).at("failure");
  EXPECT_EQ(failure.at("code"), "out_of_memory");
  EXPECT_NE(failure.at("sentence").get<std::string>().find("--sample-memory"), std::string::npos);
  // What it took has been given back.
  for (int i = 0; i < 3; ++i) EXPECT_EQ(server.ctl({"run", "--preset", kPreset}).exit_code, 0);
}

// ---- the experiment itself
// ----------------------------------------------------------------------------------

TEST(FaultInjection, AnExperimentThatDivergesFailsByNameAndAlone) {
  const ServerUnderTest server;
  const std::string neighbour = submit_paced(server);
  const Finished diverging = server.ctl({"run", "--json", "--preset", "bryson-1994/lead-compensation",
                                         "--set", "controller.zero_rad_s=3", "--set",
                                         "controller.pole_rad_s=0.5", "--set", "simulation.duration_s=2000"});
  EXPECT_EQ(diverging.exit_code, 1) << diverging.errors;
  const json result = json::parse(diverging.output);
  EXPECT_EQ(result.at("failure").at("code"), "diverged") << result.at("failure");
  // A body that is spun twice as fast with every sample: to follow it for ever would not end.
  const json spinning = {{"plant", {{"type", "rigid_body"}, {"inertia_kg_m2", {100, 110, 120}}}},
                         {"actuator", {{"type", "ideal_torque"}}},
                         {"controller",
                          {{"type", "rate_damping"},
                           {"damping_N_m_s", 300},
                           {"evaluation", {{"type", "sampled"}, {"period_s", 1}}}}},
                         {"maneuver",
                          {{"type", "three_axis"},
                           {"initial_rate_deg_s", {1, 1, 1}},
                           {"initial_attitude", {{"type", "mrp"}, {"value", {0, 0, 0}}}}}},
                         {"simulation", {{"duration_s", 3000}}}};
  const Finished spun = server.ctl({"run", "--json", "-"}, spinning.dump());
  EXPECT_EQ(spun.exit_code, 1) << spun.errors;
  EXPECT_EQ(json::parse(spun.output).at("failure").at("code"), "diverged");
  EXPECT_EQ(phase_at_the_end(server, neighbour), "completed");
  EXPECT_EQ(digest_of(server.document({"result", neighbour})),
            digest_of(server.document({"run", "--preset", kPreset})));
}

// ---- a step that does not end
// -------------------------------------------------------------------------------

TEST(FaultInjection, AStepThatDoesNotEndDoesNotKeepTheServer) {
  FaultyServer faulty({"--drain", "0.5", "--workers", "1", "--pacers", "1"});
  ServerUnderTest& server = faulty.server;
  server.start();
  const std::string paced =
      submit_paced(server, {"--set", "stop.when=duration", "--set", "simulation.duration_s=1000"});
  const std::string as_fast =
      server.document({"submit", "--preset", kPreset, "--set", "timing.start=held"}).at("experiment_id");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  faulty.faults.arm(Fault::hang);
  EXPECT_EQ(server.ctl({"resume", as_fast}).exit_code, 0);
  for (int i = 0; i < 1000 && faulty.faults.injected() < 2; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_GE(faulty.faults.injected(), 2);
  server.process().signal(SIGTERM);
  // It is not waited for; the exit code is honest.
  EXPECT_EQ(server.process().wait(std::chrono::seconds(60)), 1) << server.log();
  EXPECT_NE(server.log().find("did not come out of a step"), std::string::npos) << server.log();
  faulty.faults.disarm();
  server.start();
  EXPECT_EQ(phase_at_the_end(server, paced), "interrupted");
  const json result = server.document({"result", paced});
  EXPECT_NE(result.at("warnings").dump().find("a step went on"), std::string::npos);
  // The as-fast one is owed: it is held again, as its request says.
  EXPECT_EQ(server.ctl({"resume", as_fast}).exit_code, 0);
  EXPECT_EQ(phase_at_the_end(server, as_fast), "completed");
}

}  // namespace
