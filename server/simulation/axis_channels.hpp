// The columns of single-axis telemetry, and one row of them.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "server/control/switching_function.hpp"
#include "server/estimation/angle_estimator.hpp"
#include "server/simulation/run.hpp"

namespace slew {

inline constexpr std::size_t kAxisStateChannels = 4;  ///< of a rigid axis
inline constexpr std::size_t kAxisThrusterChannels = 5;

/// With elastic modes the momentum and every q_i and q_i' follow the rigid axis' columns.
ChannelTable axis_channels(std::size_t modes = 0);
const std::vector<std::string>& axis_event_channels();

/// Of a linear law: angle, rate, error, with elastic modes what axis_channels() has of them, then what is
/// estimated, or xi of lead compensation; last, where it is shaped, the angle that is commanded.
ChannelTable linear_axis_channels(std::size_t modes, const AngleEstimator& estimator, bool is_lead,
                                  bool is_shaped = false);
/// Of a linear law: the impulses of a shaped command, from 1.
const std::vector<std::string>& linear_axis_event_channels(bool is_shaped);

/// Index into linear_axis_event_channels().
inline constexpr std::uint32_t kImpulseEvent = 0;
/// Indices into axis_event_channels().
inline constexpr std::uint32_t kThrusterEvent = 0;
inline constexpr std::uint32_t kEndBoxEvent = 1;
inline constexpr std::uint32_t kSlidingEvent = 2;      ///< 1: on the upper edge, -1: on the lower one
inline constexpr std::uint32_t kRestEvent = 3;         ///< 1: thrusters or friction hold it
inline constexpr std::uint32_t kAccumulatedEvent = 4;  ///< 1: arcs that shrink without end have ended in rest

/// On-times of either thruster, in s.
struct AxisOnTimes {
  double positive_s = 0;
  double negative_s = 0;
};

/// What the thrusters do at an instant; while they chatter, on the average.
struct AxisFiring {
  double torque_N_m = 0;
  double positive_on = 0;
  double negative_on = 0;
};

/// Fills the columns that a rigid axis has too; the spans are as long as the channel tables.
void fill_axis_row(const SwitchingFunction& law, double angle_rad, double rate_rad_s,
                   const AxisFiring& firing, const AxisOnTimes& on, std::span<double> state,
                   std::span<double> thrusters);

}  // namespace slew
