#include "server/simulation/axis_channels.hpp"

namespace slew {
namespace {

void add_elastic(ChannelTable& table, std::size_t modes) {
  if (modes == 0) return;
  table.state.push_back({"momentum_N_m_s", "N m s", "inertial", "I omega + sum D_i q_i'"});
  for (std::size_t i = 1; i <= modes; ++i)
    table.state.push_back({"q_" + std::to_string(i), "kg^1/2 m", "body", "modal coordinate"});
  for (std::size_t i = 1; i <= modes; ++i)
    table.state.push_back({"q_dot_" + std::to_string(i), "kg^1/2 m/s", "body", "its rate"});
}

}  // namespace

ChannelTable axis_channels(std::size_t modes) {
  ChannelTable table{{{"angle_rad", "rad", "inertial", "theta"},
                      {"rate_rad_s", "rad/s", "inertial", "theta-dot"},
                      {"error_rad", "rad", "inertial", "theta - theta_f"},
                      {"switching_function_rad", "rad", "inertial",
                       "s of the law (Agrawal & Bang 1995, Eq. 19; Bryson 1994, Eq. 3.8)"}},
                     {{"torque_N_m", "N m", "body", "torque of the thrusters"},
                      {"positive_on", "1", "body", "1 while the thruster towards +theta fires"},
                      {"negative_on", "1", "body", "1 while the thruster towards -theta fires"},
                      {"positive_on_time_s", "s", "body", "its on-time so far"},
                      {"negative_on_time_s", "s", "body", "its on-time so far"}}};
  add_elastic(table, modes);
  return table;
}

ChannelTable linear_axis_channels(std::size_t modes, const AngleEstimator& estimator, bool is_lead,
                                  bool is_shaped) {
  ChannelTable table{{{"angle_rad", "rad", "inertial", "theta"},
                      {"rate_rad_s", "rad/s", "inertial", "theta-dot"},
                      {"error_rad", "rad", "inertial", "theta - theta_f"}},
                     {{"torque_N_m", "N m", "body", "torque of the thrusters"}}};
  add_elastic(table, modes);
  if (is_lead)
    table.state.push_back({"lead_state_rad", "rad", "inertial", "xi (Bryson 1994, Eq. 3.4)"});
  else if (!std::holds_alternative<std::monostate>(estimator))
    table.state.push_back(
        {"estimated_rate_rad_s", "rad/s", "inertial", "q^ (Bryson 1994, Problems 3.2.1, 3.2.3)"});
  if (!is_lead && std::holds_alternative<SecondOrderAngleEstimator>(estimator))
    table.state.push_back({"estimated_angle_rad", "rad", "inertial", "theta^ (Bryson 1994, Problem 3.2.1)"});
  if (is_shaped)
    table.state.push_back({"command_angle_rad", "rad", "inertial", "shaped, from theta_0 to theta_f"});
  return table;
}

const std::vector<std::string>& linear_axis_event_channels(bool is_shaped) {
  static const std::vector<std::string> none, impulses{"impulse"};
  return is_shaped ? impulses : none;
}

const std::vector<std::string>& axis_event_channels() {
  static const std::vector<std::string> names{"thruster", "end_box", "sliding", "rest", "accumulated"};
  return names;
}

void fill_axis_row(const SwitchingFunction& law, double angle_rad, double rate_rad_s,
                   const AxisFiring& firing, const AxisOnTimes& on, std::span<double> state,
                   std::span<double> thrusters) {
  state[0] = angle_rad;
  state[1] = rate_rad_s;
  state[2] = angle_rad - law.final_angle_rad();
  state[3] = law.value(angle_rad, rate_rad_s);
  thrusters[0] = firing.torque_N_m;
  thrusters[1] = firing.positive_on;
  thrusters[2] = firing.negative_on;
  thrusters[3] = on.positive_s;
  thrusters[4] = on.negative_s;
}

}  // namespace slew
