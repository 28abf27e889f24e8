// A first-order lag T f' = limit - f under an input that is held.
#pragma once

#include <cmath>
#include <limits>

namespace slew {

inline double lag_after(double f, double limit, double time_constant_s, double h_s) {
  return limit + (f - limit) * std::exp(-h_s / time_constant_s);
}

/// How long f takes to reach a threshold between it and the limit; infinity where it never does.
inline double lag_reaches_s(double f, double limit, double time_constant_s, double threshold) {
  const double ratio = (f - limit) / (threshold - limit);
  const bool is_ahead = (f < threshold && threshold < limit) || (limit < threshold && threshold < f);
  return is_ahead ? time_constant_s * std::log(ratio) : std::numeric_limits<double>::infinity();
}

}  // namespace slew
