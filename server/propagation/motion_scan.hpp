// Scans of a smooth motion for the times at which its angle or its rate has a value. An arc has at(tau)
// and bounds of |acceleration| and |jerk| on an interval.
#pragma once

#include <cmath>
#include <optional>

#include "server/propagation/crossing_scan.hpp"

namespace slew {

struct AxisMotion {
  double angle_rad;
  double rate_rad_s;
  double acceleration_rad_s2;
};

/// theta - level.
template <typename Arc>
struct AngleScan {
  const Arc& arc;
  double level_rad;
  ScanPoint at(double tau) const {
    const AxisMotion motion = arc.at(tau);
    return {motion.angle_rad - level_rad, motion.rate_rad_s};
  }
  ScanLook look(double a, double b) const {
    const AxisMotion middle = arc.at(0.5 * (a + b));
    const double bound = std::abs(middle.acceleration_rad_s2) + 0.5 * (b - a) * arc.jerk_bound(a, b);
    return {middle.angle_rad - level_rad, middle.rate_rad_s, bound};
  }
};

/// omega - level.
template <typename Arc>
struct RateScan {
  const Arc& arc;
  double level_rad_s;
  ScanPoint at(double tau) const {
    const AxisMotion motion = arc.at(tau);
    return {motion.rate_rad_s - level_rad_s, motion.acceleration_rad_s2};
  }
  ScanLook look(double a, double b) const {
    const AxisMotion middle = arc.at(0.5 * (a + b));
    return {middle.rate_rad_s - level_rad_s, middle.acceleration_rad_s2, arc.jerk_bound(a, b)};
  }
  double slope_bound(double a, double b) const { return arc.acceleration_bound(a, b); }
};

/// The next time in (from, h] at which the rate changes its sign.
template <typename Arc>
std::optional<double> next_rest(const Arc& arc, double from, double h) {
  return next_sign_change(RateScan<Arc>{arc, 0}, from, h);
}

}  // namespace slew
