// The first time at which a smooth function passes zero, found so that no crossing can be missed: an interval
// is let go only when a bound on the second derivative proves that it holds none.
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

/// f and f' at one time.
struct ScanPoint {
  double value;
  double slope;
};

/// Within [a, b], where sign * f passes zero upwards once and is positive at b: the first time that it is, to
/// rounding. Newton's method, kept inside a bracket that every step makes smaller.
template <typename Function>
double passing_time(const Function& f, int sign, double a, double b) {
  const ScanPoint begin = f.at(a);
  if (sign * begin.value > 0) return a;
  const double rounding = 4e-16 * (std::abs(a) + std::abs(b));
  double tau = a, step = b - a;
  ScanPoint point = begin;
  for (int i = 0; i < 200 && b - a > rounding; ++i) {
    double next = tau - point.value / point.slope;
    // Out of the bracket, or no faster than halving it.
    if (!(next > a && next < b) || std::abs(next - tau) > 0.5 * std::abs(step)) next = 0.5 * (a + b);
    if (!(next > a && next < b)) break;
    step = next - tau;
    tau = next;
    point = f.at(tau);
    (sign * point.value > 0 ? b : a) = tau;
    if (std::abs(step) > rounding) continue;
    // Newton comes from one side: look just across for the other.
    const double across = sign * point.value > 0 ? tau - 2 * rounding : tau + 2 * rounding;
    if (across > a && across < b) (sign * f.at(across).value > 0 ? b : a) = across;
  }
  return b;
}

/// The first time in [a, b] from which on sign * f is positive. A function that is so at `a` already and
/// stays so has crossed there; one that touches zero for less than `resolution` has not crossed at all.
/// `Function` has at(tau) and look(a, b).
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
    } else if (reach == 0) {
      // Zero all along: never positive.
    } else if (std::abs(look.slope) > 0.5 * width * look.curvature || width <= resolution ||
               depth + 1 == ends.size()) {
      // Monotone, or too short to look any closer.
      if (sign * f.at(end).value > 0) return passing_time(f, sign, a, end);
    } else {
      ends[++depth] = 0.5 * (a + end);
      continue;
    }
    a = end;
    if (depth-- == 0) return std::nullopt;
  }
}

/// The next time in (from, h] at which the function changes its sign. `Function` has slope_bound(a, b) too.
template <typename Function>
std::optional<double> next_sign_change(const Function& f, double from, double h) {
  const double value = f.at(from).value;
  if (std::abs(value) > f.slope_bound(from, h) * (h - from)) return std::nullopt;
  const double resolution = 1e-13 * h;
  // From zero the function goes where its slope points.
  double start = from;
  int sign = value > 0 ? 1 : value < 0 ? -1 : 0;
  if (from > 0 || sign == 0) {
    start = from + std::fmin(1e-9 * (h - from), 0.5 * (h - from));
    const double after = f.at(start).value;
    sign = after > 0 ? 1 : after < 0 ? -1 : 0;
  }
  if (sign == 0) return std::nullopt;
  const auto change = first_crossing(f, -sign, start, h, resolution);
  return change && *change > start ? change : std::nullopt;
}

}  // namespace slew
