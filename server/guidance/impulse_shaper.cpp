#include "server/guidance/impulse_shaper.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace slew {

std::vector<Impulse> zero_vibration(double frequency_rad_s, double damping_ratio) {
  const double root = std::sqrt(1 - damping_ratio * damping_ratio);
  const double k = std::exp(-damping_ratio * std::numbers::pi / root);
  return {{0, 1 / (1 + k)}, {std::numbers::pi / (frequency_rad_s * root), k / (1 + k)}};
}

std::vector<Impulse> zero_vibration_and_derivative(double frequency_rad_s, double damping_ratio) {
  const auto once = zero_vibration(frequency_rad_s, damping_ratio);
  return {{0, once[0].amplitude * once[0].amplitude},
          {once[1].time_s, 2 * once[0].amplitude * once[1].amplitude},
          {2 * once[1].time_s, once[1].amplitude * once[1].amplitude}};
}

std::vector<Impulse> convolved(const std::vector<Impulse>& a, const std::vector<Impulse>& b) {
  std::vector<Impulse> out;
  for (const Impulse& first : a)
    for (const Impulse& second : b)
      out.push_back({first.time_s + second.time_s, first.amplitude * second.amplitude});
  std::stable_sort(out.begin(), out.end(),
                   [](const Impulse& x, const Impulse& y) { return x.time_s < y.time_s; });
  return out;
}

double residual_vibration(const std::vector<Impulse>& impulses, double frequency_rad_s,
                          double damping_ratio) {
  const double decay = damping_ratio * frequency_rad_s;
  const double damped = frequency_rad_s * std::sqrt(1 - damping_ratio * damping_ratio);
  std::complex<double> sum = 0;
  for (const Impulse& impulse : impulses)
    sum += impulse.amplitude *
           std::exp(std::complex<double>(decay, damped) * (impulse.time_s - impulses.back().time_s));
  return std::abs(sum);
}

}  // namespace slew
