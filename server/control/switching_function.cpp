#include "server/control/switching_function.hpp"

namespace slew {

SwitchingFunction::SwitchingFunction(const SwitchingFunctionParameters& parameters, double final_angle_rad,
                                     int direction)
    : final_angle_rad_(final_angle_rad),
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
}

}  // namespace slew
