// A network between client and server that loses one datagram in twenty each way, and one that is cut for a
// while: slower, never wrong, and nothing that was promised is lost.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "tests/service/server_under_test.hpp"
#include "tests/service/two_hosts.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";

class Network : public testing::Test {
 protected:
  void SetUp() override {
    if (!hosts_.why_not().empty()) GTEST_SKIP() << "NOT TESTED OVER A BAD NETWORK: " << hosts_.why_not();
    ASSERT_TRUE(hosts_.lose(0)) << "nftables do not work here";
    start();
  }
  void start() {
    server_ = Process(hosts_.on_ship({SLEWD, "--domain", "6", "--state-dir", state_.path().string()}),
                      state_.path() / "log");
    ASSERT_EQ(ctl({"list"}).exit_code, 0);
  }
  // The namespace's own command is what was started; the server took its place.
  void kill() {
    server_.signal(SIGKILL);
    server_.wait(std::chrono::seconds(10));
  }
  std::vector<std::string> ctl_command(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {SLEWCTL, "--domain", "6", "--connect", "30"});
    return hosts_.on_ground(arguments);
  }
  Finished ctl(std::vector<std::string> arguments) const { return run(ctl_command(std::move(arguments))); }
  Process client(const std::string& program, std::vector<std::string> arguments,
                 const std::filesystem::path& output) const {
    arguments.insert(arguments.begin(),
                     {std::string(SLEW_CLIENTS) + "/" + program, "--domain", "6", "--json"});
    return Process(hosts_.on_ground(arguments), output);
  }
  json report(const std::filesystem::path& output) const {
    std::ostringstream text;
    text << std::ifstream(output).rdbuf();
    return json::parse(text.str(), nullptr, false);
  }
  json digest() {
    const Finished finished = ctl({"run", "--json", "--preset", kPreset});
    EXPECT_EQ(finished.exit_code, 0) << finished.errors;
    return json::parse(finished.output).at("provenance").at("digest");
  }

  TwoHosts hosts_;
  TemporaryDirectory state_;
  Process server_;
};

TEST_F(Network, ThatLosesFivePercentEachWayLosesNothingThatIsReliable) {
  const json well = digest();
  ASSERT_TRUE(hosts_.lose(5));
  const auto heard = state_.path() / "heard", asked = state_.path() / "asked";
  Process recorder = client("recorder", {"--for", "40", "--until-ended", "26"}, heard);
  std::this_thread::sleep_for(std::chrono::seconds(3));
  Process requester = client(
      "requester",
      {"--count", "25", "--per-second", "5", "--paced", "0.2", "--preset", kPreset, "--for", "120"}, asked);
  EXPECT_EQ(requester.wait(std::chrono::seconds(150)), 0) << report(asked);
  EXPECT_EQ(report(asked).at("unanswered"), 0);
  EXPECT_EQ(report(asked).at("submitted"), 25);
  EXPECT_EQ(digest(), well);
  // Queries of many pages, and telemetry at a rate that a person watches.
  EXPECT_EQ(ctl({"history", "--json"}).exit_code, 0);
  EXPECT_EQ(recorder.wait(std::chrono::seconds(60)), 0);
  const json told = report(heard);
  EXPECT_TRUE(told.at("sound").get<bool>());
  // Some are not to be published at all; the first ones were over before the recorder came.
  int published = 0, whole = 0;
  for (const json& one : told.at("experiments")) {
    EXPECT_EQ(one.at("out_of_order"), 0);
    published += one.at("published").get<long>() > 0;
    whole += one.at("published").get<long>() > 0 && one.at("received") == one.at("published");
  }
  EXPECT_GT(published, 10);
  EXPECT_GE(whole, published - 2) << told;
}

TEST_F(Network, ThatIsCutForAWhileLosesNothingThatWasAccepted) {
  const json well = digest();
  // For less than a lease and for more.
  for (const int cut_s : {2, 8}) {
    SCOPED_TRACE(cut_s);
    const auto output = state_.path() / ("run" + std::to_string(cut_s));
    Process waiting(ctl_command({"run", "--json", "-q", "--preset", kPreset, "--set", "timing.mode=scaled",
                                 "--set", "timing.rate=0.5"}),
                    output);
    // Until it flies; then nobody hears anybody.
    for (int i = 0; i < 400; ++i) {
      const Finished listed = ctl({"list", "--json", "--phase", "running"});
      if (listed.exit_code == 0 && json::parse(listed.output).at("total") == 1) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    ASSERT_TRUE(hosts_.lose(100));
    std::this_thread::sleep_for(std::chrono::seconds(cut_s));
    EXPECT_TRUE(waiting.is_running());
    ASSERT_TRUE(hosts_.lose(0));
    EXPECT_EQ(waiting.wait(std::chrono::seconds(60)), 0);
    EXPECT_EQ(report(output).at("provenance").at("digest"), well);
  }
}

TEST_F(Network, ThatIsCutWhileTheServerIsKilledIsOutlived) {
  const auto output = state_.path() / "run";
  Process waiting(ctl_command({"run", "--json", "-q", "--preset", kPreset, "--set", "timing.start=held"}),
                  output);
  std::string id;
  for (int i = 0; i < 400 && id.empty(); ++i) {
    const Finished listed = ctl({"list", "--json", "--phase", "held"});
    if (const json held = json::parse(listed.output, nullptr, false);
        !held.is_discarded() && held["total"] == 1)
      id = held.at("experiments").at(0).at("experiment_id");
  }
  ASSERT_FALSE(id.empty());
  ASSERT_TRUE(hosts_.lose(100));
  kill();
  ASSERT_TRUE(hosts_.lose(0));
  start();
  EXPECT_EQ(ctl({"resume", id}).exit_code, 0);
  EXPECT_EQ(waiting.wait(std::chrono::seconds(60)), 0);
  EXPECT_EQ(report(output).at("phase"), "completed");
}

TEST_F(Network, ThatIsCutTellsWhoComesThatThereIsNobody) {
  ASSERT_TRUE(hosts_.lose(100));
  auto command = ctl_command({"run", "--preset", kPreset});
  *std::find(command.begin(), command.end(), "30") = "2";
  const Finished tried = run(command);
  EXPECT_EQ(tried.exit_code, 3);
  EXPECT_NE(tried.errors.find("no server in domain"), std::string::npos) << tried.errors;
}

}  // namespace
