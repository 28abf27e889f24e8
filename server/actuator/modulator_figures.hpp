// What a modulator does with a demand that does not change: dead band, saturation, pulses, duty cycle (Kim &
// Crassidis 1998, Fig. 1; Wie 2008, "Space Vehicle Dynamics and Control", Sec. 7.6), in closed form. Demands
// and levels in N m or in N, of one sign or the other alike.
#pragma once

#include <limits>

#include "server/actuator/modulator.hpp"

namespace slew {

inline constexpr double kNever = std::numeric_limits<double>::infinity();

/// Pulses that come again and again. Nothing fires: on for 0, off for ever. Saturated: on for ever.
struct PulseTrain {
  double on_time_s = 0;
  double off_time_s = kNever;

  double period_s() const { return on_time_s + off_time_s; }
  double frequency_Hz() const { return 1 / period_s(); }
  double duty_cycle() const { return on_time_s == 0 ? 0 : on_time_s == kNever ? 1 : on_time_s / period_s(); }
};

/// The limit cycle of the filter between U_off and U_on.
PulseTrain steady_pulses(const PwpfModulator& modulator, double level, double demand);

/// With a period (s), on from its beginning.
PulseTrain steady_pulses(const PulseWidthModulator& modulator, double level, double demand, double period_s);

struct PwpfFigures {
  double dead_band;          ///< U_on/K_m: what is more than this fires
  double saturation;         ///< U_off/K_m + level: from here on it stays on; infinity where it never does
  double minimum_on_time_s;  ///< of a pulse, at the edge of the dead band; infinity where it stays on there
};
PwpfFigures figures(const PwpfModulator& modulator, double level);

struct SchmittFigures {
  double dead_band;   ///< from this on it fires
  double hysteresis;  ///< how much less than that it is when firing ends
};
SchmittFigures figures(const SchmittModulator& modulator, double level);

struct PulseWidthFigures {
  double dead_band;         ///< from this on it fires
  double saturation;        ///< the level
  double least_duty_cycle;  ///< but for none; above it the duty cycle is any
};
PulseWidthFigures figures(const PulseWidthModulator& modulator, double level, double period_s);

/// Fraction of the time that it is on, over a demand; of a Schmitt trigger that was off before. The period
/// (s) is that of a sampled law, which pulse width needs and the others do not look at.
double duty_cycle(const Modulator& modulator, double level, double demand, double period_s);

}  // namespace slew
