// Maneuvers that the server plans before it flies them: the phase, its end, its memory.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kQuick = "kim-crassidis-1998/planned-90deg";
// Starts without end, evaluations to match: minutes.
const std::vector<std::string> kEndless{"--preset", "vadali-singh-carter-1993/ground-on-off-8-lbf-160-ft3",
                                        "--set",    "guidance.search.least_starts=100000",
                                        "--set",    "guidance.search.most_starts=100000",
                                        "--set",    "guidance.search.enough_hits=100000",
                                        "--set",    "guidance.search.most_evaluations=10000000"};

std::string submit(const ServerUnderTest& server, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "submit");
  const json submitted = server.document(arguments);
  return submitted.is_object() ? submitted.at("experiment_id").get<std::string>() : "";
}

json await(const ServerUnderTest& server, const std::string& id, const std::vector<std::string>& phases) {
  json shown;
  for (int i = 0; i < 1500; ++i) {
    shown = server.document({"show", id});
    for (const std::string& phase : phases)
      if (shown.at("phase") == phase) return shown;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  ADD_FAILURE() << id << " stays " << shown.at("phase");
  return shown;
}

std::string digest_of(const json& result) {
  return result.at("provenance").at("digest").at("xxh3_128");
}

std::size_t times_planned(const ServerUnderTest& server) {
  const std::string log = server.log();
  std::size_t count = 0;
  for (std::size_t at = log.find(" planned in "); at != std::string::npos;
       at = log.find(" planned in ", at + 1))
    ++count;
  return count;
}

TEST(ManeuverPlanning, IsDoneBeforeTheFlightAndRemembered) {
  ServerUnderTest server;
  const json first = server.document({"run", "--preset", kQuick});
  ASSERT_TRUE(first.is_object());
  EXPECT_EQ(first.at("plan").at("status"), "extremal");
  EXPECT_NEAR(first.at("plan").at("time_s").get<double>(), 2.42111655, 2e-5);
  EXPECT_LE(first.at("metrics").at("final_error_deg").get<double>(), 1e-4);
  EXPECT_EQ(times_planned(server), 1u);
  // The same problem, flown otherwise: the plan is there already.
  const json again = server.document({"run", "--preset", kQuick, "--set", "label=again"});
  EXPECT_EQ(digest_of(again), digest_of(first));
  EXPECT_EQ(again.at("plan"), first.at("plan"));
  EXPECT_EQ(times_planned(server), 1u);
  // And after a restart.
  EXPECT_EQ(server.stop(), 0);
  server.start();
  EXPECT_EQ(digest_of(server.document({"run", "--preset", kQuick})), digest_of(first));
  EXPECT_EQ(times_planned(server), 1u);
  // Damaged, it is planned again, to the same bits.
  for (const auto& file : std::filesystem::directory_iterator(server.state() / "plans")) {
    std::ifstream in(file.path());
    std::string text((std::istreambuf_iterator<char>(in)), {});
    const auto place = text.find("switch_times_s");
    ASSERT_NE(place, std::string::npos);
    const auto digit = text.find_first_of("0123456789", text.find('.', place));
    text[digit] = text[digit] == '9' ? '8' : '9';
    std::ofstream(file.path(), std::ios::trunc) << text;
  }
  EXPECT_EQ(digest_of(server.document({"run", "--preset", kQuick})), digest_of(first));
  EXPECT_EQ(times_planned(server), 2u);
}

TEST(ManeuverPlanning, IsCalledOffWhereverItStands) {
  const ServerUnderTest server;
  const std::string under_way = submit(server, kEndless);
  const std::string waiting = submit(server, {"--preset", kQuick});
  await(server, under_way, {"planning"});
  EXPECT_EQ(server.document({"show", waiting}).at("phase"), "queued");
  EXPECT_EQ(server.ctl({"cancel", under_way}).exit_code, 0);
  const json ended = await(server, under_way, {"cancelled"});
  EXPECT_EQ(ended.at("started_unix_ns"), 0);
  EXPECT_EQ(server.document({"result", under_way}).at("plan"), json());
  await(server, waiting, {"completed"});
  // Behind one that never ends, one that is called off ends.
  const std::string endless = submit(server, kEndless);
  await(server, endless, {"planning"});
  const std::string behind = submit(server, {"--preset", kQuick, "--set", "plant.inertia_kg_m2=[1,1,1.2]"});
  EXPECT_EQ(server.ctl({"cancel", behind}).exit_code, 0);
  EXPECT_EQ(server.ctl({"cancel", endless}).exit_code, 0);
  await(server, behind, {"cancelled"});
  await(server, endless, {"cancelled"});
}

TEST(ManeuverPlanning, ProgressIsSaid) {
  const ServerUnderTest server;
  const auto session = server.session();
  json request = {{"preset", "vadali-singh-carter-1993/ground-on-off-8-lbf-160-ft3"}};
  request["guidance"]["search"] = {{"least_starts", 400},
                                   {"most_starts", 400},
                                   {"enough_hits", 400},
                                   {"most_evaluations", 1000000},
                                   {"time_budget_s", 3}};
  const auto reply = session->submit(request.dump(), wire::Id::make(), std::chrono::seconds(10));
  ASSERT_TRUE(reply);
  double least = 2, most = -1;
  session->wait_for_end(
      reply->request_id, std::chrono::seconds(60),
      [&](const slew_v1_Experiment& status) {
        if (status.phase != slew_v1_PLANNING) return;
        least = std::min(least, status.progress);
        most = std::max(most, status.progress);
      },
      [] { return true; });
  EXPECT_LT(least, most);
  EXPECT_GE(least, 0);
  EXPECT_LE(most, 1);
  // Its budget ended it, and it says so.
  const json result = server.document({"result", reply->request_id.hex()});
  EXPECT_EQ(result.at("phase"), "completed");
  EXPECT_EQ(result.at("plan").at("search").at("ended_by"), "time_budget");
  EXPECT_EQ(result.at("plan").at("status"), "best_found");
  EXPECT_FALSE(result.at("warnings").empty());
}

TEST(ManeuverPlanning, AHeldOneIsPlannedBeforeItIsHeld) {
  const ServerUnderTest server;
  const std::string id =
      submit(server, {"--preset", kQuick, "--set", "timing.start=held", "--set", "timing.mode=real_time"});
  await(server, id, {"held"});
  EXPECT_EQ(times_planned(server), 1u);
  EXPECT_EQ(server.ctl({"resume", id}).exit_code, 0);
  await(server, id, {"completed"});
}

// What was accepted is planned and flown after kill -9 in the middle of its planning, to the same bits.
TEST(ManeuverPlanning, SurvivesAKill) {
  ServerUnderTest server;
  const std::vector<std::string> preset{"--preset", "vadali-singh-carter-1993/ground-on-off-8-lbf-160-ft3"};
  const std::string id = submit(server, preset);
  await(server, id, {"planning", "running", "completed"});
  server.kill();
  server.start();
  await(server, id, {"completed"});
  const json result = server.document({"result", id});
  std::filesystem::remove_all(server.state() / "plans");
  EXPECT_EQ(server.stop(), 0);
  server.start();
  std::vector<std::string> run{"run"};
  run.insert(run.end(), preset.begin(), preset.end());
  EXPECT_EQ(digest_of(server.document(run)), digest_of(result));
}

TEST(ManeuverPlanning, ADrainDoesNotWaitForASearch) {
  ServerUnderTest server({"--drain", "0.5"});
  const std::string id = submit(server, kEndless);
  std::vector<std::string> paced = kEndless;
  paced.insert(paced.end(), {"--set", "timing.mode=real_time"});
  const std::string with_a_clock = submit(server, paced);
  await(server, id, {"planning"});
  EXPECT_EQ(server.stop(), 0);
  server.start();
  EXPECT_EQ(await(server, with_a_clock, {"interrupted"}).at("started_unix_ns"), 0);
  await(server, id, {"planning"});
  EXPECT_EQ(server.ctl({"cancel", id}).exit_code, 0);
  await(server, id, {"cancelled"});
}

TEST(ManeuverPlanning, WithoutAManeuverTheRunFailsAndSaysWhy) {
  const ServerUnderTest server;
  const Finished failed = server.ctl({"run", "--preset", "vadali-singh-carter-1993/on-off-200-lbf", "--set",
                                      "guidance.gas_limit_m3=0.001", "--json"});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_NE(failed.errors.find("no maneuver was found"), std::string::npos) << failed.errors;
  EXPECT_EQ(json::parse(failed.output).at("failure").at("code"), "no_plan");
}

TEST(ManeuverPlanning, TheCommandLinePlansWithoutAServer) {
  const TemporaryDirectory here;
  const auto ctl = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), SLEWCTL);
    return run(arguments);
  };
  const std::string history = (here.path() / "plan.svg").string(), cube = (here.path() / "cube.svg").string();
  const Finished planned = ctl({"plan", "--preset", kQuick, "--json", "--plot", history, "--cube", cube});
  EXPECT_EQ(planned.exit_code, 0) << planned.errors;
  EXPECT_NEAR(json::parse(planned.output).at("time_s").get<double>(), 2.42111655, 2e-5);
  for (const std::string& picture : {history, cube}) EXPECT_GT(std::filesystem::file_size(picture), 5000u);
  EXPECT_EQ(ctl({"plan", "--preset", "agrawal-bang-1995/rigid-single-sided"}).exit_code, 2);
  EXPECT_EQ(ctl({"plan", "--preset", kQuick, "--set", "guidance.longest_s=1"}).exit_code, 2);
  std::vector<std::string> endless{"plan", "--timeout", "0.5", "--json"};
  endless.insert(endless.end(), kEndless.begin(), kEndless.end());
  const Finished cut = ctl(endless);
  EXPECT_EQ(json::parse(cut.output).at("search").at("ended_by"), "time_budget");
}

}  // namespace
