#include "server/service/timetable.hpp"

#include <algorithm>

#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

constexpr std::int64_t kLongestLook_ns = 500'000'000;

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

void Timetable::at(std::int64_t unix_ns, std::function<void()> action) {
  {
    const std::lock_guard lock(mutex_);
    entries_.push({unix_ns, next_order_++, std::move(action)});
  }
  wake_.notify_one();
}

void Timetable::keep() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    if (entries_.empty()) {
      wake_.wait(lock);
      continue;
    }
    const std::int64_t left_ns = entries_.top().unix_ns - unix_ns();
    if (left_ns > 0) {
      wake_.wait_for(lock, std::chrono::nanoseconds(std::min(left_ns, kLongestLook_ns)));
      continue;
    }
    const auto action = entries_.top().action;
    entries_.pop();
    lock.unlock();
    action();
    lock.lock();
  }
}

}  // namespace slew::service
