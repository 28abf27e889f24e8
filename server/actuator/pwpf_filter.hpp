// The lag of a pulse-width pulse-frequency modulator while its demand and its output stay as they are, in
// closed form: T_m f' = -f + target with target = K_m (demand - U level) (Kim & Crassidis 1998, Fig. 1).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/actuator/modulator.hpp"

namespace slew {

/// What the filter sees of a demand on a channel of this level (both N m, or both N): raw, clipped or scaled.
inline double pwpf_input(const PwpfModulator& modulator, double level, double demand) {
  switch (modulator.input) {
    case ModulatorInput::raw:
      return demand;
    case ModulatorInput::clipped:
      return std::clamp(demand, -level, level);
    case ModulatorInput::scaled:
      return demand / level;
  }
  return demand;
}

/// What comes back from a channel that fires, in the same terms.
inline double pwpf_feedback(const PwpfModulator& modulator, double level) {
  return modulator.input == ModulatorInput::scaled ? 1 : level;
}

/// Where the filter tends to, with the output at -1, 0 or 1.
inline double pwpf_target(const PwpfModulator& modulator, double level, double demand, int output) {
  return modulator.gain * (pwpf_input(modulator, level, demand) - output * pwpf_feedback(modulator, level));
}

/// The filter dt later.
inline double filter_after(const PwpfModulator& modulator, double filter, double target, double dt_s) {
  return filter - (target - filter) * std::expm1(-dt_s / modulator.time_constant_s);
}

/// How long the filter takes to get to a threshold: nothing when it is there, infinity when it never does, or
/// only tends to it.
inline double time_to_reach(const PwpfModulator& modulator, double filter, double target, double threshold) {
  if (filter == threshold) return 0;
  const double part = (threshold - filter) / (target - filter);
  if (!(part > 0 && part < 1)) return std::numeric_limits<double>::infinity();
  return -modulator.time_constant_s * std::log1p(-part);
}

}  // namespace slew
