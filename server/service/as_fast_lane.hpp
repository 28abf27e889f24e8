// As-fast-as-possible work: a pool of workers that share it out in slices of at most 1 ms, fairly between
// clients, so that one client's ten thousand requests do not hold up another's one.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/service/black_box.hpp"
#include "server/service/flight.hpp"

namespace slew::service {

class AsFastLane {
 public:
  /// `may_start` is asked before a new flight is begun; while it says no, only flights already begun go on.
  AsFastLane(std::size_t workers, NextStage& next, BlackBox& black_box, std::function<bool()> may_start);
  /// Stops after the slices under way; what is unfinished stays as it is.
  ~AsFastLane();

  /// A new flight, or one whose parking has ended.
  void submit(FlightPointer flight);
  /// One that waits and was called off: its turn is now.
  void expedite(const FlightPointer& flight);
  /// Looks again whether new flights may start.
  void recheck();
  /// No slice is begun any more.
  void stop();
  /// Likewise, and waits for those under way. What is handed in later stays where it is.
  void close();
  /// Slices that have not come to their end.
  std::size_t in_slice() const;

  std::size_t waiting() const;
  std::size_t under_way() const;

 private:
  // A client's flights: begun ones take turns, at most kUnderWayPerClient at a time; the rest wait in order.
  struct Share {
    std::deque<FlightPointer> begun;
    std::deque<FlightPointer> waiting;
    std::size_t in_slice = 0;
  };

  void work(const BlackBox::Seat& seat);
  FlightPointer take_turn();

  NextStage& next_;
  const std::function<bool()> may_start_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::map<std::string, Share> shares_;
  std::deque<FlightPointer> called_off_;
  std::deque<std::string> turns_;  ///< clients with something to do, next first
  bool stopping_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace slew::service
