// Who is here: every flight from its reception until it is forgotten after its end.
#pragma once

#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/service/flight.hpp"

namespace slew::service {

/// Safe to use from several threads.
class Registry {
 public:
  void add(const FlightPointer& flight);
  /// It came to nothing: its acceptance could not be committed.
  void remove(const FlightPointer& flight);
  /// Ended: kept for a while, so that late joiners find it.
  void ended(const FlightPointer& flight);
  /// Removes and returns the ended flights beyond the newest `keep` or older than `age`.
  std::vector<FlightPointer> take_expired(std::size_t keep, Monotonic::duration age);

  FlightPointer by_experiment(const wire::Id& id) const;
  FlightPointer by_request(const wire::Id& id) const;

  /// Newest first; `phase` limits it to one. What is not accepted yet is left out.
  std::vector<FlightPointer> page(std::optional<wire::Phase> phase, std::size_t limit, std::size_t offset,
                                  std::size_t& total) const;
  /// Everything that was accepted and has not ended.
  std::vector<FlightPointer> alive() const;
  std::size_t alive_count() const;

 private:
  struct Ended {
    FlightPointer flight;
    Monotonic::time_point at;
  };

  mutable std::mutex mutex_;
  std::map<wire::Id, FlightPointer> by_experiment_;  // ids are ordered by time
  std::unordered_map<wire::Id, FlightPointer, wire::IdHash> by_request_;
  std::deque<Ended> ended_;
};

}  // namespace slew::service
