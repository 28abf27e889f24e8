#include "server/estimation/angle_estimator.hpp"

namespace slew {

// With e = theta - theta^ and e_q = q - q^:  e_q' = -k_q e,  e' = e_q - k_theta e;  or e_q' = -ell e_q.
std::vector<double> error_polynomial(const AngleEstimator& estimator) {
  if (const auto* second = std::get_if<SecondOrderAngleEstimator>(&estimator))
    return {1, second->attitude_gain_1_s, second->rate_gain_1_s2};
  if (const auto* first = std::get_if<FirstOrderAngleEstimator>(&estimator)) return {1, first->gain_1_s};
  return {1};
}

SecondOrderAngleEstimator place_second_order(std::complex<double> pole_rad_s, double inertia_kg_m2) {
  return {std::norm(pole_rad_s), -2 * pole_rad_s.real(), inertia_kg_m2};
}

FirstOrderAngleEstimator place_first_order(double pole_rad_s, double inertia_kg_m2) {
  return {-pole_rad_s, inertia_kg_m2};
}

}  // namespace slew
