// Linear feedback of an attitude error through proportional thrusters (Bryson 1994, section 3.2):
//   attitude and rate:   Q = -D omega - K theta                                        (3.1)
//   lead compensation:   Q = -K (theta - xi),    xi' + b xi = (b - a) theta             (3.3), (3.4)
//                        Q(s) = -K (s + a)/(s + b) theta(s)                             (3.5)
// theta stands for theta - theta_f here: what is commanded is zero error.
#pragma once

#include <complex>
#include <variant>
#include <vector>

namespace slew {

struct AttitudeRateFeedback {
  double attitude_gain_N_m_rad = 1;  ///< K
  double rate_gain_N_m_s_rad = 1;    ///< D
};

struct LeadCompensation {
  double gain_N_m_rad = 1;  ///< K
  double zero_rad_s = 1;    ///< a: the zero is at s = -a
  double pole_rad_s = 2;    ///< b: the pole is at s = -b
};

struct LinearFeedback {
  std::variant<AttitudeRateFeedback, LeadCompensation> law;
  /// k_0 of Problems 3.2.2(e) and 3.2.4(e): multiplies the whole compensator. An estimator inside it goes on
  /// believing in k_0 = 1.
  double loop_gain = 1;
};

/// Whose roots are the poles of (3.1) on the rigid axis (3.2), monic: s^2 + D/I s + K/I.
std::vector<double> regulator_polynomial(const AttitudeRateFeedback& law, double inertia_kg_m2);

/// The gains that put these poles on p and its conjugate.
AttitudeRateFeedback place_regulator(std::complex<double> pole_rad_s, double inertia_kg_m2);

}  // namespace slew
