// The two clocks of the service: one to wait by, one to tell people.
#pragma once

#include <chrono>
#include <cstdint>

namespace slew::service {

using Monotonic = std::chrono::steady_clock;

inline std::int64_t unix_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

inline double seconds(Monotonic::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

inline Monotonic::duration from_seconds(double value) {
  return std::chrono::duration_cast<Monotonic::duration>(std::chrono::duration<double>(value));
}

}  // namespace slew::service
