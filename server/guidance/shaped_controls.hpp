// Controls of a maneuver that are constant between switches, shaped by impulses: longer by the last of them,
// in parts of what they were, and no longer on or off.
#pragma once

#include <span>

#include "server/control/control_history.hpp"
#include "server/guidance/impulse_shaper.hpp"

namespace slew {

/// Expects the on-off family. What a rigid body turns by stays the same about a principal axis, where its
/// motion is linear in the torque; about several at once it ends elsewhere.
ControlHistory shaped_controls(const ControlHistory& history, std::span<const Impulse> impulses);

}  // namespace slew
