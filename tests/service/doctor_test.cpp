// What slewctl doctor says when something is wrong: a sentence that leads to it.
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "idl/wire/text.hpp"
#include "idl/wire/writer.hpp"
#include "tests/service/domain_lease.hpp"
#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

Finished doctor(std::uint32_t domain, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments{SLEWCTL,  "--domain", std::to_string(domain), "--connect", "1",
                                     "--json", "doctor"};
  arguments.insert(arguments.begin() + 1, more.begin(), more.end());
  return run(arguments);
}

// The first check that is not good; its own name is first.
json trouble(const Finished& finished) {
  EXPECT_EQ(finished.exit_code, 3) << finished.errors;
  const json document = json::parse(finished.output, nullptr, false);
  if (!document.is_object()) return nullptr;
  EXPECT_FALSE(document.at("good").get<bool>());
  for (const json& check : document.at("checks"))
    if (!check.at("good").get<bool>()) return check;
  return nullptr;
}

// Says that it is a server, and reads nothing.
class FakeServer {
 public:
  explicit FakeServer(const char* version) : domain_({lease_.domain(), ""}), health_(domain_) {
    slew_v1_Server status{};
    wire::Id::make().store(status.server_id);
    wire::store(version, status.version);
    health_.write(status);
  }
  std::uint32_t domain() const { return lease_.domain(); }

 private:
  DomainLease lease_;
  wire::Domain domain_;
  wire::Writer<slew_v1_Server> health_;
};

TEST(Doctor, FindsNothingWrong) {
  const ServerUnderTest server;
  const Finished finished = doctor(server.domain());
  EXPECT_EQ(finished.exit_code, 0) << finished.output;
  EXPECT_TRUE(json::parse(finished.output).at("good").get<bool>());
}

TEST(Doctor, WrongDomain) {
  const DomainLease nobody;
  const json found = trouble(doctor(nobody.domain()));
  EXPECT_EQ(found.at("check"), "hear a server");
  EXPECT_NE(found.at("found").get<std::string>().find("domain " + std::to_string(nobody.domain())),
            std::string::npos);
}

TEST(Doctor, WrongInterface) {
  const DomainLease nobody;
  const TemporaryDirectory directory;
  const auto profile = directory.path() / "profile.xml";
  std::ofstream(profile)
      << R"(<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="nowhere0"/>)"
      << "</Interfaces></General></Domain></CycloneDDS>";
  const json found = trouble(doctor(nobody.domain(), {"--dds-profile", profile.string()}));
  EXPECT_EQ(found.at("check"), "enter the domain");
  const auto words = found.at("found").get<std::string>();
  EXPECT_NE(words.find("nowhere0"), std::string::npos) << words;
  EXPECT_NE(words.find("lo"), std::string::npos) << words;
}

TEST(Doctor, VersionMismatch) {
  const FakeServer server("9.9.9");
  const json found = trouble(doctor(server.domain()));
  EXPECT_EQ(found.at("check"), "the same version");
  EXPECT_NE(found.at("found").get<std::string>().find("9.9.9"), std::string::npos);
}

TEST(Doctor, HeardButNotLetIn) {
  const FakeServer server(SLEW_VERSION);
  const json found = trouble(doctor(server.domain()));
  EXPECT_EQ(found.at("check"), "be let in");
  EXPECT_NE(found.at("found").get<std::string>().find("permissions"), std::string::npos);
}

}  // namespace
