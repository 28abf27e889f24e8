// The columns of three-axis telemetry, and what happens in it.
#pragma once

#include <string>
#include <vector>

#include "server/simulation/attitude_loop.hpp"

namespace slew {

/// State: p, q where the plant has it, w, s of a law with a surface, the estimated disturbance of an
/// observer, the filters of a modulator. Thrusters: T, what the law asks for, then of each thruster whether
/// its valve is open and how long it has been.
ChannelTable attitude_channels(const AttitudeLoop& loop);

/// Where each kind of event is among attitude_event_channels().
struct AttitudeEvents {
  std::uint32_t program, shadow, tank, valves;  ///< after the channels of the modulator
};
AttitudeEvents attitude_events(const AttitudeLoop& loop);
std::vector<std::string> attitude_event_channels(const AttitudeLoop& loop);

}  // namespace slew
