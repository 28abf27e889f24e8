#include "server/control/switching_function.hpp"

namespace slew {

SwitchingFunction::SwitchingFunction(const SwitchingFunctionParameters& parameters, double final_angle_rad,
                                     int direction)
    : final_angle_rad_(final_angle_rad),
      rate_gain_(parameters.rate_gain_s),
      curvature_(parameters.gamma_bar * parameters.inertia_kg_m2 / (2 * parameters.torque_N_m)),
      end_box_(parameters.end_box) {
  const double epsilon = parameters.deadband_rad;
  switch (parameters.deadband) {
    case Deadband::none:
      break;
    case Deadband::double_sided:
      lower_rad_ = -epsilon;
      upper_rad_ = epsilon;
      break;
    case Deadband::single_sided:
      (direction < 0 ? upper_rad_ : lower_rad_) = direction < 0 ? epsilon : -epsilon;
      break;
  }
  // A relay without a band switches half its hysteresis to either side of the line.
  const double hysteresis = parameters.hysteresis_rad;
  const double half = parameters.deadband == Deadband::none ? 0.5 * hysteresis : 0;
  enter_above_rad_ = upper_rad_ + half;
  leave_above_rad_ = enter_above_rad_ - hysteresis;
  enter_below_rad_ = lower_rad_ - half;
  leave_below_rad_ = enter_below_rad_ + hysteresis;
}

}  // namespace slew
