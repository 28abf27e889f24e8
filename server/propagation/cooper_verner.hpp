// Cooper & Verner's explicit Runge-Kutta method of order 8 in 11 stages (1972, SIAM J. Numer. Anal. 9,
// 389-405): for smooth motion between breaks that are known beforehand, at a step that the caller chooses.
#pragma once

#include <array>

namespace slew {

inline constexpr double kRootOf21 = 4.58257569495584000659;

/// Where the stages stand in a step: the nodes 0 to 4 are those of Lobatto's quadrature of order 8.
inline constexpr std::array<double, 5> kLobattoNodes = {0, (7 - kRootOf21) / 14, 0.5, (7 + kRootOf21) / 14,
                                                        1};
inline constexpr std::array<double, 5> kLobattoWeights = {1.0 / 20, 49.0 / 180, 16.0 / 45, 49.0 / 180,
                                                          1.0 / 20};

/// x moves on by h. `slope(node, x, dx)` is called with the index of the node, not with the time. Vector is
/// an Eigen vector.
template <typename Vector, typename Slope>
void cooper_verner_step(const Slope& slope, double h, Vector& x) {
  constexpr double s = kRootOf21;
  Vector k1, k2, k3, k4, k5, k6, k7, k8, k9, k10, k11, y;
  slope(0, x, k1);
  y = x + h / 2 * k1;
  slope(2, y, k2);
  y = x + h / 4 * (k1 + k2);
  slope(2, y, k3);
  y = x + h * (1.0 / 7 * k1 + (-7 - 3 * s) / 98 * k2 + (21 + 5 * s) / 49 * k3);
  slope(3, y, k4);
  y = x + h * ((11 + s) / 84 * k1 + (18 + 4 * s) / 63 * k3 + (21 - s) / 252 * k4);
  slope(3, y, k5);
  y = x + h * ((5 + s) / 48 * k1 + (9 + s) / 36 * k3 + (-231 + 14 * s) / 360 * k4 + (63 - 7 * s) / 80 * k5);
  slope(2, y, k6);
  y = x + h * ((10 - s) / 42 * k1 + (-432 + 92 * s) / 315 * k3 + (633 - 145 * s) / 90 * k4 +
               (-504 + 115 * s) / 70 * k5 + (63 - 13 * s) / 35 * k6);
  slope(1, y, k7);
  y = x + h * (1.0 / 14 * k1 + (14 - 3 * s) / 126 * k5 + (13 - 3 * s) / 63 * k6 + 1.0 / 9 * k7);
  slope(1, y, k8);
  y = x + h * (1.0 / 32 * k1 + (91 - 21 * s) / 576 * k5 + 11.0 / 72 * k6 + (-385 - 75 * s) / 1152 * k7 +
               (63 + 13 * s) / 128 * k8);
  slope(2, y, k9);
  y = x + h * (1.0 / 14 * k1 + 1.0 / 9 * k5 + (-733 - 147 * s) / 2205 * k6 + (515 + 111 * s) / 504 * k7 +
               (-51 - 11 * s) / 56 * k8 + (132 + 28 * s) / 245 * k9);
  slope(3, y, k10);
  y = x + h * ((-42 + 7 * s) / 18 * k5 + (-18 + 28 * s) / 45 * k6 + (-273 - 53 * s) / 72 * k7 +
               (301 + 53 * s) / 72 * k8 + (28 - 28 * s) / 45 * k9 + (49 - 7 * s) / 18 * k10);
  slope(4, y, k11);
  x += h * (1.0 / 20 * (k1 + k11) + 49.0 / 180 * (k8 + k10) + 16.0 / 45 * k9);
}

}  // namespace slew
