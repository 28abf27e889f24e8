// A slewd of the test's own: its domain, its state, its process; and slewctl to talk to it.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/library/session.hpp"
#include "tests/service/domain_lease.hpp"
#include "tests/service/process.hpp"

namespace slew::test {

class ServerUnderTest {
 public:
  /// Started and answering, unless `start` is false.
  /// `prefix` stands before its command.
  explicit ServerUnderTest(std::vector<std::string> arguments = {}, bool start = true,
                           std::vector<std::string> prefix = {});

  /// Starts it (again) and waits until it answers.
  void start();
  /// What start() starts.
  std::vector<std::string> command() const;
  /// SIGTERM, and its exit code.
  int stop();
  /// SIGKILL.
  void kill();

  Process& process() { return process_; }
  std::uint32_t domain() const { return lease_.domain(); }
  const std::filesystem::path& state() const { return state_.path(); }
  std::string log() const;

  /// slewctl with these arguments, in this server's domain.
  Finished ctl(std::vector<std::string> arguments, const std::string& input = "") const;
  std::vector<std::string> ctl_command(std::vector<std::string> arguments) const;
  /// The same with --json, expecting exit code 0; null when it was another.
  nlohmann::json document(std::vector<std::string> arguments, const std::string& input = "") const;

  /// A client in this process; one per test program and domain at a time.
  std::unique_ptr<client::Session> session(const std::string& client_id = "test") const;

 private:
  DomainLease lease_;
  TemporaryDirectory state_;
  std::vector<std::string> arguments_, prefix_;
  Process process_;
};

}  // namespace slew::test
