// Streams that lose nothing: no more is written than readers have acknowledged, and a flight whose ring is
// full waits. On a thread and with writers of its own, so that a slow reader slows nobody else's telemetry.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "server/service/telemetry_stream.hpp"

namespace slew::service {

class LosslessStream {
 public:
  /// `drained` gets every flight that is over, once all of it has been acknowledged or given up; `room_made`
  /// every one that was parked for want of room. Both from this stream's thread.
  LosslessStream(const wire::Domain& domain, std::function<void(FlightPointer)> drained,
                 std::function<void(FlightPointer)> room_made);
  ~LosslessStream();

  void begun(const FlightPointer& flight);
  void over(const FlightPointer& flight);

  /// From now on `room_made` is not called any more.
  void close();
  /// Waits until nothing that is over is left, at most this long.
  void flush(Monotonic::duration time);

  std::uint64_t published() const { return stream_.published(); }

 private:
  struct Streaming {
    FlightPointer flight;
    bool is_over = false;
  };

  void work();
  void stream_all();
  void hear_acknowledgements();
  void hand_on();

  TelemetryStream stream_;
  const std::function<void(FlightPointer)> drained_;
  const std::function<void(FlightPointer)> room_made_;

  std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable idle_;
  std::vector<Streaming> streaming_;  ///< behind mutex_; its flights' batches are the thread's own
  bool closed_ = false;
  bool stopping_ = false;

  // the thread's own
  std::vector<Streaming> now_;
  bool given_up_ = false;  ///< on readers, until they acknowledge again
  Monotonic::time_point heard_{};
  std::thread thread_;
};

}  // namespace slew::service
