// Proportional thrusters about one axis: whatever torque is commanded, at once and without bound. "Somewhat
// unrealistic", says Bryson 1994, section 3.2, but the logic is simpler than for on-off thrusters.
#pragma once

#include <optional>

#include "server/actuator/propellant.hpp"

namespace slew {

struct ProportionalThrusterParameters {
  std::optional<double> lever_arm_m;
  std::optional<double> specific_impulse_s;
  std::optional<double> gas_density_kg_m3;
};

}  // namespace slew
