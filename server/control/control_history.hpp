// The controls u(t) of a maneuver from its beginning to its end, as a planner finds them or as a paper prints
// them, and what they do to a body: B u.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "server/control/control_profile.hpp"

namespace slew {

/// Which values each control takes one after the other, and when it changes.
struct OnOffProgram {
  std::vector<std::vector<double>> controls;        ///< of each control, its value in each segment
  std::vector<std::vector<double>> switch_times_s;  ///< of each control, ascending; one less than its values
  double end_s = 0;

  std::size_t switches() const;
};

/// One of the families: an on-off program, or a layout and its parameters (control_profile.hpp).
struct ControlHistory {
  double time_s = 0;  ///< of the maneuver
  ProfileFamily family = ProfileFamily::on_off;
  OnOffProgram on_off;
  ProfileLayout layout;
  std::vector<double> parameters;
};

/// What controls do: column i of B is the torque at u_i = 1.
struct ControlInfluence {
  Eigen::Matrix3Xd influence_N_m;
  Eigen::VectorXd least, most;  ///< of each control; least <= 0 <= most
};

/// u_i at t, zero outside [0, end). At a switch the new value holds. Parts of a bound become controls by
/// `least` where they are negative, and by `most`.
double control_of(const ControlHistory& history, std::size_t i, double least, double most, double t_s);

/// Times, from 0 to the end, between which all controls are smooth; ascending.
std::vector<double> breaks_of(const ControlHistory& history);

}  // namespace slew
