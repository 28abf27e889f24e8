// The publisher: everything an experiment says while it flies, on a thread of its own, so that no step waits
// for the network. Drains the rings, thins nothing (the flight did), batches, counts.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "idl/wire/writer.hpp"
#include "server/service/flight.hpp"

namespace slew::service {

class Publisher final : public NextStage {
 public:
  /// `drained` is called, from the publisher's thread, with every flight that is over and fully published.
  Publisher(const wire::Domain& domain, std::function<void(FlightPointer)> drained);
  ~Publisher() override;

  void begun(const FlightPointer& flight) override;
  void over(const FlightPointer& flight) override;
  /// Its end is committed: say so.
  void ended(const FlightPointer& flight);
  /// Nobody will ask for it any more: its instances are disposed.
  void forget(const FlightPointer& flight);

  /// Waits until everything posted so far has been taken in.
  void flush();

  std::uint64_t samples_published() const { return samples_published_.load(std::memory_order_relaxed); }
  std::uint64_t samples_dropped() const { return samples_dropped_.load(std::memory_order_relaxed); }

 private:
  enum class News { begun, over, ended, forget };
  struct Item {
    News news;
    FlightPointer flight;
  };

  void post(News news, const FlightPointer& flight);
  void publish();
  void take_in(const Item& item);
  void describe(const Flight& flight);
  void tell_phases(Flight& flight);
  void tell_status(Flight& flight);
  void drain(Flight& flight);

  wire::Writer<slew_v1_Experiment> experiment_;
  wire::Writer<slew_v1_Channels> channels_;
  wire::Writer<slew_v1_State> state_;
  wire::Writer<slew_v1_Thrusters> thrusters_;
  wire::Writer<slew_v1_Event> event_;
  const std::function<void(FlightPointer)> drained_;

  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Item> inbox_;
  std::condition_variable idle_;
  bool is_busy_ = false;
  bool stopping_ = false;

  // the thread's own
  std::vector<FlightPointer> flying_;
  std::vector<double> row_, t_s_, state_values_, thruster_values_;

  std::atomic<std::uint64_t> samples_published_{0};
  std::atomic<std::uint64_t> samples_dropped_{0};
  std::thread thread_;
};

}  // namespace slew::service
