#include "server/simulation/structure_channels.hpp"

#include <Eigen/Core>

namespace slew {

ChannelTable structure_channels(const StructureSpecification& spec) {
  ChannelTable table;
  table.state = {
      {"angle_rad", "rad", "inertial", "the hub's about the axis of the slew"},
      {"rate_rad_s", "rad/s", "inertial", "its rate"},
      {"error_rad", "rad", "inertial", "angle less the final one"},
      {"command_angle_rad", "rad", "inertial", "what the shaped command would turn a rigid hub by"}};
  const auto add = [&](const std::string& prefix, const std::string& unit, const std::string& suffix,
                       const std::string& what) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      table.state.push_back(
          {prefix + std::to_string(axis + 1) + suffix, unit, "hub", what + " " + "xyz"[axis]});
  };
  add("hub_", "m", "_m", "displacement of the hub from the rigid slew along");
  add("hub_rotation_", "rad", "_rad", "small rotation of the hub from the rigid slew about");
  add("antenna_rotation_", "rad", "_rad", "rotation of the antenna relative to the hub about");
  add("antenna_pointing_", "rad", "_rad", "rotation of the antenna from the rigid slew about");
  table.thrusters = {{"slew_torque_N_m", "N m", "hub", "the command about the axis of the slew"}};
  for (const ActuatorGroup& group : spec.actuators)
    for (const NodeMotion& motion : group.motions) {
      const std::string axis = std::to_string(motion.motion % 3 + 1);
      table.thrusters.push_back({group.name + "_" + axis + (motion.is_rotation() ? "_N_m" : "_N"),
                                 motion.is_rotation() ? "N m" : "N", "hub",
                                 "control at node " + std::to_string(motion.node)});
    }
  return table;
}

void fill_structure_row(const StructureSpecification& spec, double t_s, std::span<const double> z,
                        std::span<const double> rate, std::span<const double> controls,
                        std::span<double> state, std::span<double> thrusters) {
  const StructureSystem& system = *spec.system;
  const SlewState slew = system.command.at(t_s);
  const Eigen::Map<const Eigen::VectorXd> position(z.data(), static_cast<Eigen::Index>(z.size()));
  const Eigen::Map<const Eigen::Vector3d> hub(z.data() + 3), hub_rate(rate.data() + 3);
  const double turned = slew.angle_rad + system.plant.axis.dot(hub);
  state[0] = spec.initial_angle_rad + turned;
  state[1] = slew.rate_rad_s + system.plant.axis.dot(hub_rate);
  state[2] = turned - spec.guidance.angle_rad;
  state[3] = spec.initial_angle_rad + slew.angle_rad;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const double relative = system.antenna.row(axis).dot(position);
    state[4 + i] = z[i];
    state[7 + i] = hub[axis];
    state[10 + i] = relative;
    state[13 + i] = relative + hub[axis];
  }
  thrusters[0] = system.command.torque_N_m(t_s);
  for (std::size_t i = 0; i < controls.size(); ++i) thrusters[1 + i] = controls[i];
}

}  // namespace slew
