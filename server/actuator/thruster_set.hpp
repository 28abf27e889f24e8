// Thrusters as they are mounted.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace slew {

inline constexpr std::size_t kMaxThrusters = 32;

/// Where a minimum on-time holds.
enum class MinimumOnTimeOf {
  valve_command,
  effective_thrust,  ///< impulse over full thrust: the command's length and half of fall minus rise
};

struct Thruster {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< from the centre of mass
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  ///< of the force on the body; of length 1
  double thrust_N = 1;
  /// Torque at full thrust of a pair without position; empty: position x direction times thrust.
  std::optional<Eigen::Vector3d> couple_N_m;
  double minimum_on_time_s = 0, minimum_off_time_s = 0;
  double on_delay_s = 0, off_delay_s = 0;  ///< from the command to the thrust's first change
  double rise_s = 0, fall_s = 0;           ///< linear, from nothing to full thrust and back
  double noise = 0;                        ///< of each firing's level: standard deviation over level
  double misalignment_rad = 0;             ///< of the direction: standard deviation about each of two axes
  double stuck_open_from_s = std::numeric_limits<double>::infinity();
  double stuck_closed_from_s = std::numeric_limits<double>::infinity();
};

/// Torque at full thrust, N m, as the designer believes it to be.
inline Eigen::Vector3d torque_N_m(const Thruster& thruster) {
  if (thruster.couple_N_m) return *thruster.couple_N_m;
  return thruster.thrust_N * thruster.position_m.cross(thruster.direction);
}

/// Where the gas comes from.
struct Propellant {
  std::optional<double> specific_impulse_s;
  std::optional<double> gas_density_kg_m3;
  std::optional<double> tank_kg;  ///< what there is; once it is used up nothing fires
};

enum class AllocationMethod {
  non_negative_least_squares,  ///< torque as asked for, force as little as it can be
  linear_programme,            ///< least total thrust that gives the torque
};

}  // namespace slew
