// Start, coast, stop: a pulse T sin^2(W t) of one sign, one of the other (Sung, Lee & Kim 2001, Eqs. 21 to
// 23, corrected), shaped or not. For a rest-to-rest slew about a fixed axis; as torque over inertia it is
// known for all times in closed form.
#pragma once

#include <vector>

#include "server/guidance/impulse_shaper.hpp"

namespace slew {

struct SineSquaredPulses {
  double torque_N_m = 1;     ///< T > 0
  double pulse_rad_s = 1;    ///< W, an angular frequency where the text says period
  double inertia_kg_m2 = 1;  ///< about the axis
  double angle_rad = 0;      ///< to be turned by; its sign is the start's

  /// t0: a pulse lasts so long.
  double pulse_s() const;
  /// Eq. 22: T/I (t0/2 - sin(2 W t0)/(4 W)), of which the second term is zero. Printed without the W it gives
  /// 2.138 deg/s instead of 5.884.
  double coast_rate_rad_s() const;
  /// theta_f over the coast rate: when the pulse of the other sign begins. Eq. 23 calls t0 more than this the
  /// coast; it is the length of the whole maneuver.
  double stop_s() const;
  double end_s() const { return stop_s() + pulse_s(); }
  /// Below it the stop begins before the start has ended, and neither reaches its peak.
  double least_angle_rad() const { return coast_rate_rad_s() * pulse_s(); }
};

struct SlewState {
  double angle_rad = 0;
  double rate_rad_s = 0;
  double acceleration_rad_s2 = 0;
};

class SineSquaredSlew {
 public:
  /// No impulses: one at once, unshaped.
  explicit SineSquaredSlew(const SineSquaredPulses& pulses, std::vector<Impulse> impulses = {});

  /// Turned since the start, at time t >= 0.
  SlewState at(double t_s) const;
  double torque_N_m(double t_s) const { return pulses_.inertia_kg_m2 * at(t_s).acceleration_rad_s2; }
  /// The end of the last pulse.
  double arrival_s() const;
  /// Where pulses begin and end, ascending: in between every derivative exists.
  const std::vector<double>& breaks_s() const { return breaks_s_; }
  const SineSquaredPulses& pulses() const { return pulses_; }
  const std::vector<Impulse>& impulses() const { return impulses_; }

 private:
  SineSquaredPulses pulses_;
  std::vector<Impulse> impulses_;
  std::vector<double> breaks_s_;
};

}  // namespace slew
