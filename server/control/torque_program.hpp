// A torque that was planned beforehand: in each axis of one size and either sign, from t = 0 to a common end,
// as time-optimal slews are (Kim & Crassidis 1998). Looks at nothing but the time.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "server/control/attitude_sight.hpp"

namespace slew {

struct TorqueProgram : AttitudeLawTraits {
  static constexpr const char* kType = "torque_program";
  static constexpr bool kIsProgram = true;

  Eigen::Vector3d initial_torque_N_m = Eigen::Vector3d::Zero();
  std::array<std::vector<double>, 3> switch_times_s;  ///< where an axis changes sign; ascending, after t = 0
  double end_s = 0;                                   ///< from here on there is no torque

  template <typename Fields>
  void fields(Fields& fields) {
    fields("initial_torque_N_m", initial_torque_N_m);
    fields("switch_times_x_s", switch_times_s[0]);
    fields("switch_times_y_s", switch_times_s[1]);
    fields("switch_times_z_s", switch_times_s[2]);
    fields("end_s", end_s);
  }

  /// The first change after t, infinity after the last. At a change the new torque holds.
  double next_change_s(double t_s) const {
    double next = t_s < end_s ? end_s : std::numeric_limits<double>::infinity();
    for (const std::vector<double>& times : switch_times_s) {
      const auto after = std::upper_bound(times.begin(), times.end(), t_s);
      if (after != times.end() && *after < end_s) next = std::min(next, *after);
    }
    return next;
  }

  template <typename Scalar>
  AttitudeCommand<Scalar> command(const AttitudeSight<Scalar>& sight) const {
    AttitudeCommand<Scalar> command;
    if (sight.step_began_s >= end_s) return command;
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<double>& times = switch_times_s[axis];
      const auto done = std::upper_bound(times.begin(), times.end(), sight.step_began_s) - times.begin();
      command.torque_N_m[axis] = done % 2 == 0 ? initial_torque_N_m[axis] : -initial_torque_N_m[axis];
    }
    return command;
  }
};

}  // namespace slew
