// Where a function goes from not positive to positive: regula falsi that halves a value which stays (Dowell &
// Jarratt's Illinois rule).
#pragma once

namespace slew {

struct PointOfFunction {
  double x, value;
};

/// Between a point at which f is not positive and a later one at which it is; to the given part of x, and not
/// before it.
template <typename Function>
double becomes_positive(const Function& f, PointOfFunction from, PointOfFunction until, double tolerance) {
  int stayed = 0;
  for (int i = 0; i < 100 && until.x - from.x > tolerance * until.x; ++i) {
    double x = until.x - until.value * (until.x - from.x) / (until.value - from.value);
    if (!(x > from.x && x < until.x)) x = 0.5 * (from.x + until.x);
    if (!(x > from.x && x < until.x)) break;
    const double value = f(x);
    if (value == 0) return x;
    if (value > 0) {
      until = {x, value};
      if (stayed == 1) from.value *= 0.5;
      stayed = 1;
    } else {
      from = {x, value};
      if (stayed == -1) until.value *= 0.5;
      stayed = -1;
    }
  }
  return until.x;
}

}  // namespace slew
