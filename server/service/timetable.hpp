// Things to do at a wall time, or after a while: departures that were asked for, and expiries.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <queue>
#include <thread>
#include <vector>

#include "server/service/clock.hpp"

namespace slew::service {

class Timetable {
 public:
  Timetable();
  /// What has not come due is dropped.
  ~Timetable();

  /// Calls `action` from the timetable's thread at `unix_ns` or, when that has passed, at once. Wall time, so
  /// that it follows the clock when somebody sets it; looked at twice a second.
  void at(std::int64_t unix_ns, std::function<void()> action);
  /// Calls `action` from the timetable's thread after a while that no setting of the clock changes.
  void after(Monotonic::duration while_, std::function<void()> action);

 private:
  struct Entry {
    std::int64_t at_ns;
    std::uint64_t order;  ///< entries of the same time keep their order
    std::function<void()> action;
    bool operator>(const Entry& other) const {
      return at_ns != other.at_ns ? at_ns > other.at_ns : order > other.order;
    }
  };
  using Entries = std::priority_queue<Entry, std::vector<Entry>, std::greater<>>;

  void add(Entries& entries, std::int64_t at_ns, std::function<void()> action);
  void keep();

  std::mutex mutex_;
  std::condition_variable wake_;
  Entries by_wall_, by_monotonic_;
  std::uint64_t next_order_ = 0;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace slew::service
