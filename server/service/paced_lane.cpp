#include "server/service/paced_lane.hpp"

#include <pthread.h>
#include <sys/prctl.h>

#include <time.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

constexpr double kShortestSlice_s = 1e-3;
constexpr double kLongestSlice_s = 50e-3;
constexpr int kPriority = 20;

double slice_period_of(const Flight& flight) {
  return PacedLane::slice_period_s(flight.prepared().telemetry.sample_period_s, flight.anchor().rate);
}

double thread_processor_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

bool take_realtime_policy() {
  // Where the policy is refused, at least the timers should be exact.
  prctl(PR_SET_TIMERSLACK, 1UL);
  sched_param parameter{};
  parameter.sched_priority = kPriority;
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter) == 0;
}

}  // namespace

PacedLane::PacedLane(std::size_t pacers, NextStage& next, BlackBox& black_box) : next_(next) {
  for (std::size_t i = 0; i < pacers; ++i) pacers_.push_back(std::make_unique<Pacer>(black_box.seat()));
  for (std::size_t i = 0; i < pacers; ++i)
    pacers_[i]->thread = std::thread([this, i] {
      name_this_thread("pacer-" + std::to_string(i));
      if (!take_realtime_policy()) realtime_policy_ = false;
      pace(*pacers_[i]);
    });
}

double PacedLane::slice_period_s(double sample_period_s, double rate) {
  return std::clamp(sample_period_s / rate, kShortestSlice_s, kLongestSlice_s);
}

PacedLane::~PacedLane() {
  stop();
  for (auto& pacer : pacers_) pacer->thread.join();
}

void PacedLane::stop() {
  stopping_ = true;
  for (auto& pacer : pacers_) {
    { const std::lock_guard<std::mutex> lock(pacer->mutex); }
    pacer->wake.notify_one();
  }
}

std::size_t PacedLane::in_slice() const {
  std::size_t total = 0;
  for (const auto& pacer : pacers_) {
    const std::lock_guard<std::mutex> lock(pacer->mutex);
    total += pacer->in_slice;
  }
  return total;
}

void PacedLane::submit(FlightPointer flight) {
  // To the pacer with the least to do.
  Pacer* idlest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (auto& pacer : pacers_) {
    const std::lock_guard<std::mutex> lock(pacer->mutex);
    double load = pacer->in_slice_load;
    for (const Appointment& appointment : pacer->heap) load += appointment.flight->load();
    if (load < least) {
      least = load;
      idlest = pacer.get();
    }
  }
  {
    const auto& anchor = flight->anchor();
    Appointment appointment{Monotonic::now(), 0, anchor.version, nullptr};
    // One that only waited for room owes what it did not fly meanwhile.
    if (flight->phase() == slew_v1_RUNNING && flight->has_run()) {
      const double period_s = slice_period_of(*flight);
      const double flown = (flight->t_sim_s() - anchor.sim_s) / (anchor.rate * period_s);
      appointment.slice = static_cast<std::uint64_t>(std::max(0.0, std::floor(flown))) + 1;
      appointment.deadline = anchor.wall + from_seconds(static_cast<double>(appointment.slice) * period_s);
    }
    appointment.flight = std::move(flight);
    const std::lock_guard<std::mutex> lock(idlest->mutex);
    idlest->heap.push_back(std::move(appointment));
    std::push_heap(idlest->heap.begin(), idlest->heap.end(), std::greater<>());
  }
  idlest->wake.notify_one();
}

std::size_t PacedLane::flying() const {
  std::size_t total = 0;
  for (const auto& pacer : pacers_) {
    const std::lock_guard<std::mutex> lock(pacer->mutex);
    total += pacer->heap.size() + pacer->in_slice;
  }
  return total;
}

void PacedLane::pace(Pacer& pacer) {
  std::vector<Appointment> due;
  std::unique_lock<std::mutex> lock(pacer.mutex);
  // Processor time of this thread since the last call.
  auto spent = [accounted_s = thread_processor_s()]() mutable {
    const double now_s = thread_processor_s();
    return now_s - std::exchange(accounted_s, now_s);
  };
  while (!stopping_) {
    if (pacer.heap.empty()) {
      pacer.wake.wait(lock);
      continue;
    }
    const auto deadline = pacer.heap.front().deadline;
    const bool slept = Monotonic::now() < deadline;
    if (slept) pacer.wake.wait_until(lock, deadline);
    const auto woke = Monotonic::now();
    // All that are due share this wake-up.
    while (!pacer.heap.empty() && pacer.heap.front().deadline <= woke) {
      std::pop_heap(pacer.heap.begin(), pacer.heap.end(), std::greater<>());
      due.push_back(std::move(pacer.heap.back()));
      pacer.heap.pop_back();
      pacer.in_slice_load += due.back().flight->load();
    }
    if (due.empty()) continue;
    pacer.in_slice = due.size();
    lock.unlock();
    // Waking and sorting since the last slice was for all of them.
    const double shared_s = spent() / static_cast<double>(due.size());
    for (Appointment& appointment : due) {
      pacer.seat.take(appointment.flight->entry().experiment_id);
      const bool goes_on = keep(appointment, slept, woke);
      pacer.seat.leave();
      const double cost_s = shared_s + spent();
      if (goes_on)
        appointment.flight->record_cost(cost_s, slice_period_of(*appointment.flight));
      else
        appointment.flight.reset();
    }
    lock.lock();
    pacer.in_slice = 0;
    pacer.in_slice_load = 0;
    for (Appointment& appointment : due) {
      if (!appointment.flight) continue;
      pacer.heap.push_back(std::move(appointment));
      std::push_heap(pacer.heap.begin(), pacer.heap.end(), std::greater<>());
    }
    due.clear();
  }
}

bool PacedLane::keep(Appointment& appointment, bool slept, Monotonic::time_point woke) {
  Flight& flight = *appointment.flight;
  SliceEnd end = begin_slice(appointment.flight, next_);
  const auto& anchor = flight.anchor();
  const double period_s = slice_period_of(flight);
  const bool first = anchor.version != appointment.anchor_version;
  if (end == SliceEnd::goes_on) {
    // Due is the newest deadline that has passed: after an overrun the missed slices are flown as one.
    const double passed = std::floor(seconds(Monotonic::now() - anchor.wall) / period_s);
    const std::uint64_t due =
        first ? 0 : std::max(appointment.slice, static_cast<std::uint64_t>(std::max(0.0, passed)));
    const double until_s = anchor.sim_s + anchor.rate * (static_cast<double>(due) * period_s);
    end = flight.fly(until_s, Monotonic::time_point::max());
    if (!first) {
      const auto done = Monotonic::now();
      const double late_s = seconds(done - appointment.deadline);
      const bool overslept = slept && seconds(woke - appointment.deadline) > 0.5 * late_s;
      flight.record_slice(late_s, late_s > period_s, overslept);
      const std::lock_guard lock(lateness_mutex_);
      lateness_.record(late_s);
    }
    appointment.slice = due + 1;
    appointment.anchor_version = anchor.version;
    appointment.deadline = anchor.wall + from_seconds(static_cast<double>(appointment.slice) * period_s);
  }
  if (end == SliceEnd::over) next_.over(appointment.flight);
  return end == SliceEnd::goes_on;
}

}  // namespace slew::service
