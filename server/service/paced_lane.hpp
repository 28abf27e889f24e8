// Paced work: every experiment advances in slices to its own absolute deadlines (server/doc/pacing.md).
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "server/service/black_box.hpp"
#include "server/service/flight.hpp"
#include "server/service/inheriting_mutex.hpp"

namespace slew::service {

class PacedLane {
 public:
  PacedLane(std::size_t pacers, NextStage& next, BlackBox& black_box);
  ~PacedLane();

  /// A new flight, or one whose parking has ended.
  void submit(FlightPointer flight);

  /// Slices come as often as there are samples, within reason.
  static double slice_period_s(double sample_period_s, double rate);

  std::size_t flying() const;
  /// No slice is begun any more.
  void stop();
  /// Slices that have not come to their end.
  std::size_t in_slice() const;
  /// Whether all pacers run at SCHED_FIFO.
  bool realtime_policy() const { return realtime_policy_.load(std::memory_order_relaxed); }
  /// Over all experiments since the start.
  const Lateness& lateness() const { return lateness_; }

 private:
  struct Appointment {
    Monotonic::time_point deadline;
    std::uint64_t slice = 0;           ///< since the anchor
    std::uint64_t anchor_version = 0;  ///< the one the deadline was made for
    FlightPointer flight;
    bool operator>(const Appointment& other) const { return deadline > other.deadline; }
  };

  // One thread and its flights: a heap of appointments, earliest first.
  struct Pacer {
    explicit Pacer(BlackBox::Seat at) : seat(at) {}
    const BlackBox::Seat seat;
    mutable InheritingMutex mutex;
    std::condition_variable wake;
    std::vector<Appointment> heap;
    std::size_t in_slice = 0;  ///< taken from the heap to be flown, and what they load
    double in_slice_load = 0;
    std::thread thread;
  };

  void pace(Pacer& pacer);
  /// Flies one slice and makes the next appointment; false when the flight has left the lane. `woke`: the
  /// pacer, from sleep or at once when it was late.
  bool keep(Appointment& appointment, bool slept, Monotonic::time_point woke);

  NextStage& next_;
  std::vector<std::unique_ptr<Pacer>> pacers_;
  std::atomic<bool> stopping_{false};
  std::atomic<bool> realtime_policy_{true};
  Lateness lateness_;
  std::mutex lateness_mutex_;
};

}  // namespace slew::service
