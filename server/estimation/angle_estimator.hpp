// Estimators of attitude rate, and of attitude, from a measured attitude z and the commanded torque Q (Bryson
// 1994, Problems 3.2.1 and 3.2.3). Hats are estimates, I* is the inertia that the estimator believes in.
#pragma once

#include <complex>
#include <variant>
#include <vector>

namespace slew {

/// Problem 3.2.1, for a noisy z:
///   q^' = Q/I* + k_q (z - theta^),    theta^' = q^ + k_theta (z - theta^).
struct SecondOrderAngleEstimator {
  double rate_gain_1_s2 = 1;     ///< k_q
  double attitude_gain_1_s = 1;  ///< k_theta
  double inertia_kg_m2 = 1;      ///< I*
};

/// Problem 3.2.3, for a z with little noise:
///   q^ = q* + ell z,    q*' = -ell q^ + Q/I*.
/// Its "note that" prints the innovation as ell (z - q^); from these two lines it is ell (z' - q^).
struct FirstOrderAngleEstimator {
  double gain_1_s = 1;       ///< ell
  double inertia_kg_m2 = 1;  ///< I*
};

/// Without one (monostate) attitude and rate are both sensed.
using AngleEstimator = std::variant<std::monostate, SecondOrderAngleEstimator, FirstOrderAngleEstimator>;

/// Whose roots are the estimate-error poles when I* is the plant's, highest power first and monic: s^2 +
/// k_theta s + k_q, s + ell, or 1.
std::vector<double> error_polynomial(const AngleEstimator& estimator);

/// The gains that put the estimate-error poles on p and its conjugate, or the only one on a real p.
SecondOrderAngleEstimator place_second_order(std::complex<double> pole_rad_s, double inertia_kg_m2);
FirstOrderAngleEstimator place_first_order(double pole_rad_s, double inertia_kg_m2);

}  // namespace slew
