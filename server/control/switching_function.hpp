// The switching function of Agrawal & Bang 1995, Eq. 19, with its relatives (Eqs. 4, 7, 15, 17):
//   s = (theta - theta_f) + gamma_bar I*/(2 N*) omega |omega|.
#pragma once

#include <optional>

namespace slew {

enum class Deadband { none, double_sided, single_sided };

/// Inside |theta - theta_f| <= angle and |omega| <= rate nothing fires. Not latched.
struct EndBox {
  double angle_rad = 0;
  double rate_rad_s = 0;
};

struct SwitchingFunctionParameters {
  double inertia_kg_m2 = 1;  ///< I*, the law's belief
  double torque_N_m = 1;     ///< N*, the law's belief
  double gamma_bar = 1;
  Deadband deadband = Deadband::none;
  double deadband_rad = 0;  ///< epsilon
  std::optional<EndBox> end_box;
};

}  // namespace slew
