#include "server/guidance/sine_squared_pulses.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slew {
namespace {

/// sin^2(W t) on [0, t0], and its integrals from 0.
SlewState pulse(double w, double t0, double t) {
  if (t <= 0) return {};
  if (t >= t0) return {0.25 * t0 * t0 + (t - t0) * 0.5 * t0, 0.5 * t0, 0};
  const double sine = std::sin(w * t);
  return {0.25 * (t * t - sine * sine / (w * w)), 0.5 * (t - sine * std::cos(w * t) / w), sine * sine};
}

}  // namespace

double SineSquaredPulses::pulse_s() const {
  return std::numbers::pi / pulse_rad_s;
}

double SineSquaredPulses::coast_rate_rad_s() const {
  return torque_N_m / inertia_kg_m2 * 0.5 * pulse_s();
}

double SineSquaredPulses::stop_s() const {
  return std::abs(angle_rad) / coast_rate_rad_s();
}

SineSquaredSlew::SineSquaredSlew(const SineSquaredPulses& pulses, std::vector<Impulse> impulses)
    : pulses_(pulses), impulses_(std::move(impulses)) {
  if (impulses_.empty()) impulses_.push_back({0, 1});
  const double t0 = pulses_.pulse_s(), stop = pulses_.stop_s();
  for (const Impulse& impulse : impulses_)
    for (const double at : {0.0, t0, stop, stop + t0}) breaks_s_.push_back(impulse.time_s + at);
  std::sort(breaks_s_.begin(), breaks_s_.end());
  breaks_s_.erase(std::unique(breaks_s_.begin(), breaks_s_.end()), breaks_s_.end());
}

SlewState SineSquaredSlew::at(double t_s) const {
  if (pulses_.angle_rad == 0) return {};
  const double w = pulses_.pulse_rad_s, t0 = pulses_.pulse_s(), stop = pulses_.stop_s();
  const double size = std::copysign(pulses_.torque_N_m / pulses_.inertia_kg_m2, pulses_.angle_rad);
  SlewState sum;
  for (const Impulse& impulse : impulses_) {
    const double t = t_s - impulse.time_s;
    if (t <= 0) continue;
    const SlewState start = pulse(w, t0, t), end = pulse(w, t0, t - stop);
    sum.angle_rad += impulse.amplitude * size * (start.angle_rad - end.angle_rad);
    sum.rate_rad_s += impulse.amplitude * size * (start.rate_rad_s - end.rate_rad_s);
    sum.acceleration_rad_s2 +=
        impulse.amplitude * size * (start.acceleration_rad_s2 - end.acceleration_rad_s2);
  }
  return sum;
}

double SineSquaredSlew::arrival_s() const {
  return pulses_.end_s() + impulses_.back().time_s;
}

}  // namespace slew
