// The contract of slewctl: what it prints, and how it ends.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>

#include "server/experiment/schema.hpp"
#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";

TEST(CommandLine, RunPrintsOneResultDocument) {
  const ServerUnderTest server;
  const json result = server.document({"run", "--preset", kPreset, "--verify"});
  EXPECT_EQ(result.at("phase"), "completed");
  EXPECT_NEAR(result.at("metrics").at("first_rest_s").get<double>(), 2.05223, 5e-3);
  EXPECT_TRUE(schema_violations("result", result).empty());
  EXPECT_TRUE(result.at("verification").at("same_event_sequence").get<bool>());
  EXPECT_EQ(result.at("provenance").at("request").at("simulation").at("seed"), 0);
  EXPECT_EQ(result, server.document({"result", result.at("experiment_id").get<std::string>().substr(0, 20)}));
}

TEST(CommandLine, SubmitListShowHistorySeries) {
  const ServerUnderTest server;
  const json submitted = server.document({"submit", "--preset", kPreset, "--set", "label=mine"});
  EXPECT_EQ(submitted.size(), 3u);
  EXPECT_EQ(submitted.at("phase"), "accepted");
  const std::string id = submitted.at("experiment_id");
  for (int i = 0; i < 100; ++i) {
    if (server.document({"show", id}).at("phase") == "completed") break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const json shown = server.document({"show", submitted.at("request_id")});
  EXPECT_EQ(shown.at("experiment_id"), id);
  EXPECT_EQ(shown.at("label"), "mine");
  EXPECT_EQ(shown.at("request").at("plant").at("inertia_kg_m2"), 1);
  for (const char* command : {"list", "history"}) {
    const json listed = server.document({command});
    EXPECT_EQ(listed.at("total"), 1);
    EXPECT_EQ(listed.at("experiments").at(0).at("experiment_id"), id);
    EXPECT_EQ(listed.at("experiments").at(0).at("phase"), "completed");
  }
  const json series =
      server.document({"series", id, "--channels", "angle_rad,torque_N_m", "--max-samples", "50"});
  EXPECT_EQ(series.at("t_s").size(), 50u);
  EXPECT_EQ(series.at("columns").size(), 2u);
  EXPECT_EQ(series.at("t_s").front(), 0);
  EXPECT_NEAR(series.at("t_s").back().get<double>(), 2.05, 1e-3);
  EXPECT_EQ(server.ctl({"series", id, "--channels", "no_such"}).exit_code, 2);
  const auto csv = server.ctl({"series", id});
  EXPECT_TRUE(csv.output.starts_with("t_s,angle_rad,rate_rad_s"));
}

TEST(CommandLine, ExitCodesTellWhatHappened) {
  const ServerUnderTest server;
  EXPECT_EQ(server.ctl({"run", "--preset", kPreset}).exit_code, 0);
  EXPECT_EQ(server.ctl({"run", "--no-such-option"}).exit_code, 2);
  EXPECT_EQ(server.ctl({}).exit_code, 2);
  EXPECT_EQ(server.ctl({"--help"}).exit_code, 0);
  EXPECT_EQ(server.ctl({"run", "--preset", "no-such-preset"}).exit_code, 2);
  EXPECT_EQ(server.ctl({"result", "0000000000"}).exit_code, 2);
  EXPECT_EQ(server.ctl({"run", "--preset", kPreset, "--set", "timing.mode=real_time", "--timeout", "0.3"})
                .exit_code,
            4);
  // Cancelled while somebody waits for it.
  Process waiting(server.ctl_command({"run", "--preset", kPreset, "--set", "timing.mode=real_time", "--set",
                                      "label=victim", "--set", "stop.when=duration", "--set",
                                      "simulation.duration_s=60"}),
                  server.state() / "waiting");
  std::string victim;
  for (int i = 0; i < 200 && victim.empty(); ++i) {
    const json listed = server.document({"list"});
    for (const json& entry : listed.at("experiments"))
      if (entry.at("label") == "victim" && entry.at("phase") == "running") victim = entry.at("experiment_id");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_FALSE(victim.empty()) << server.log();
  EXPECT_EQ(server.ctl({"cancel", victim}).exit_code, 0);
  EXPECT_EQ(waiting.wait(std::chrono::seconds(10)), 5);
  EXPECT_EQ(server.document({"result", victim}).at("phase"), "cancelled");
  EXPECT_EQ(server.ctl({"cancel", victim}).exit_code, 2);
}

TEST(CommandLine, WithoutAServerItSaysSo) {
  const ServerUnderTest server({}, false);
  const auto finished = server.ctl({"run", "--preset", kPreset, "--connect", "0.5"});
  EXPECT_EQ(finished.exit_code, 3);
  EXPECT_NE(finished.errors.find("not permitted"), std::string::npos);
  EXPECT_EQ(server.ctl({"doctor", "--connect", "0.5"}).exit_code, 3);
  EXPECT_EQ(server.ctl({"presets"}).exit_code, 0);
  EXPECT_EQ(server.ctl({"schema", "limits"}).exit_code, 0);
  EXPECT_EQ(server.ctl({"describe", "--preset", kPreset}).exit_code, 0);
  EXPECT_EQ(server.ctl({"validate", "-"}, "{}").exit_code, 2);
}

TEST(CommandLine, ModelNeedsNoServer) {
  const ServerUnderTest server({}, false);
  const std::string preset = "agrawal-bang-1995/flexible-frame-elbow-heavy";
  const json model = server.document({"model", "--preset", preset, "--set", "plant.modes_kept=2"});
  EXPECT_EQ(model.at("plant").at("couplings_sqrt_kg_m").size(), 2u);
  EXPECT_NEAR(model.at("frame").at("modal_inertia_kg_m2").get<double>(), 6.8519, 2e-4);
  EXPECT_NE(server.ctl({"model", "--preset", preset}).output.find("hub free, Hz"), std::string::npos);

  const auto refused =
      server.ctl({"model", "--json", "--preset", preset, "--set", "plant.beams.2.to_node=7"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_EQ(json::parse(refused.output).at("violations").at(0).at("pointer"), "/plant/beams/2/to_node");
  EXPECT_EQ(server.ctl({"model", "-"}, "{}").exit_code, 2);
  EXPECT_EQ(server.ctl({"model", "-"}, "no JSON").exit_code, 2);
}

TEST(CommandLine, EveryCommandHasHelpWithAnExample) {
  const ServerUnderTest server({}, false);
  for (const char* command :
       {"run",    "submit",   "result",   "show",  "list",   "history", "series", "export",
        "plot",   "watch",    "cancel",   "pause", "resume", "step",    "rate",   "presets",
        "schema", "validate", "describe", "model", "server", "doctor"}) {
    const auto help = server.ctl({command, "--help"});
    EXPECT_EQ(help.exit_code, 0) << command;
    EXPECT_NE(help.output.find("Example: slewctl"), std::string::npos) << command;
  }
}

TEST(CommandLine, DrawsAPicture) {
  const ServerUnderTest server;
  for (const char* name : {"slew.png", "slew.svg"}) {
    const auto picture = server.state() / name;
    EXPECT_EQ(server.ctl({"run", "--preset", kPreset, "--plot", picture.string()}).exit_code, 0);
    EXPECT_GT(std::filesystem::file_size(picture), 5000u);
  }
  // Where nobody set a locale, too, there is nothing to warn of.
  std::vector<std::string> plain{"/usr/bin/env", "LC_ALL=C"};
  for (const std::string& argument : server.ctl_command(
           {"run", "--quiet", "--preset", kPreset, "--plot", (server.state() / "c.png").string()}))
    plain.push_back(argument);
  EXPECT_EQ(run(plain).errors.find("warning"), std::string::npos);
  EXPECT_EQ(server.ctl({"run", "--preset", kPreset, "--plot", "slew.doc"}).exit_code, 2);
  EXPECT_NE(server.ctl({"run", "--preset", kPreset, "--plot", "-"}).output.find("deg"), std::string::npos);
}

TEST(CommandLine, DoctorAndServerSeeIt) {
  const ServerUnderTest server;
  EXPECT_TRUE(server.document({"doctor"}).at("good").get<bool>());
  EXPECT_EQ(server.document({"server"}).at(0).at("draining"), false);
}

// The form for people, of every command that prints one.
TEST(CommandLine, EveryCommandSpeaksToPeople) {
  const ServerUnderTest server;
  const std::string preset = "agrawal-bang-1995/rigid-single-sided";
  const std::string id = server.document({"run", "--preset", preset}).at("experiment_id");
  const auto request = server.state() / "request.json";
  std::ofstream(request) << R"({"preset":"agrawal-bang-1995/rigid-single-sided"})";
  const std::vector<std::vector<std::string>> commands = {{"presets"},
                                                          {"presets", "show", preset},
                                                          {"schema"},
                                                          {"schema", "request"},
                                                          {"schema", "limits"},
                                                          {"validate", request.string()},
                                                          {"describe", "--preset", preset},
                                                          {"model", "--preset", preset},
                                                          {"server"},
                                                          {"doctor"},
                                                          {"list"},
                                                          {"history"},
                                                          {"show", id},
                                                          {"result", id},
                                                          {"series", id},
                                                          {"plot", id},
                                                          {"watch", id},
                                                          {"run", "--preset", preset, "--verify"},
                                                          {"run", "--preset", preset, "--plot", "-"}};
  for (const auto& command : commands) {
    const Finished finished = server.ctl(command);
    EXPECT_EQ(finished.exit_code, 0) << command.front() << ": " << finished.errors;
    EXPECT_GT(finished.output.size(), 10u) << command.front();
  }
}

TEST(CommandLine, ABadProfileIsToldInDdsOwnWords) {
  const ServerUnderTest server({}, false);
  const auto profile = server.state() / "bad.xml";
  std::ofstream(profile) << "<CycloneDDS><Domain><Generl/></Domain></CycloneDDS>";
  const auto finished = server.ctl({"list", "--dds-profile", profile.string()});
  EXPECT_EQ(finished.exit_code, 3);
  EXPECT_NE(finished.errors.find("Generl"), std::string::npos);
}

}  // namespace
