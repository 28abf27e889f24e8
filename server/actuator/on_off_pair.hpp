// A pair of on-off thrusters about one axis: torque +N, 0 or -N, with a minimum on-time.
#pragma once

#include <optional>

#include "server/actuator/propellant.hpp"

namespace slew {

struct OnOffPairParameters {
  double torque_N_m = 1;
  double minimum_on_time_s = 0;  ///< a firing, once begun, lasts at least this long; 0: none
  double switching_delay_s = 0;  ///< from a command to the torque (Bryson 1994, Fig. 3.5)
  std::optional<double> lever_arm_m;
  std::optional<double> specific_impulse_s;
  std::optional<double> gas_density_kg_m3;
};

}  // namespace slew
