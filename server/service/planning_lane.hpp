// Planning before flight: one thread that takes what processors have left, so that no paced experiment is
// late for a plan, and no as-fast one waits behind it.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "server/service/flight.hpp"
#include "server/service/plan_cache.hpp"

namespace slew::service {

class PlanningLane {
 public:
  struct Outlets {
    std::function<void(const FlightPointer&)> planned;  ///< may fly now
    std::function<void(const FlightPointer&)> over;     ///< called off, or nothing was found
    std::function<void(const FlightPointer&)> news;     ///< it began to be planned, or got on
  };

  PlanningLane(std::filesystem::path cache_directory, Outlets outlets);
  /// What is left stays as it is: a restart plans it.
  ~PlanningLane();

  void submit(FlightPointer flight);
  /// One that waits and was called off: its turn is now.
  void expedite(const FlightPointer& flight);

  /// From now on nothing is planned any more; those that are called off still end.
  void close() { closed_ = true; }

  /// Waiting and under way.
  std::size_t size() const;

 private:
  void work();
  void plan(const FlightPointer& flight);

  const Outlets outlets_;
  PlanCache cache_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<FlightPointer> waiting_;
  bool is_planning_ = false;
  bool stopping_ = false;
  std::atomic<bool> closed_{false};
  std::thread thread_;
};

}  // namespace slew::service
