#include "tests/service/server_under_test.hpp"

#include <gtest/gtest.h>

#include <signal.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <sstream>

namespace slew::test {

ServerUnderTest::ServerUnderTest(std::vector<std::string> arguments, bool start_now,
                                 std::vector<std::string> prefix)
    : arguments_(std::move(arguments)), prefix_(std::move(prefix)) {
  if (start_now) start();
}

std::vector<std::string> ServerUnderTest::command() const {
  std::vector<std::string> line = prefix_;
  line.insert(line.end(), {SLEWD, "--domain", std::to_string(domain()), "--state-dir", state().string()});
  line.insert(line.end(), arguments_.begin(), arguments_.end());
  return line;
}

void ServerUnderTest::start() {
  process_ = Process(command(), state() / "log");
  const auto answer = ctl({"list", "--connect", "60", "--limit", "1"});
  if (answer.exit_code != 0) throw std::runtime_error("the server does not answer: " + answer.errors + log());
}

int ServerUnderTest::stop() {
  process_.signal(SIGTERM);
  const int code = process_.wait(std::chrono::seconds(60));
  // A sanitizer's findings are in there.
  if (code != 0)
    std::cerr << "the server ended with " << code << "; the end of its log:\n" << log().substr(0, 20000);
  return code;
}

void ServerUnderTest::kill() {
  process_.signal(SIGKILL);
  process_.wait(std::chrono::seconds(10));
}

std::string ServerUnderTest::log() const {
  std::ostringstream text;
  text << std::ifstream(state() / "log").rdbuf();
  return text.str();
}

std::vector<std::string> ServerUnderTest::ctl_command(std::vector<std::string> arguments) const {
  arguments.insert(arguments.begin(), SLEWCTL);
  // On a machine with much else to do, they find each other slowly.
  if (std::find(arguments.begin(), arguments.end(), "--connect") == arguments.end())
    arguments.insert(arguments.end(), {"--connect", "20"});
  arguments.insert(arguments.end(), {"--domain", std::to_string(domain())});
  return arguments;
}

Finished ServerUnderTest::ctl(std::vector<std::string> arguments, const std::string& input) const {
  return run(ctl_command(std::move(arguments)), input);
}

nlohmann::json ServerUnderTest::document(std::vector<std::string> arguments, const std::string& input) const {
  arguments.emplace_back("--json");
  const Finished finished = ctl(arguments, input);
  EXPECT_EQ(finished.exit_code, 0) << finished.errors;
  auto parsed = nlohmann::json::parse(finished.output, nullptr, false);
  EXPECT_FALSE(parsed.is_discarded()) << finished.output;
  return finished.exit_code == 0 ? parsed : nlohmann::json();
}

std::unique_ptr<client::Session> ServerUnderTest::session(const std::string& client_id) const {
  client::SessionOptions options;
  options.domain.domain = domain();
  options.client_id = client_id;
  auto session = std::make_unique<client::Session>(options);
  if (!session->wait_for_server(std::chrono::seconds(30))) throw std::runtime_error("no server is matched");
  return session;
}

}  // namespace slew::test
