// What a torque costs in propellant.
#pragma once

#include <optional>

namespace slew {

/// Standard acceleration of gravity, by which specific impulse is defined.
inline constexpr double kStandardGravity_m_s2 = 9.80665;

/// Propellant in kg for an angular impulse in N m s; empty where arm or specific impulse is not known.
template <typename Thrusters>
std::optional<double> propellant_kg(const Thrusters& thrusters, double angular_impulse_N_m_s) {
  if (!thrusters.lever_arm_m || !thrusters.specific_impulse_s) return std::nullopt;
  return angular_impulse_N_m_s /
         (*thrusters.lever_arm_m * *thrusters.specific_impulse_s * kStandardGravity_m_s2);
}

}  // namespace slew
