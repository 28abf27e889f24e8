// A pair of on-off thrusters about one axis: torque +N, 0 or -N, with a minimum on-time.
#pragma once

#include <optional>

namespace slew {

/// Standard acceleration of gravity, by which specific impulse is defined.
inline constexpr double kStandardGravity_m_s2 = 9.80665;

struct OnOffPairParameters {
  double torque_N_m = 1;
  double minimum_on_time_s = 0;  ///< a firing, once begun, lasts at least this long; 0: none
  double switching_delay_s = 0;  ///< from a command to the torque (Bryson 1994, Fig. 3.5)
  std::optional<double> lever_arm_m;
  std::optional<double> specific_impulse_s;
  std::optional<double> gas_density_kg_m3;
};

/// Propellant in kg for an angular impulse in N m s; empty where arm or specific impulse is not known.
inline std::optional<double> propellant_kg(const OnOffPairParameters& pair, double angular_impulse_N_m_s) {
  if (!pair.lever_arm_m || !pair.specific_impulse_s) return std::nullopt;
  return angular_impulse_N_m_s / (*pair.lever_arm_m * *pair.specific_impulse_s * kStandardGravity_m_s2);
}

}  // namespace slew
