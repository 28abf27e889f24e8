#include "server/control/linear_feedback.hpp"

namespace slew {

std::vector<double> regulator_polynomial(const AttitudeRateFeedback& law, double inertia_kg_m2) {
  return {1, law.rate_gain_N_m_s_rad / inertia_kg_m2, law.attitude_gain_N_m_rad / inertia_kg_m2};
}

AttitudeRateFeedback place_regulator(std::complex<double> pole_rad_s, double inertia_kg_m2) {
  return {std::norm(pole_rad_s) * inertia_kg_m2, -2 * pole_rad_s.real() * inertia_kg_m2};
}

}  // namespace slew
