// What turns a demand of any size into on and off. A channel is a pair of thrusters about an axis (output -1,
// 0, 1) or a single thruster (0, 1); the demand and the level of a channel are in N m or in N.
#pragma once

#include <variant>

namespace slew {

enum class ModulatorInput {
  raw,      ///< the demand as it is
  clipped,  ///< to the channel's level
  scaled,   ///< divided by the channel's level, and so is the feedback
};

/// Pulse-width pulse-frequency modulator: a first-order lag and a Schmitt trigger in a loop (Kim & Crassidis
/// 1998, Fig. 1): T_m f' = -f + K_m (demand - U level); off to on at |f| >= U_on, on to off at |f| <= U_off.
struct PwpfModulator {
  double gain = 7.46;             ///< K_m
  double time_constant_s = 1.33;  ///< T_m
  double on = 0.45;               ///< U_on, in what the filter gives out
  double off = 0.25;              ///< U_off < U_on
  ModulatorInput input = ModulatorInput::raw;
};

/// On where |demand| reaches `on`, off where it has fallen to `off`; both are fractions of the channel's
/// level.
struct SchmittModulator {
  double on = 0.5;
  double off = 0.25;
};

/// Of a sampled law: on from every sample for the fraction of the period that the demand is of the level;
/// what would be shorter than the minimum is left out.
struct PulseWidthModulator {
  double minimum_on_time_s = 0;
};

using Modulator = std::variant<PwpfModulator, SchmittModulator, PulseWidthModulator>;

}  // namespace slew
