// The columns of single-axis telemetry, and one row of them.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "server/control/switching_function.hpp"
#include "server/simulation/run.hpp"

namespace slew {

inline constexpr std::size_t kAxisStateChannels = 4;  ///< of a rigid axis
inline constexpr std::size_t kAxisThrusterChannels = 5;

/// With elastic modes the momentum and every q_i and q_i' follow the rigid axis' columns.
ChannelTable single_axis_channels(std::size_t modes = 0);
const std::vector<std::string>& single_axis_event_channels();

/// Indices into single_axis_event_channels().
inline constexpr std::uint32_t kThrusterEvent = 0;
inline constexpr std::uint32_t kEndBoxEvent = 1;

/// On-times accumulated by either thruster, in s.
struct AxisOnTimes {
  double positive_s = 0;
  double negative_s = 0;
};

/// Fills the columns that a rigid axis has too; the spans are as long as the channel tables.
void fill_axis_row(const SwitchingFunction& law, double final_angle_rad, double angle_rad, double rate_rad_s,
                   int u, double torque_N_m, const AxisOnTimes& on, std::span<double> state,
                   std::span<double> thrusters);

}  // namespace slew
