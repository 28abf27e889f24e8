#include "server/simulation/single_axis_channels.hpp"

namespace slew {

const ChannelTable& single_axis_channels() {
  static const ChannelTable table{
      {{"angle_rad", "rad", "inertial", "theta"},
       {"rate_rad_s", "rad/s", "inertial", "theta-dot"},
       {"error_rad", "rad", "inertial", "theta - theta_f"},
       {"switching_function_rad", "rad", "inertial", "s of Agrawal & Bang 1995, Eq. 19"}},
      {{"torque_N_m", "N m", "body", "torque of the thrusters"},
       {"positive_on", "1", "body", "1 while the thruster towards +theta fires"},
       {"negative_on", "1", "body", "1 while the thruster towards -theta fires"},
       {"positive_on_time_s", "s", "body", "its on-time so far"},
       {"negative_on_time_s", "s", "body", "its on-time so far"}}};
  return table;
}

const std::vector<std::string>& single_axis_event_channels() {
  static const std::vector<std::string> names{"thruster", "end_box"};
  return names;
}

AxisRow axis_row(const SwitchingFunction& law, double final_angle_rad, double angle_rad, double rate_rad_s,
                 int u, double torque_N_m, const AxisOnTimes& on) {
  return {{angle_rad, rate_rad_s, angle_rad - final_angle_rad, law.value(angle_rad, rate_rad_s)},
          {u * torque_N_m, u > 0 ? 1.0 : 0.0, u < 0 ? 1.0 : 0.0, on.positive_s, on.negative_s}};
}

}  // namespace slew
