// From another host: two network namespaces with a cable between them, and nothing shared but the programs.
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/service/process.hpp"
#include "tests/service/server_under_test.hpp"
#include "tests/service/two_hosts.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";
class SecondHost : public testing::Test {
 protected:
  void SetUp() override {
    if (!hosts_.why_not().empty()) GTEST_SKIP() << "NOT TESTED FROM A SECOND HOST: " << hosts_.why_not();
    server_ = Process(hosts_.on_ship({SLEWD, "--domain", "5", "--state-dir", state_.path().string()}),
                      state_.path() / "log");
  }

  Finished ctl(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {SLEWCTL, "--domain", "5", "--connect", "10"});
    return run(hosts_.on_ground(arguments));
  }
  json document(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "--json");
    const Finished finished = ctl(std::move(arguments));
    EXPECT_EQ(finished.exit_code, 0) << finished.errors;
    return json::parse(finished.output, nullptr, false);
  }

  TwoHosts hosts_;
  TemporaryDirectory state_;
  Process server_;
};

TEST_F(SecondHost, DoesEverything) {
  ASSERT_EQ(ctl({"doctor"}).exit_code, 0) << ctl({"doctor"}).output;

  // Submit, watch, result: the bits are those of this host.
  const json submitted = document({"submit", "--preset", kPreset, "--set", "timing.mode=real_time"});
  const std::string id = submitted.at("experiment_id");
  const Finished watched = ctl({"watch", id, "--csv", "--for", "30"});
  EXPECT_EQ(watched.exit_code, 0) << watched.errors;
  EXPECT_NE(watched.output.find("angle_rad"), std::string::npos) << watched.output;
  EXPECT_GT(std::count(watched.output.begin(), watched.output.end(), '\n'), 50);
  const json result = document({"result", id});
  const ServerUnderTest here;
  EXPECT_EQ(result.at("provenance").at("digest"),
            here.document({"run", "--preset", kPreset}).at("provenance").at("digest"));

  // What is archived comes over the wire too.
  const json series = document({"series", id});
  EXPECT_EQ(series.at("t_s").size(), 206u);
  EXPECT_EQ(ctl({"plot", id, "slew.png"}).exit_code, 0);
  EXPECT_GT(std::filesystem::file_size(hosts_.home() / "slew.png"), 5000u);
  EXPECT_EQ(ctl({"export", id, "--csv", "slew.csv", "--hdf5", "slew.h5"}).exit_code, 0);
  EXPECT_GT(std::filesystem::file_size(hosts_.home() / "slew.csv"), 5000u);
  EXPECT_EQ(document({"show", id}).at("phase"), "completed");
  EXPECT_EQ(document({"list"}).at("total"), 1);
  EXPECT_EQ(document({"history"}).at("experiments").at(0).at("experiment_id"), id);

  // Control.
  const std::string held =
      document({"submit", "--preset", kPreset, "--set", "timing.start=held"}).at("experiment_id");
  EXPECT_EQ(ctl({"resume", held}).exit_code, 0);
  const std::string cancelled =
      document({"submit", "--preset", kPreset, "--set", "timing.start=held"}).at("experiment_id");
  EXPECT_EQ(ctl({"cancel", cancelled}).exit_code, 0);
  for (int i = 0; i < 200 && document({"show", cancelled}).at("phase") != "cancelled"; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(document({"show", cancelled}).at("phase"), "cancelled");
  EXPECT_EQ(document({"result", held}).at("phase"), "completed");

  // Bad requests are told from afar as well.
  EXPECT_EQ(ctl({"run", "--preset", "no/such"}).exit_code, 2);
}

}  // namespace
