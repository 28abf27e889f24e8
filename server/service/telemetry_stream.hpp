// Samples from a flight's ring to the wire, in batches, counted.
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

#include "idl/wire/writer.hpp"
#include "server/service/flight.hpp"

namespace slew::service {

/// For one thread; the counts are for any.
class TelemetryStream {
 public:
  explicit TelemetryStream(const wire::Domain& domain) : state_(domain), thrusters_(domain) {}

  /// Writes what is in the ring, in at most so many batches. Returns how many.
  std::size_t drain(Flight& flight, std::size_t most_batches = SIZE_MAX);

  /// The last of its samples is written: a writer keeps about 1 kB of every instance it does not let go of.
  void end(const Flight& flight);

  /// Whether every matched reliable reader has acknowledged everything within the time.
  bool wait_for_acknowledgements(dds_duration_t timeout) {
    return state_.wait_for_acknowledgements(timeout) && thrusters_.wait_for_acknowledgements(timeout);
  }

  std::uint64_t published() const { return published_.load(std::memory_order_relaxed); }
  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  void write(Flight& flight);

  wire::Writer<slew_v1_State> state_;
  wire::Writer<slew_v1_Thrusters> thrusters_;
  std::vector<double> row_, t_s_, state_values_, thruster_values_;
  std::atomic<std::uint64_t> published_{0};
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace slew::service
