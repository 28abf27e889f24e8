// Torques besides the thrusters'. They add up.
#pragma once

#include <vector>

namespace slew {

/// A torque that acts from a time on.
struct StepDisturbance {
  double from_s;
  double torque_N_m;  ///< positive towards +theta
};

/// A sin(W t + phi).
struct Sinusoid {
  double amplitude_N_m;
  double frequency_rad_s;
  double phase_rad;
};

struct Disturbances {
  double constant_N_m = 0;             ///< from t = 0
  std::vector<StepDisturbance> steps;  ///< ascending, after t = 0
  std::vector<Sinusoid> sinusoids;
  double friction_N_m = 0;  ///< Coulomb's: against the motion, and at rest against whatever would start it

  double constant_at(double t_s) const {
    double torque = constant_N_m;
    for (const StepDisturbance& step : steps)
      if (step.from_s <= t_s) torque += step.torque_N_m;
    return torque;
  }
};

}  // namespace slew
