// The finisher: what is owed after a flight. Series to the archive, result to the journal, then the word.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "server/service/archive.hpp"
#include "server/service/flight.hpp"
#include "server/service/journal.hpp"

namespace slew::service {

class Finisher {
 public:
  /// `committed` is called, from the journal's thread, once the end of a flight is durable.
  Finisher(const Archive& archive, Journal& journal, std::function<void(FlightPointer)> committed);
  /// Finishes what it was given; what the disk refuses now is owed again after a restart.
  ~Finisher();

  void take(FlightPointer flight);
  /// Ends as interrupted, in the journal only, a flight that its lane does not let go of; `committed` is
  /// called once that is durable.
  void write_off(const FlightPointer& flight, std::function<void()> committed);
  /// Flights given and not yet committed.
  std::size_t backlog() const { return backlog_.load(std::memory_order_relaxed); }
  /// Waits until nothing is owed, at most this long.
  bool wait_until_idle(Monotonic::duration time);

 private:
  struct Refused {
    FlightPointer flight;
    JournalEntry entry;
  };

  void work();
  JournalEntry write_up(const FlightPointer& flight);
  void commit(const FlightPointer& flight, JournalEntry entry);

  const Archive& archive_;
  Journal& journal_;
  const std::function<void(FlightPointer)> committed_;
  std::atomic<std::size_t> backlog_{0};
  std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable idle_;
  std::deque<FlightPointer> waiting_;
  std::deque<Refused> refused_;       ///< by the disk; offered again
  std::size_t with_the_journal_ = 0;  ///< behind mutex_
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace slew::service
