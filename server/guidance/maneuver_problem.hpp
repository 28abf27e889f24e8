// From one attitude and rate to another in the least time: what is given (Vadali, Singh & Carter 1993, Eqs.
// 12-15).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/control/control_profile.hpp"
#include "server/plant/rigid_maneuver.hpp"

namespace slew {

struct RigidState {
  Vector4<double> attitude = Vector4<double>::UnitX();   ///< q, norm 1; -q is the same attitude
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d::Zero();  ///< body axes
};

/// One number of a profile that the planner may choose, or that is given.
struct ProfileParameter {
  double start = 0;
  double least = 0, most = 1;
  bool is_fixed = false;
};

/// The signs of one control between its switches: -1 for the least control, 0, +1 for the most.
using SwitchSequence = std::vector<int>;

struct ManeuverProblem {
  RigidManeuverPlant plant;
  RigidState initial, final;
  std::optional<double> most_consumption;          ///< in the plant's unit
  std::optional<Eigen::Vector3d> most_rate_rad_s;  ///< of each |w_i|, throughout
  std::optional<double> longest_s;                 ///< a plan may not last longer

  ProfileFamily family = ProfileFamily::on_off;
  /// On-off: the sequence of each control. Empty: any, with any number of switches.
  std::vector<SwitchSequence> sequences;
  /// On-off: where to start, s, control by control; needs `sequences`.
  std::vector<std::vector<double>> switch_starts_s;

  // The smooth families.
  std::vector<int> switches;       ///< of each control; one each where empty
  std::vector<double> smoothness;  ///< alpha; 0.01 where one switch, else 0.005
  double rise = 0.1;               ///< T_R, of the maneuver's time
  bool smoothness_is_free = false, rise_is_free = false;
  double least_smoothness = 0.002, most_smoothness = 0.05;
  double least_rise = 0.05, most_rise = 0.25;
  /// Impulses: t1 of each control. Empty: chosen between `least_t1` and `most_t1`.
  std::vector<double> t1;
  double least_t1 = 0.005, most_t1 = 0.25;
  /// Replaces what was said above, parameter by parameter, in the order of control_profile.hpp.
  std::vector<ProfileParameter> parameters;
  std::optional<double> time_start_s;  ///< a guess of the maneuver's time
};

/// One thing that is wrong with a problem.
struct ManeuverFault {
  std::string field;
  std::string problem;
  std::string given;
  std::string allowed;
};

}  // namespace slew
