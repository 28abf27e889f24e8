// The first time at which a smooth function passes zero, found so that no crossing can be missed: an interval is
// let go only when a bound on the second derivative proves that it holds none.
#pragma once

#include <array>
#include <cmath>
#include <optional>

namespace slew {

/// A function at the middle of an interval, and a bound of |f''| over all of it.
struct ScanLook {
  double value;
  double slope;
  double curvature;
};

/// Within [a, b], where sign * f passes zero upwards once and is positive at b: the first time that it is, to
/// rounding. Regula falsi in the form of Illinois, with a bisection every fourth time.
template <typename Function>
double passing_time(const Function& f, int sign, double a, double b) {
  double below = sign * f.value(a), above = sign * f.value(b);
  if (below > 0) return a;
  int kept = 0;
  for (int i = 0; i < 200; ++i) {
    double middle = i % 4 == 3 ? 0.5 * (a + b) : b - above * (b - a) / (above - below);
    if (!(middle > a && middle < b)) middle = 0.5 * (a + b);
    if (!(middle > a && middle < b)) break;
    const double value = sign * f.value(middle);
    if (value > 0) {
      b = middle;
      above = value;
      if (kept == -1) below *= 0.5;
      kept = -1;
    } else {
      a = middle;
      below = value;
      if (kept == 1) above *= 0.5;
      kept = 1;
    }
  }
  return b;
}

/// The first time in [a, b] from which on sign * f is positive. A function that is so at `a` already and stays
/// so has crossed there; one that touches zero for less than `resolution` has not crossed at all.
/// `Function` has value(tau) and look(a, b).
template <typename Function>
std::optional<double> first_crossing(const Function& f, int sign, double a, double b, double resolution) {
  std::array<double, 80> ends;
  std::size_t depth = 0;
  ends[0] = b;
  while (true) {
    const double end = ends[depth];
    const double width = end - a;
    const ScanLook look = f.look(a, end);
    const double value = sign * look.value;
    const double reach = 0.5 * width * (std::abs(look.slope) + 0.25 * width * look.curvature);
    if (std::abs(value) > reach) {
      if (value > 0) return a;
    } else if (std::abs(look.slope) > 0.5 * width * look.curvature || width <= resolution ||
               depth + 1 == ends.size()) {
      // Monotone, or too short to look any closer.
      if (sign * f.value(end) > 0) return passing_time(f, sign, a, end);
    } else {
      ends[++depth] = 0.5 * (a + end);
      continue;
    }
    a = end;
    if (depth-- == 0) return std::nullopt;
  }
}

}  // namespace slew
