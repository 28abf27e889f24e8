// A quartic on [0, 1] in Bernstein's form, and where it first becomes positive. Its coefficients bound it,
// and their changes of sign count its roots (Descartes' rule), so that no root is missed.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "server/propagation/becomes_positive.hpp"

namespace slew {

class Quartic {
 public:
  /// Through the values at 0, 1/4, 1/2, 3/4, 1.
  static Quartic through(const std::array<double, 5>& v) {
    return Quartic({v[0], (-13 * v[0] + 48 * v[1] - 36 * v[2] + 16 * v[3] - 3 * v[4]) / 12,
                    (13 * v[0] - 64 * v[1] + 120 * v[2] - 64 * v[3] + 13 * v[4]) / 18,
                    (-3 * v[0] + 16 * v[1] - 36 * v[2] + 48 * v[3] - 13 * v[4]) / 12, v[4]});
  }

  /// Of the curve through such values, cheaply: true where it is below zero, but not always there. Its
  /// coefficients leave the range of the values by 7.2 times that range at most.
  static bool is_far_below(const std::array<double, 5>& v) {
    const auto [least, most] = std::minmax({v[0], v[1], v[2], v[3], v[4]});
    return most + 7.2 * (most - least) < 0;
  }

  double at(double x) const {
    std::array<double, 5> b = b_;
    for (int n = 4; n > 0; --n)
      for (int i = 0; i < n; ++i) b[i] += x * (b[i + 1] - b[i]);
    return b[0];
  }

  /// sign * (this - offset).
  Quartic shifted(double sign, double offset) const {
    std::array<double, 5> b;
    for (int i = 0; i < 5; ++i) b[i] = sign * (b_[i] - offset);
    return Quartic(b);
  }
  /// The same curve from its other end.
  Quartic reversed() const { return Quartic({b_[4], b_[3], b_[2], b_[1], b_[0]}); }

  bool is_nowhere_positive() const {
    return std::all_of(b_.begin(), b_.end(), [](double b) { return b <= 0; });
  }

  /// The first x in [0, 1] from which on it is positive, to this part of itself; empty where it never is.
  std::optional<double> first_positive(double tolerance = 1e-16) const {
    return first_positive(0, 1, 0, tolerance);
  }

 private:
  explicit Quartic(const std::array<double, 5>& b) : b_(b) {}

  std::optional<double> first_positive(double begin, double end, int depth, double tolerance) const {
    constexpr int kDeepest = 48;
    if (is_nowhere_positive()) return std::nullopt;
    if (b_[0] > 0) return begin;
    if (b_[4] > 0 && sign_changes() == 1) return begin + root(tolerance) * (end - begin);
    if (depth == kDeepest) return std::nullopt;  // touches zero for less than rounding
    const double middle = 0.5 * (begin + end);
    const auto [left, right] = halves();
    if (const auto x = left.first_positive(begin, middle, depth + 1, tolerance)) return x;
    return right.first_positive(middle, end, depth + 1, tolerance);
  }

  int sign_changes() const {
    int changes = 0;
    bool is_positive = false;
    for (const double b : b_) {
      if (b == 0 || (b > 0) == is_positive) continue;
      is_positive = !is_positive;
      ++changes;
    }
    return changes;
  }

  std::pair<Quartic, Quartic> halves() const {
    std::array<double, 5> b = b_, left, right;
    for (int n = 4; n >= 0; --n) {
      left[4 - n] = b[0];
      right[n] = b[n];
      for (int i = 0; i < n; ++i) b[i] = 0.5 * (b[i] + b[i + 1]);
    }
    return {Quartic(left), Quartic(right)};
  }

  // Where it goes from not positive to positive, once.
  double root(double tolerance) const {
    return becomes_positive([this](double x) { return at(x); }, {0, b_[0]}, {1, b_[4]}, tolerance);
  }

  std::array<double, 5> b_;
};

}  // namespace slew
