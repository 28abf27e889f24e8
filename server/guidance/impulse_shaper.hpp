// Input shaping: a command, convolved with impulses that sum to 1, leaves no vibration in the modes that they
// are made for (Singer & Seering 1990), whatever the command and the plant.
#pragma once

#include <vector>

namespace slew {

struct Impulse {
  double time_s;
  double amplitude;
};

/// Two impulses, half a damped period apart (ZV): A1 = 1/(1+K), A2 = K/(1+K),
/// K = exp(-zeta pi / sqrt(1 - zeta^2)). Expects 0 <= zeta < 1.
std::vector<Impulse> zero_vibration(double frequency_rad_s, double damping_ratio);

/// Three (ZVD): the vibration's slope over the mode's frequency is zero too. It is the ZV shaper twice.
std::vector<Impulse> zero_vibration_and_derivative(double frequency_rad_s, double damping_ratio);

/// One shaper after the other: for two modes at once.
std::vector<Impulse> convolved(const std::vector<Impulse>& a, const std::vector<Impulse>& b);

/// What is left of the vibration of a mode after the last impulse, over that of a single impulse of 1.
double residual_vibration(const std::vector<Impulse>& impulses, double frequency_rad_s, double damping_ratio);

}  // namespace slew
