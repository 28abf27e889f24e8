// A slewd whose system goes wrong when the test says so.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <stdexcept>

#include "tests/faults/fault_plan.hpp"
#include "tests/service/server_under_test.hpp"

namespace slew::test {

/// The plan, mapped from a file of its own.
class PlannedFaults {
 public:
  PlannedFaults() {
    const auto file = directory_.path() / "plan";
    const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0 || ::ftruncate(fd, sizeof(FaultPlan)) != 0) throw std::runtime_error("no room for a plan");
    void* memory = ::mmap(nullptr, sizeof(FaultPlan), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    ::close(fd);
    if (memory == MAP_FAILED) throw std::runtime_error("no room for a plan");
    plan_ = new (memory) FaultPlan;
  }
  PlannedFaults(const PlannedFaults&) = delete;
  PlannedFaults& operator=(const PlannedFaults&) = delete;
  ~PlannedFaults() { ::munmap(plan_, sizeof(FaultPlan)); }

  /// What stands before the command that is to suffer.
  std::vector<std::string> prefix() const {
    return {"/usr/bin/env", "LD_PRELOAD=" SLEW_FAULTY_SYSTEM,
            std::string(kFaultPlan) + "=" + (directory_.path() / "plan").string()};
  }
  void below(const std::filesystem::path& directory) {
    std::strncpy(plan_->under, directory.c_str(), sizeof plan_->under - 1);
  }
  void arm(Fault fault, std::int64_t nth = 0) {
    plan_->calls = plan_->injected = 0;
    plan_->nth = nth;
    plan_->fault = fault;
  }
  void disarm() { plan_->fault = Fault::none; }
  std::int64_t calls() const { return plan_->calls; }
  std::int64_t injected() const { return plan_->injected; }
  void set_clock_forward(std::int64_t seconds) { plan_->clock_offset_ns = seconds * 1'000'000'000; }

 private:
  TemporaryDirectory directory_;
  FaultPlan* plan_;
};

/// Not started yet: the plan has to know its directory first.
class FaultyServer {
 public:
  explicit FaultyServer(std::vector<std::string> arguments = {})
      : server(std::move(arguments), false, faults.prefix()) {
    faults.below(server.state());
  }
  PlannedFaults faults;
  ServerUnderTest server;
};

}  // namespace slew::test
