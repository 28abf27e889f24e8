// A step of the solver as a polynomial: positions are of the fifth degree through their values, rates and
// accelerations at both ends, so that rates are their derivatives; what the filter estimates is cubic.
#pragma once

#include <Eigen/Core>

namespace slew {

/// Weights of (f, f', f'') at both ends, f' and f'' over the step's length and its square: of the value at s
/// in [0, 1], and of its derivative over s.
struct QuinticWeights {
  double value[6], slope[6];

  explicit QuinticWeights(double s) {
    const double r = 1 - s;
    const double s2 = s * s, r2 = r * r;
    value[0] = r2 * r * (1 + 3 * s + 6 * s2);
    value[1] = s * r2 * r * (1 + 3 * s);
    value[2] = 0.5 * s2 * r2 * r;
    value[3] = s2 * s * (1 + 3 * r + 6 * r2);
    value[4] = -r * s2 * s * (1 + 3 * r);
    value[5] = 0.5 * r2 * s2 * s;
    slope[0] = -30 * s2 * r2;
    slope[1] = r2 * (1 + 2 * s - 15 * s2);
    slope[2] = s * r2 * (1 - 2.5 * s);
    slope[3] = 30 * s2 * r2;
    slope[4] = s2 * (1 + 2 * r - 15 * r2);
    slope[5] = -r * s2 * (1 - 2.5 * r);
  }
};

/// One scalar on a step.
struct Quintic {
  double terms[6];

  Quintic(double h, double f0, double df0, double ddf0, double f1, double df1, double ddf1)
      : terms{f0, h * df0, h * h * ddf0, f1, h * df1, h * h * ddf1} {}
  double at(const QuinticWeights& weights) const { return sum(weights.value); }
  double at(double s) const { return at(QuinticWeights(s)); }
  double slope(const QuinticWeights& weights, double h) const { return sum(weights.slope) / h; }

 private:
  double sum(const double* weights) const {
    double total = 0;
    for (int i = 0; i < 6; ++i) total += weights[i] * terms[i];
    return total;
  }
};

/// The whole state of a structure's loop on a step of length h: blocks [positions, rates] of `plant` and of
/// `tracked` each, then `filtered` values.
struct StructurePiece {
  double from_s, length_s;
  const double *y0, *rate0, *y1, *rate1;
  Eigen::Index plant, tracked, filtered;

  void state_at(double s, double* y) const {
    const QuinticWeights w(s);
    Eigen::Index at = 0;
    for (const Eigen::Index n : {plant, tracked}) {
      for (Eigen::Index i = at; i < at + n; ++i) {
        const Quintic q(length_s, y0[i], y0[i + n], rate0[i + n], y1[i], y1[i + n], rate1[i + n]);
        y[i] = q.at(w);
        y[i + n] = q.slope(w, length_s);
      }
      at += 2 * n;
    }
    const double r = 1 - s, h = length_s;
    for (Eigen::Index i = at; i < at + filtered; ++i)
      y[i] =
          r * r * ((1 + 2 * s) * y0[i] + h * s * rate0[i]) + s * s * ((1 + 2 * r) * y1[i] - h * r * rate1[i]);
  }
};

}  // namespace slew
