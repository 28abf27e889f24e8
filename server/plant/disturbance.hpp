// Torques besides the thrusters'. They add up.
#pragma once

#include <vector>

namespace slew {

/// A torque that acts from a time on.
struct StepDisturbance {
  double from_s;
  double torque_N_m;  ///< positive towards +theta
  bool operator==(const StepDisturbance&) const = default;
};

/// A sin(W t + phi).
struct Sinusoid {
  double amplitude_N_m;
  double frequency_rad_s;
  double phase_rad;
  bool operator==(const Sinusoid&) const = default;
};

struct Disturbances {
  double constant_N_m = 0;             ///< from t = 0
  std::vector<StepDisturbance> steps;  ///< ascending, after t = 0
  std::vector<Sinusoid> sinusoids;
  double friction_N_m = 0;  ///< Coulomb's: against the motion, and at rest against whatever would start it
  bool operator==(const Disturbances&) const = default;
};

}  // namespace slew
