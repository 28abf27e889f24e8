// Who may do what with DDS Security on: operators request and control, viewers query and watch, nobody else
// gets anything.
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "idl/wire/identity.hpp"
#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";
const std::string kMake = std::string(SLEW_SOURCE_DIR) + "/deploy/security/make-identities";

// The identity of the programs that are started while it is there; none: a stranger.
class Acting {
 public:
  explicit Acting(const std::filesystem::path& identity) {
    if (const char* before = std::getenv("SLEW_SECURITY")) before_ = before;
    become(identity.string());
  }
  Acting(const Acting&) = delete;
  Acting& operator=(const Acting&) = delete;
  ~Acting() { become(before_); }

 private:
  static void become(const std::string& identity) {
    if (identity.empty())
      unsetenv("SLEW_SECURITY");
    else
      setenv("SLEW_SECURITY", identity.c_str(), 1);
  }
  std::string before_;
};

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

class Security : public testing::Test {
 protected:
  Security() : identities_(made("identities")), operator_(identities_ / "operator") {
    server_ = std::make_unique<ServerUnderTest>(
        std::vector<std::string>{"--security", (identities_ / "server").string()});
  }

  std::filesystem::path made(const std::string& name, std::vector<std::string> more = {}) {
    const auto directory = directory_.path() / name;
    std::vector<std::string> command{"/bin/bash", kMake, directory.string()};
    command.insert(command.end(), more.begin(), more.end());
    const Finished made = run(command);
    EXPECT_EQ(made.exit_code, 0) << made.errors;
    return directory;
  }
  // For who makes their own.
  std::filesystem::path copy_of(const std::string& identity, const std::string& name) const {
    std::filesystem::copy(identities_ / identity, directory_.path() / name);
    return directory_.path() / name;
  }

  Finished ctl(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--connect", "3"});
    return server_->ctl(arguments);
  }
  // Gets nothing, whatever is tried; is told so.
  void expect_nothing(const std::string& sentence) const {
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"list"}, {"run", "--preset", kPreset}, {"server"}}) {
      const Finished tried = ctl(command);
      EXPECT_EQ(tried.exit_code, 3) << command.front() << tried.output;
      EXPECT_NE(tried.errors.find(sentence), std::string::npos) << tried.errors;
      EXPECT_EQ(tried.output, "") << command.front();
    }
  }

  TemporaryDirectory directory_;
  const std::filesystem::path identities_;
  const Acting operator_;
  std::unique_ptr<ServerUnderTest> server_;
};

TEST_F(Security, AnOperatorDoesEverythingAndGetsTheSameBits) {
  // The recorder misses nothing.
  const auto heard = directory_.path() / "heard";
  Process recorder({std::string(SLEW_CLIENTS) + "/recorder", "--domain", std::to_string(server_->domain()),
                    "--until-ended", "5", "--for", "60", "--strict", "--json"},
                   heard);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  Process requester({std::string(SLEW_CLIENTS) + "/requester", "--domain", std::to_string(server_->domain()),
                     "--count", "5", "--paced", "0", "--for", "60"},
                    {});
  EXPECT_EQ(requester.wait(std::chrono::seconds(70)), 0);
  EXPECT_EQ(recorder.wait(std::chrono::seconds(70)), 0) << text_of(heard);
  const json result = server_->document({"run", "--preset", kPreset, "--set", "timing.mode=real_time"});
  EXPECT_EQ(result.at("phase"), "completed");
  const std::string held =
      server_->document({"submit", "--preset", kPreset, "--set", "timing.start=held"}).at("experiment_id");
  EXPECT_EQ(ctl({"cancel", held}).exit_code, 0);
  const std::string id = result.at("experiment_id");
  EXPECT_EQ(server_->document({"series", id}).at("t_s").size(), 206u);
  EXPECT_EQ(ctl({"doctor"}).exit_code, 0) << ctl({"doctor"}).output;
  // A server without it flies the same.
  const Acting nobody("");
  const ServerUnderTest open;
  EXPECT_EQ(open.document({"run", "--preset", kPreset}).at("provenance").at("digest"),
            result.at("provenance").at("digest"));
}

TEST_F(Security, AViewerQueriesAndWatchesButDoesNotCommand) {
  const std::string id = server_
                             ->document({"submit", "--preset", kPreset, "--set", "timing.mode=real_time",
                                         "--set", "stop.when=duration", "--set", "simulation.duration_s=600"})
                             .at("experiment_id");
  const Acting viewer(identities_ / "viewer");
  EXPECT_EQ(server_->document({"show", id}).at("phase"), "running");
  EXPECT_EQ(ctl({"history"}).exit_code, 0);
  EXPECT_EQ(ctl({"server"}).exit_code, 0);
  const Finished watched = ctl({"watch", id, "--csv", "--for", "4"});
  EXPECT_GT(std::count(watched.output.begin(), watched.output.end(), '\n'), 20) << watched.errors;
  for (const std::vector<std::string>& command : {std::vector<std::string>{"run", "--preset", kPreset},
                                                  {"submit", "--preset", kPreset},
                                                  {"cancel", id},
                                                  {"pause", id},
                                                  {"step", id, "1"},
                                                  {"rate", id, "2"}}) {
    const Finished refused = ctl(command);
    EXPECT_EQ(refused.exit_code, 3) << command.front();
    EXPECT_NE(refused.errors.find("may query and watch"), std::string::npos) << refused.errors;
  }
  EXPECT_EQ(server_->document({"show", id}).at("phase"), "running");
  EXPECT_EQ(server_->document({"history"}).at("total"), 1);
}

