// Torques on a body in three axes besides the thrusters', in body axes. They add up.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

namespace slew {

/// A torque that acts from a time on.
struct BodyStepDisturbance {
  double from_s;
  Eigen::Vector3d torque_N_m;
};

/// A sin(W t + phi), one frequency and phase for all three axes.
struct BodySinusoid {
  Eigen::Vector3d amplitude_N_m;
  double frequency_rad_s;
  double phase_rad;
};

struct BodyDisturbances {
  Eigen::Vector3d constant_N_m = Eigen::Vector3d::Zero();  ///< from t = 0
  std::vector<BodyStepDisturbance> steps;                  ///< ascending, after t = 0
  std::vector<BodySinusoid> sinusoids;
};

}  // namespace slew
