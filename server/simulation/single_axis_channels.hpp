// The columns of single-axis telemetry, and one row of them.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "server/control/switching_function.hpp"
#include "server/simulation/run.hpp"

namespace slew {

inline constexpr std::size_t kAxisStateChannels = 4;
inline constexpr std::size_t kAxisThrusterChannels = 5;

const ChannelTable& single_axis_channels();
const std::vector<std::string>& single_axis_event_channels();

/// Indices into single_axis_event_channels().
inline constexpr std::uint32_t kThrusterEvent = 0;
inline constexpr std::uint32_t kEndBoxEvent = 1;

struct AxisRow {
  std::array<double, kAxisStateChannels> state;
  std::array<double, kAxisThrusterChannels> thrusters;
};

/// On-times accumulated by either thruster, in s.
struct AxisOnTimes {
  double positive_s = 0;
  double negative_s = 0;
};

AxisRow axis_row(const SwitchingFunction& law, double final_angle_rad, double angle_rad, double rate_rad_s,
                 int u, double torque_N_m, const AxisOnTimes& on);

}  // namespace slew
