// What the loop does at a frequency: Bode's curves, crossovers, margins.
#pragma once

#include <span>
#include <vector>

#include "server/control/control_loop.hpp"

namespace slew {

/// A frequency at which L is real and negative, and the k_0 that puts a closed-loop pole there.
struct PhaseCrossover {
  double frequency_rad_s;
  double loop_gain;
};

/// A frequency at which |k_0 L| = 1, and how far its phase is above -180 deg, in (-180, 180].
struct GainCrossover {
  double frequency_rad_s;
  double phase_margin_deg;
};

/// All with k_0 between 1e-9 and 1e9, ascending by frequency. From an eigenvalue problem, so that none
/// between two points of a grid is missed, then refined on L itself.
std::vector<PhaseCrossover> phase_crossovers(const ControlLoop& loop);
std::vector<GainCrossover> gain_crossovers(const ControlLoop& loop, double loop_gain);

struct BodePoint {
  double frequency_rad_s;
  double magnitude_dB;
  double phase_deg;  ///< continuous but at an undamped pole or zero, -180 where only two integrators act
};

std::vector<BodePoint> bode(const ControlLoop& loop, double loop_gain, std::span<const double> frequencies);

/// Logarithmic, from well below to well above what the loop has, denser around lightly damped modes.
std::vector<double> bode_grid(const ControlLoop& loop, double loop_gain, std::size_t points = 400);

}  // namespace slew
