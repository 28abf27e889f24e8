#include "server/service/timetable.hpp"

#include <algorithm>

#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

constexpr std::int64_t kLongestLook_ns = 500'000'000;

std::int64_t monotonic_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Monotonic::now().time_since_epoch()).count();
}

}  // namespace

Timetable::Timetable()
    : thread_([this] {
        name_this_thread("timetable");
        keep();
      }) {}

Timetable::~Timetable() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void Timetable::add(Entries& entries, std::int64_t at_ns, std::function<void()> action) {
  {
    const std::lock_guard lock(mutex_);
    entries.push({at_ns, next_order_++, std::move(action)});
  }
  wake_.notify_one();
}

void Timetable::at(std::int64_t unix_ns, std::function<void()> action) {
  add(by_wall_, unix_ns, std::move(action));
}

void Timetable::after(Monotonic::duration while_, std::function<void()> action) {
  add(by_monotonic_, monotonic_ns() + std::chrono::nanoseconds(while_).count(), std::move(action));
}

void Timetable::keep() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    if (by_wall_.empty() && by_monotonic_.empty()) {
      wake_.wait(lock);
      continue;
    }
    const auto left_ns = [](const Entries& entries, std::int64_t now_ns) {
      return entries.empty() ? kLongestLook_ns : entries.top().at_ns - now_ns;
    };
    const std::int64_t wall_ns = left_ns(by_wall_, unix_ns());
    const std::int64_t next_ns = std::min(wall_ns, left_ns(by_monotonic_, monotonic_ns()));
    if (next_ns > 0) {
      wake_.wait_for(lock, std::chrono::nanoseconds(std::min(next_ns, kLongestLook_ns)));
      continue;
    }
    Entries& due = wall_ns <= 0 ? by_wall_ : by_monotonic_;
    const auto action = due.top().action;
    due.pop();
    lock.unlock();
    action();
    lock.lock();
  }
}

}  // namespace slew::service
