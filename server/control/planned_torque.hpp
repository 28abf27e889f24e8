// The torque of a maneuver that was planned: B u(t), open loop. Looks at nothing but the time.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "server/control/attitude_sight.hpp"
#include "server/control/control_history.hpp"

namespace slew {

struct PlannedControls {
  ControlHistory history;
  ControlInfluence influence;
  std::vector<double> breaks_s;  ///< breaks_of(history)

  /// u_i. One that is constant between switches is that of the step it is asked in, also at its end.
  double control(Eigen::Index i, double t_s, double step_began_s) const {
    const double at_s = history.family == ProfileFamily::on_off ? step_began_s : t_s;
    if (step_began_s >= history.time_s) return 0;
    return control_of(history, static_cast<std::size_t>(i), influence.least[i], influence.most[i], at_s);
  }
  Eigen::Vector3d torque_N_m(double t_s, double step_began_s) const {
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < influence.influence_N_m.cols(); ++i)
      torque += control(i, t_s, step_began_s) * influence.influence_N_m.col(i);
    return torque;
  }
};

struct PlannedTorque : AttitudeLawTraits {
  static constexpr const char* kType = "planned_torque";
  static constexpr bool kIsProgram = true;

  /// Copies share it. Null as long as there is no plan: no torque.
  std::shared_ptr<const PlannedControls> planned;

  template <typename Fields>
  void fields(Fields&) {}

  double next_change_s(double t_s) const {
    if (!planned) return std::numeric_limits<double>::infinity();
    const auto after = std::upper_bound(planned->breaks_s.begin(), planned->breaks_s.end(), t_s);
    return after == planned->breaks_s.end() ? std::numeric_limits<double>::infinity() : *after;
  }

  template <typename Scalar>
  AttitudeCommand<Scalar> command(const AttitudeSight<Scalar>& sight) const {
    AttitudeCommand<Scalar> command;
    if (planned)
      command.torque_N_m = planned->torque_N_m(sight.t_s, sight.step_began_s).template cast<Scalar>();
    return command;
  }
};

}  // namespace slew
