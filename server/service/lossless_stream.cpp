#include "server/service/lossless_stream.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "server/experiment/limits.hpp"
#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

constexpr auto kTick = std::chrono::milliseconds(1);
constexpr dds_duration_t kLook = DDS_MSECS(5);
// Of a flight, on the wire at once. Readers and the writer keep 256.
constexpr std::size_t kWindow = 64;

}  // namespace

LosslessStream::LosslessStream(const wire::Domain& domain, std::function<void(FlightPointer)> drained,
                               std::function<void(FlightPointer)> room_made)
    : stream_(domain),
      drained_(std::move(drained)),
      room_made_(std::move(room_made)),
      heard_(Monotonic::now()),
      thread_([this] {
        name_this_thread("lossless");
        work();
      }) {}

LosslessStream::~LosslessStream() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void LosslessStream::begun(const FlightPointer& flight) {
  {
    const std::lock_guard lock(mutex_);
    streaming_.push_back({flight});
  }
  wake_.notify_one();
}

void LosslessStream::over(const FlightPointer& flight) {
  {
    const std::lock_guard lock(mutex_);
    for (Streaming& one : streaming_)
      if (one.flight == flight) one.is_over = true;
  }
  wake_.notify_one();
}

void LosslessStream::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
}

void LosslessStream::flush(Monotonic::duration time) {
  std::unique_lock lock(mutex_);
  idle_.wait_for(lock, time, [this] {
    return std::none_of(streaming_.begin(), streaming_.end(),
                        [](const Streaming& one) { return one.is_over; });
  });
}

void LosslessStream::work() {
  while (true) {
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stopping_ || !streaming_.empty(); });
      if (stopping_) return;
      now_ = streaming_;
    }
    stream_all();
    hear_acknowledgements();
    hand_on();
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, kTick, [this] { return stopping_; });
  }
}

void LosslessStream::stream_all() {
  for (const Streaming& one : now_) {
    Flight& flight = *one.flight;
    const std::size_t window = given_up_ ? SIZE_MAX : kWindow - std::min(kWindow, flight.unacknowledged);
    flight.unacknowledged += stream_.drain(flight, window);
    const std::lock_guard lock(mutex_);
    if (!closed_ && flight.room_made()) room_made_(one.flight);
  }
}

void LosslessStream::hear_acknowledgements() {
  const auto is_owed = [](const Streaming& one) { return one.flight->unacknowledged > 0; };
  if (std::none_of(now_.begin(), now_.end(), is_owed)) {
    heard_ = Monotonic::now();
    return;
  }
  if (stream_.wait_for_acknowledgements(given_up_ ? 0 : kLook)) {
    heard_ = Monotonic::now();
    given_up_ = false;
    for (const Streaming& one : now_) one.flight->unacknowledged = 0;
    return;
  }
  if (!given_up_ && Monotonic::now() - heard_ < from_seconds(limits().lossless_patience_s)) return;
  if (!given_up_)
    spdlog::warn("a reader of lossless telemetry does not acknowledge; streams go on without it");
  given_up_ = true;
  for (const Streaming& one : now_)
    if (is_owed(one)) {
      one.flight->give_up_lossless();
      one.flight->unacknowledged = 0;
    }
}

void LosslessStream::hand_on() {
  for (const Streaming& one : now_) {
    if (!one.is_over || one.flight->ring().size() > 0 || one.flight->unacknowledged > 0) continue;
    {
      const std::lock_guard lock(mutex_);
      std::erase_if(streaming_, [&](const Streaming& other) { return other.flight == one.flight; });
    }
    stream_.end(*one.flight);
    drained_(one.flight);
    const std::lock_guard lock(mutex_);
    idle_.notify_all();
  }
  now_.clear();
}

}  // namespace slew::service
