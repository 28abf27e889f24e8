#include "server/simulation/attitude_channels.hpp"

namespace slew {
namespace {

const char* const kAxis[] = {"1", "2", "3"};

void add_vector(std::vector<Channel>& columns, const std::string& name, const std::string& suffix,
                const char* unit, const char* frame, const char* description) {
  for (const char* axis : kAxis) columns.push_back({name + "_" + axis + suffix, unit, frame, description});
}

}  // namespace

ChannelTable attitude_channels(const AttitudeLoop& loop) {
  const AttitudeSpecification& spec = loop.specification();
  ChannelTable table;
  add_vector(table.state, "mrp", "", "1", "final attitude", "p = n tan(theta/4), body to final attitude");
  if (spec.plant.attitude == AttitudeParameters::euler_parameters)
    for (const char* i : {"0", "1", "2", "3"})
      table.state.push_back({std::string("quaternion_") + i, "1", "final attitude",
                             "Euler parameters, scalar first, body to final attitude"});
  add_vector(table.state, "rate", "_rad_s", "rad/s", "body", "w, relative to inertial space");
  if (spec.maneuver.tells_euler_angles)
    for (const char* angle : {"yaw", "pitch", "roll"})
      table.state.push_back({std::string(angle) + "_rad", "rad", "frame of reference", "Euler angles 1-2-3"});
  if (has_surface(spec.law))
    add_vector(table.state, "surface", "_rad_s", "rad/s", "body", "s of the law; a sampled law's latest");
  if (spec.observer)
    add_vector(table.state, "estimated_disturbance", "_N_m", "N m", "body",
               "w^ (Kim & Crassidis 1998, Eq. 39)");
  if (loop.pwpf())
    for (std::size_t c = 1; c <= loop.channels().size(); ++c)
      table.state.push_back({"filter_" + std::to_string(c), "1", "body", "f of the modulator's lag"});
  add_vector(table.thrusters, "torque", "_N_m", "N m", "body", "torque of the actuator");
  add_vector(table.thrusters, "command", "_N_m", "N m", "body", "what the law asks for");
  const std::size_t thrusters = thrusters_of(spec.actuator).size();
  for (std::size_t j = 1; j <= thrusters; ++j)
    table.thrusters.push_back(
        {"thruster_" + std::to_string(j) + "_on", "1", "body", "1 while its valve is open"});
  for (std::size_t j = 1; j <= thrusters; ++j)
    table.thrusters.push_back(
        {"thruster_" + std::to_string(j) + "_on_time_s", "s", "body", "how long its valve has been open"});
  return table;
}

AttitudeEvents attitude_events(const AttitudeLoop& loop) {
  const auto first = static_cast<std::uint32_t>(loop.channels().size());
  return {first, first + 1, first + 2, first + 3};
}

std::vector<std::string> attitude_event_channels(const AttitudeLoop& loop) {
  std::vector<std::string> names;
  const bool are_pairs = std::holds_alternative<AxisThrusters>(loop.specification().actuator);
  for (std::size_t c = 1; c <= loop.channels().size(); ++c)
    names.push_back((are_pairs ? "axis_" : "thruster_") + std::to_string(c));
  names.insert(names.end(), {"program", "shadow", "tank_empty"});
  for (std::size_t j = 1; j <= thrusters_of(loop.specification().actuator).size(); ++j)
    names.push_back("valve_" + std::to_string(j));
  return names;
}

}  // namespace slew
