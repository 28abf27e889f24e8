// Many clients at once, some of them bad: nothing is lost, and nobody's numbers change.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";

// A test client in the server's domain, its report going to a file.
class Client {
 public:
  Client(const ServerUnderTest& server, const std::string& program, std::vector<std::string> arguments)
      : output_(server.state() / (program + std::to_string(++number))) {
    arguments.insert(arguments.begin(), {std::string(SLEW_CLIENTS) + "/" + program, "--domain",
                                         std::to_string(server.domain()), "--json"});
    process_ = Process(arguments, output_);
  }
  int wait() { return process_.wait(std::chrono::minutes(5)); }
  json report() const {
    std::ifstream file(output_);
    std::string last, line;
    while (std::getline(file, line))
      if (!line.empty() && line.front() == '{') last = line;
    return json::parse(last, nullptr, false);
  }
  void signal(int number_of_signal) const { process_.signal(number_of_signal); }

 private:
  inline static int number = 0;
  std::filesystem::path output_;
  Process process_;
};

void settle() {
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
}

json digest_of(const json& result) {
  return result.at("provenance").at("digest");
}

TEST(Clients, ExplainThemselves) {
  for (const char* program : {"requester", "recorder", "stalling_subscriber", "garbage_writer", "census"}) {
    const std::string path = std::string(SLEW_CLIENTS) + "/" + program;
    const Finished help = run({path, "--help"});
    EXPECT_EQ(help.exit_code, 0) << program;
    EXPECT_NE(help.output.find("--domain"), std::string::npos) << program;
    EXPECT_EQ(run({path, "--no-such-option"}).exit_code, 2) << program;
  }
  const DomainLease nobody;
  EXPECT_EQ(run({std::string(SLEW_CLIENTS) + "/requester", "--domain", std::to_string(nobody.domain()),
                 "--for", "1"})
                .exit_code,
            3);
}

TEST(Clients, RequesterAndRecorderCountTheSame) {
  const ServerUnderTest server;
  Client recorder(server, "recorder", {"--until-ended", "60", "--for", "120"});
  settle();
  // Under sanitizers a paced one may cost more than there is, and be refused.
  const char* const paced = SLEW_IS_SANITIZED ? "0" : "0.15";
  Client requester(server, "requester", {"--count", "60", "--paced", paced, "--for", "120"});
  EXPECT_EQ(requester.wait(), 0);
  EXPECT_EQ(recorder.wait(), 0);
  const json asked = requester.report(), heard = recorder.report();
  EXPECT_EQ(asked.at("accepted"), 60);
  EXPECT_EQ(asked.at("ended").at("completed"), 60);
  EXPECT_EQ(heard.at("ended"), 60);
  EXPECT_EQ(heard.at("missing"), 0);
  EXPECT_TRUE(heard.at("sound").get<bool>());
  for (const json& one : heard.at("experiments")) {
    EXPECT_EQ(one.at("received"), one.at("published")) << one;
    EXPECT_EQ(one.at("thrusters_received"), one.at("published")) << one;
    EXPECT_EQ(one.at("lost"), 0) << one;
  }
}

TEST(Clients, GarbageHarmsNobody) {
  const ServerUnderTest server;
  Client garbage(server, "garbage_writer", {"--count", "2000", "--seed", "4", "--for", "60"});
  Client requester(server, "requester", {"--count", "60", "--for", "120"});
  EXPECT_EQ(garbage.wait(), 0);
  EXPECT_EQ(garbage.report().at("sent"), 2000);
  EXPECT_EQ(requester.wait(), 0);
  const json asked = requester.report();
  // Under sanitizers a paced one may cost more than there is, and is told so.
  const long busy = SLEW_IS_SANITIZED ? asked.at("rejected").value("busy", 0) : 0;
  EXPECT_EQ(asked.at("ended").at("completed").get<long>() + busy, 60) << asked;
  const json status = server.document({"server"}).at(0);
  EXPECT_GT(status.at("malformed").get<long>(), 0);
  EXPECT_GT(status.at("rejected").get<long>(), 0);
}

TEST(Clients, WhoStallsOrDiesChangesNoNumbers) {
  const ServerUnderTest server;
  const std::vector<std::string> request{
      "run", "--preset", kPreset, "--set", "timing.mode=real_time", "--set", "telemetry.publish_max_hz=100"};
  const json alone = server.document(request);
  Client stalled(server, "stalling_subscriber", {"--after", "0.3", "--for", "8", "--lossless"});
  Client dying(server, "stalling_subscriber", {"--after", "0.3", "--for", "2", "--die"});
  Client stopped(server, "stalling_subscriber", {"--after", "20", "--for", "20"});
  settle();
  stopped.signal(SIGSTOP);
  const json beside = server.document(request);
  EXPECT_EQ(digest_of(beside), digest_of(alone));
  EXPECT_EQ(beside.at("metrics"), alone.at("metrics"));
  stopped.signal(SIGKILL);
  EXPECT_EQ(dying.wait(), 0);
  EXPECT_EQ(stalled.wait(), 0);
}

// One client's flood: all of it answered, and another's one a second hardly waits.
TEST(Clients, AFloodDelaysNobodyElse) {
  const ServerUnderTest server;
  // Sanitizers make everything several times slower.
  const long count = SLEW_IS_SANITIZED ? 2000 : 10000;
  const double patience_s = SLEW_IS_SANITIZED ? 20 : 2;
  Client flood(server, "requester",
               {"--count", std::to_string(count), "--paced", "0", "--preset", kPreset, "--client-id", "flood",
                "--for", "280"});
  Client other(server, "requester",
               {"--count", "8", "--per-second", "1", "--paced", "0", "--preset", kPreset, "--client-id",
                "other", "--for", "280"});
  EXPECT_EQ(other.wait(), 0);
  EXPECT_EQ(flood.wait(), 0);
  const json flooded = flood.report(), others = other.report();
  EXPECT_EQ(flooded.at("unanswered"), 0);
  EXPECT_EQ(flooded.at("ended").value("completed", 0) + flooded.at("rejected").value("busy", 0), count)
      << flooded;
  EXPECT_EQ(others.at("ended").at("completed"), 8);
  EXPECT_LE(others.at("to_end_s").at("max").get<double>(), patience_s) << others;
  EXPECT_LT(server.document({"server"}).at(0).at("resident_bytes").get<double>(), 1e9);
}

}  // namespace
