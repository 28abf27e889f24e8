// The publisher: everything an experiment says while it flies, on a thread of its own, so that no step waits
// for the network. Drains the rings, thins nothing (the flight did).
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "idl/wire/writer.hpp"
#include "server/service/flight.hpp"
#include "server/service/lossless_stream.hpp"
#include "server/service/telemetry_stream.hpp"

namespace slew::service {

class Publisher final : public NextStage {
 public:
  /// `drained` is called with every flight that is over and fully published; `room_made` with every lossless
  /// one that was parked for want of room. Both from the publishing threads.
  Publisher(const wire::Domain& domain, std::function<void(FlightPointer)> drained,
            std::function<void(FlightPointer)> room_made);
  ~Publisher() override;

  /// It is being planned; again whenever that has got on.
  void planning(const FlightPointer& flight);
  void begun(const FlightPointer& flight) override;
  void over(const FlightPointer& flight) override;
  /// Its end is committed: say so.
  void ended(const FlightPointer& flight);
  /// Nobody will ask for it any more: its instances are disposed.
  void forget(const FlightPointer& flight);

  /// From now on nothing is handed back to a lane.
  void close() { lossless_.close(); }
  /// Waits until everything posted so far has been taken in.
  void flush();

  std::uint64_t samples_published() const { return telemetry_.published() + lossless_.published(); }
  std::uint64_t samples_dropped() const { return telemetry_.dropped(); }

 private:
  enum class News { planning, begun, over, ended, forget };
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

  wire::Writer<slew_v1_Experiment> experiment_;
  wire::Writer<slew_v1_Channels> channels_;
  wire::Writer<slew_v1_Event> event_;
  TelemetryStream telemetry_;
  const std::function<void(FlightPointer)> drained_;

  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Item> inbox_;
  std::condition_variable idle_;
  bool is_busy_ = false;
  bool stopping_ = false;

  // the thread's own
  std::vector<FlightPointer> flying_;

  LosslessStream lossless_;
  std::thread thread_;
};

}  // namespace slew::service