TEST_F(Security, AStrangerGetsNothing) {
  const Acting nobody("");
  expect_nothing("no server in domain");
  const Finished watched = ctl({"watch", "--all", "--csv", "--for", "3"});
  EXPECT_EQ(watched.output, "");
  // Not even what is kept for late joiners.
  EXPECT_EQ(run({std::string(SLEW_CLIENTS) + "/census", "--domain", std::to_string(server_->domain()),
                 "--for", "3"})
                .exit_code,
            3);
}

TEST_F(Security, AnotherAuthoritysOperatorGetsNothing) {
  const Acting other(made("others") / "operator");
  expect_nothing("no server in domain");
}

TEST_F(Security, TamperedPermissionsGetNothing) {
  const auto tampered = copy_of("viewer", "tampered");
  std::string text = text_of(tampered / "permissions.p7s");
  const auto place = text.find("slew/v1/query");
  ASSERT_NE(place, std::string::npos);
  std::ofstream(tampered / "permissions.p7s", std::ios::binary) << text.replace(place, 13, "slew/v1/requ*");
  const Acting forger(tampered);
  expect_nothing("tampered");
}

TEST_F(Security, AnothersPermissionsGetNothing) {
  const auto borrowed = copy_of("viewer", "borrowed");
  std::filesystem::copy_file(identities_ / "operator" / "permissions.p7s", borrowed / "permissions.p7s",
                             std::filesystem::copy_options::overwrite_existing);
  const Acting borrower(borrowed);
  expect_nothing("tampered");
}

// Who signs permissions of one's own under a certificate that is good: one's own side of DDS has no
// objection.
TEST_F(Security, SelfSignedPermissionsGetNothing) {
  const auto own = made("own");
  const Acting nobody("");
  std::string text = wire::Identity(identities_ / "viewer").joined_to(wire::loopback_profile());
  const auto swap = [&](const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    text.replace(at, from.size(), to);
  };
  const std::string good = (identities_ / "viewer").string();
  // The forged permissions name the viewer as an operator.
  const Finished forged =
      run({"/bin/bash", "-c",
           "cd '" + own.string() + "' && rm -r viewer && bash '" + kMake + "' . operator viewer"});
  ASSERT_EQ(forged.exit_code, 0) << forged.errors;
  swap("<PermissionsCA>file:" + good, "<PermissionsCA>file:" + (own / "viewer").string());
  swap("<Permissions>file:" + good, "<Permissions>file:" + (own / "viewer").string());
  swap("<Governance>file:" + good, "<Governance>file:" + (own / "viewer").string());
  const auto profile = directory_.path() / "profile.xml";
  std::ofstream(profile) << text;
  for (const char* command : {"list", "server"})
    EXPECT_EQ(ctl({"--dds-profile", profile.string(), command}).exit_code, 3);
  EXPECT_EQ(ctl({"--dds-profile", profile.string(), "run", "--preset", kPreset}).exit_code, 3);
}

TEST_F(Security, AnExpiredCertificateGetsNothing) {
  made("identities", {"operator", "late", "--days", "0"});
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  {
    const Acting late(identities_ / "late");
    expect_nothing("ran out on");
  }
  // Nor does one who does not look at dates.
  const Acting nobody("");
  const auto profile = directory_.path() / "profile.xml";
  const wire::Identity good(identities_ / "operator");
  std::string text = good.joined_to(wire::loopback_profile());
  const std::string from = (identities_ / "operator").string(), to = (identities_ / "late").string();
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  std::ofstream(profile) << text;
  EXPECT_EQ(ctl({"--dds-profile", profile.string(), "list"}).exit_code, 3);
}

TEST_F(Security, AServerWhoseCertificateRanOutDoesNotStart) {
  made("identities", {"server", "old", "--days", "0"});
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  const TemporaryDirectory state;
  const Finished refused = run({SLEWD, "--domain", "99", "--state-dir", state.path().string(), "--security",
                                (identities_ / "old").string()});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.errors.find("ran out on"), std::string::npos) << refused.errors;
  const Finished incomplete = run(
      {SLEWD, "--domain", "99", "--state-dir", state.path().string(), "--security", state.path().string()});
  EXPECT_EQ(incomplete.exit_code, 1);
  EXPECT_NE(incomplete.errors.find("ca.pem cannot be read"), std::string::npos) << incomplete.errors;
}

TEST_F(Security, TheEndOfTheCertificateIsAMetric) {
  const DomainLease other;
  const std::string port = std::to_string(18400 + other.domain());
  const ServerUnderTest server({"--security", (identities_ / "server").string(), "--metrics-port", port});
  const Finished got =
      run({"/usr/bin/curl", "-sS", "--noproxy", "*", "http://127.0.0.1:" + port + "/metrics"});
  const std::string name = "\nslewd_certificate_expires_time_seconds ";
  const auto place = got.output.find(name);
  ASSERT_NE(place, std::string::npos) << got.output;
  const wire::Identity identity(identities_ / "server");
  EXPECT_NEAR(std::stod(got.output.substr(place + name.size())),
              static_cast<double>(identity.expires_unix_s()), 86400);
  EXPECT_GT(identity.expires_unix_s(), std::time(nullptr) + 800 * 86400);
}

}  // namespace
