// The phases of an experiment and their names, as they stand in JSON and on a terminal.
#pragma once

#include <string_view>

#include "slew.h"

namespace slew::wire {

using Phase = slew_v1_Phase;

constexpr std::string_view phase_name(Phase phase) {
  switch (phase) {
    case slew_v1_RECEIVED:
      return "received";
    case slew_v1_REJECTED:
      return "rejected";
    case slew_v1_ACCEPTED:
      return "accepted";
    case slew_v1_QUEUED:
      return "queued";
    case slew_v1_HELD:
      return "held";
    case slew_v1_PLANNING:
      return "planning";
    case slew_v1_RUNNING:
      return "running";
    case slew_v1_PAUSED:
      return "paused";
    case slew_v1_COMPLETED:
      return "completed";
    case slew_v1_FAILED:
      return "failed";
    case slew_v1_CANCELLED:
      return "cancelled";
    case slew_v1_INTERRUPTED:
      return "interrupted";
    case slew_v1_EXPIRED:
      return "expired";
  }
  return "unknown";
}

/// Whether nothing more will happen to an experiment (or a refused request) in this phase.
constexpr bool is_terminal(Phase phase) {
  return phase == slew_v1_REJECTED || phase >= slew_v1_COMPLETED;
}

}  // namespace slew::wire
