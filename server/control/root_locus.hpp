// Closed-loop poles over the loop gain k_0 (Evans), and the gains that are stable.
#pragma once

#include <vector>

#include "server/control/control_loop.hpp"

namespace slew {

/// from < k_0 < to. The frequencies are those at which poles cross the imaginary axis at either end; empty
/// where nothing crosses (from = 0, to = infinity).
struct StableGains {
  double from = 0;
  double to = 0;
  std::optional<double> from_crossing_rad_s;
  std::optional<double> to_crossing_rad_s;
};

/// Ascending and apart from each other; empty when no gain makes every pole die out.
std::vector<StableGains> stable_gains(const ControlLoop& loop);

/// Every pole decays, by more than what rounding makes of a pole on the axis.
bool is_stable(const std::vector<std::complex<double>>& poles);

/// branches[i][j] is where pole i is at gains[j]; gains begin with 0.
struct RootLocus {
  std::vector<double> gains;
  std::vector<std::vector<std::complex<double>>> branches;
};

/// Up to most_gain, through every gain at which poles cross the axis and through k_0 = 1, in steps in which
/// no pole within `radius_rad_s` moves by more than a hundredth of it.
RootLocus root_locus(const ControlLoop& loop, double most_gain, double radius_rad_s);

}  // namespace slew
