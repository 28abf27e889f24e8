// ASTREX, the Advanced Structure Technology Research Experiment (Vadali, Singh & Carter 1993): a test article
// on an air bearing, with 8-lbf and 200-lbf thrusters, fed with air.
#pragma once

#include <array>

#include "server/plant/rigid_maneuver.hpp"

namespace slew {

inline constexpr double kNewtonPerPoundForce = 4.4482216152605;
inline constexpr double kAstrexMass_kg = 5091.9;
/// Two tanks of 4 ft^3 whose pressure drops by 300 psi hold 2 x 4 x 300 / 14.7 = 163 (Eq. 10), told as 160.
inline constexpr double kAstrexAir_ft3 = 160;
/// In each body axis.
inline constexpr double kAstrexMostRate_rad_s = 10 * std::numbers::pi / 180;

struct AstrexThruster {
  int number;
  double force_lbf;
  Eigen::Vector3d location_m;  ///< from the pivot
  Eigen::Vector3d direction;   ///< of the thrust for a positive force
  int control;                 ///< 0 for u1
  double sign;                 ///< the force is sign force_lbf u
};

/// Table 1, corrected where it does not give the printed influence matrices.
std::array<AstrexThruster, 10> astrex_thrusters();

enum class AstrexThrusters {
  eight_lbf,       ///< nos. 1 to 6
  two_hundred_lbf  ///< nos. 7 to 10, and 5 and 6 for roll
};

/// B from the table: each column the sum of r x F, N m.
Eigen::Matrix3d astrex_influence_from_table(AstrexThrusters thrusters);
/// What all of them push with at u, N: they are fired in pairs, so nothing.
Eigen::Vector3d astrex_net_force(AstrexThrusters thrusters, const Eigen::Vector3d& u);
/// B as printed (but for one sign), N m: what the cases fly.
Eigen::Matrix3d astrex_influence(AstrexThrusters thrusters);

/// About the pivot, as printed: the ground cases are reproduced with these signs.
Eigen::Matrix3d astrex_inertia_about_pivot();
/// About the mass centre: what is printed off the diagonal are here products of inertia, and so positive;
/// only so are the floating cases reproduced to every printed digit.
Eigen::Matrix3d astrex_inertia_about_centre();

/// ft^3/s at u_i = 1: 14/60 ft^3/s for each lbf of each thruster (Eq. 11).
Eigen::Vector3d astrex_air_ft3_s(AstrexThrusters thrusters);

/// Eq. 2.
RigidManeuverPlant astrex_floating(AstrexThrusters thrusters);
/// Eq. 5: with its weight beside the pivot and the springs of the pedestal.
RigidManeuverPlant astrex_on_pedestal(AstrexThrusters thrusters);

}  // namespace slew
