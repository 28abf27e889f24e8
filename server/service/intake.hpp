// The intake: requests and controls as they come from the wire, to flights in the registry and the journal.
// Nothing is trusted, everything is answered.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

#include "idl/wire/reader.hpp"
#include "idl/wire/waitset.hpp"
#include "server/service/admission.hpp"
#include "server/service/journal.hpp"
#include "server/service/registry.hpp"
#include "server/service/replies.hpp"

namespace slew::service {

class Intake {
 public:
  /// What becomes of what it takes in. `launch` gets every flight whose acceptance is durable, from the
  /// journal's thread; `wish` what a control asks of one.
  struct Outlets {
    std::function<void(const FlightPointer&)> launch;
    std::function<void(const FlightPointer&, const Wishes&)> wish;
  };
  Intake(const wire::Domain& domain, Registry& registry, Journal& journal,
         const std::filesystem::path& journal_file, Admission& admission, SampleBudget& sample_budget,
         Replies& replies, Outlets outlets);
  ~Intake();

  /// From now on requests are refused with `draining`.
  void drain() { draining_ = true; }

  std::uint64_t accepted() const { return accepted_.load(std::memory_order_relaxed); }
  std::uint64_t rejected() const { return rejected_.load(std::memory_order_relaxed); }
  std::uint64_t malformed() const { return malformed_.load(std::memory_order_relaxed); }

 private:
  void serve();
  void on_request(const slew_v1_Request& request);
  void on_control(const slew_v1_Control& control);
  bool answer_again(const wire::Id& request_id, const std::string& fingerprint);
  std::optional<Saying> no_room_for(const Prepared& prepared, double load) const;
  void reject(const wire::Id& request_id, const Saying& saying);

  Registry& registry_;
  Journal& journal_;
  JournalReader known_;
  Admission& admission_;
  SampleBudget& sample_budget_;
  Replies& replies_;
  const Outlets outlets_;
  wire::Reader<slew_v1_Request> request_;
  wire::Reader<slew_v1_Control> control_;
  wire::Waitset waitset_;
  std::atomic<bool> draining_{false};
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> accepted_{0};
  std::atomic<std::uint64_t> rejected_{0};
  std::atomic<std::uint64_t> malformed_{0};
  std::thread thread_;
};

}  // namespace slew::service
