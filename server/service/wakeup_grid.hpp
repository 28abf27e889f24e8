// Where the clock of a paced experiment begins when nobody ordered an instant: on a grid that all of them
// share, so that one wake-up of a pacer serves several.
#pragma once

#include <cstdint>

#include "server/service/clock.hpp"

namespace slew::service {

/// 250 us: wide enough to share wake-ups, narrow enough that the last one served is hardly late.
using WakeupGrid = std::chrono::duration<std::int64_t, std::ratio<1, 4000>>;

/// The first point of the grid that is not before `time`.
inline Monotonic::time_point on_wakeup_grid(Monotonic::time_point time) {
  return std::chrono::ceil<WakeupGrid>(time);
}

}  // namespace slew::service
