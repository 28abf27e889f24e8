#include "server/service/as_fast_lane.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <limits>

#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

constexpr auto kSlice = std::chrono::milliseconds(1);
constexpr std::size_t kUnderWayPerClient = 8;
constexpr int kNice = 5;

}  // namespace

AsFastLane::AsFastLane(std::size_t workers, NextStage& next, BlackBox& black_box,
                       std::function<bool()> may_start)
    : next_(next), may_start_(std::move(may_start)) {
  for (std::size_t i = 0; i < workers; ++i)
    workers_.emplace_back([this, i, seat = black_box.seat()] {
      name_this_thread("worker-" + std::to_string(i));
      // Intake, publisher and DDS come first; this work takes what is left.
      setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
      work(seat);
    });
}

AsFastLane::~AsFastLane() {
  close();
}

void AsFastLane::close() {
  stop();
  for (auto& worker : workers_) worker.join();
  workers_.clear();
}

void AsFastLane::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
}

std::size_t AsFastLane::in_slice() const {
  const std::lock_guard lock(mutex_);
  std::size_t total = 0;
  for (const auto& [client, share] : shares_) total += share.in_slice;
  return total;
}

void AsFastLane::submit(FlightPointer flight) {
  {
    const std::lock_guard lock(mutex_);
    const std::string& client = flight->entry().client_id;
    Share& share = shares_[client];
    const bool was_idle = share.begun.empty() && share.waiting.empty();
    (flight->has_run() ? share.begun : share.waiting).push_back(std::move(flight));
    if (was_idle) turns_.push_back(client);
  }
  wake_.notify_one();
}

void AsFastLane::expedite(const FlightPointer& flight) {
  {
    const std::lock_guard lock(mutex_);
    const auto share = shares_.find(flight->entry().client_id);
    if (share == shares_.end()) return;
    auto& waiting = share->second.waiting;
    const auto place = std::find(waiting.begin(), waiting.end(), flight);
    if (place == waiting.end()) return;
    waiting.erase(place);
    if (waiting.empty() && share->second.begun.empty())
      turns_.erase(std::find(turns_.begin(), turns_.end(), flight->entry().client_id));
    called_off_.push_back(flight);
  }
  wake_.notify_one();
}

void AsFastLane::recheck() {
  { const std::lock_guard lock(mutex_); }  // a worker that has just asked is waiting now
  wake_.notify_all();
}

std::size_t AsFastLane::waiting() const {
  const std::lock_guard lock(mutex_);
  std::size_t total = 0;
  for (const auto& [client, share] : shares_) total += share.waiting.size();
  return total;
}

std::size_t AsFastLane::under_way() const {
  const std::lock_guard lock(mutex_);
  std::size_t total = 0;
  for (const auto& [client, share] : shares_) total += share.begun.size() + share.in_slice;
  return total;
}

// The next flight of the next client that has one to fly; null when there is none at the moment.
FlightPointer AsFastLane::take_turn() {
  if (!called_off_.empty()) {
    FlightPointer flight = std::move(called_off_.front());
    called_off_.pop_front();
    ++shares_[flight->entry().client_id].in_slice;
    return flight;
  }
  const bool may_start = may_start_();
  for (std::size_t looked_at = turns_.size(); looked_at > 0; --looked_at) {
    const std::string client = std::move(turns_.front());
    turns_.pop_front();
    Share& share = shares_[client];
    FlightPointer flight;
    // A new flight is begun before the begun ones take another turn: short ones get through.
    if (may_start && !share.waiting.empty() && share.begun.size() + share.in_slice < kUnderWayPerClient) {
      flight = std::move(share.waiting.front());
      share.waiting.pop_front();
    } else if (!share.begun.empty()) {
      flight = std::move(share.begun.front());
      share.begun.pop_front();
    }
    if (!share.begun.empty() || !share.waiting.empty()) turns_.push_back(client);
    if (flight) {
      ++share.in_slice;
      return flight;
    }
  }
  return nullptr;
}

void AsFastLane::work(const BlackBox::Seat& seat) {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    FlightPointer flight = take_turn();
    if (!flight) {
      wake_.wait(lock);
      continue;
    }
    lock.unlock();
    seat.take(flight->entry().experiment_id);
    SliceEnd end = begin_slice(flight, next_);
    if (end == SliceEnd::goes_on)
      end = flight->fly(std::numeric_limits<double>::infinity(), Monotonic::now() + kSlice);
    seat.leave();
    const std::string client = flight->entry().client_id;
    if (end == SliceEnd::over) next_.over(flight);
    lock.lock();
    const auto share = shares_.find(client);
    --share->second.in_slice;
    if (end == SliceEnd::goes_on) {
      if (share->second.begun.empty() && share->second.waiting.empty()) turns_.push_back(client);
      share->second.begun.push_back(std::move(flight));
    } else if (share->second.begun.empty() && share->second.waiting.empty() && share->second.in_slice == 0) {
      shares_.erase(share);
    }
    // Another worker may have found this client at its limit.
    wake_.notify_one();
  }
}

}  // namespace slew::service
