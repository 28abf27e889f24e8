// Which torques a set of thrusters can make.
#pragma once

#include <span>
#include <vector>

#include "server/actuator/thruster_set.hpp"

namespace slew {

struct AxisDirection {
  int axis;  ///< 0, 1, 2: x, y, z
  int sign;  ///< 1 or -1
  bool operator==(const AxisDirection&) const = default;
};

/// Of +x, -x, +y, -y, +z, -z those about which no combination of thrusts gives a torque, to a billionth of
/// it. Where there are none every torque can be made, by some thrust.
std::vector<AxisDirection> torques_that_cannot_be_made(std::span<const Thruster> thrusters);

}  // namespace slew
