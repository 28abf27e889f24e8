#include "server/control/compensator.hpp"

namespace slew {
namespace {

// Both rates and angles sensed, Eq. 3.1.
Compensator direct(const AttitudeRateFeedback& law) {
  const double K = law.attitude_gain_N_m_rad, D = law.rate_gain_N_m_s_rad;
  Compensator made;
  made.torque_of_angle = -K;
  made.torque_of_rate = -D;
  made.of_angle = {{-D, -K}, {1}};
  return made;
}

// x = xi, Eqs. 3.3 to 3.5.
Compensator lead(const LeadCompensation& law) {
  const double K = law.gain_N_m_rad, a = law.zero_rad_s, b = law.pole_rad_s;
  Compensator made;
  made.dynamics = Eigen::MatrixXd::Constant(1, 1, -b);
  made.input = Eigen::VectorXd::Constant(1, b - a);
  made.torque = Eigen::RowVectorXd::Constant(1, K);
  made.torque_of_angle = -K;
  made.of_angle = {{-K, -K * a}, {1, b}};
  return made;
}

// x = (q^, theta^), Problem 3.2.2(a): Q = -D q^ - K theta^ put into the estimator of Problem 3.2.1.
Compensator estimated(const AttitudeRateFeedback& law, const SecondOrderAngleEstimator& estimator) {
  const double K = law.attitude_gain_N_m_rad, D = law.rate_gain_N_m_s_rad;
  const double k_q = estimator.rate_gain_1_s2, k_theta = estimator.attitude_gain_1_s;
  const double K_I = K / estimator.inertia_kg_m2, D_I = D / estimator.inertia_kg_m2;
  Compensator made;
  made.dynamics = Eigen::MatrixXd{{-D_I, -K_I - k_q}, {1, -k_theta}};
  made.input = Eigen::Vector2d(k_q, k_theta);
  made.torque = Eigen::RowVector2d(-D, -K);
  made.of_angle = {{-(D * k_q + K * k_theta), -K * k_q}, {1, D_I + k_theta, D_I * k_theta + K_I + k_q}};
  return made;
}

// x = q*, Problem 3.2.4(a): Q = -D q^ - K z put into the estimator of Problem 3.2.3.
Compensator estimated(const AttitudeRateFeedback& law, const FirstOrderAngleEstimator& estimator) {
  const double K = law.attitude_gain_N_m_rad, D = law.rate_gain_N_m_s_rad;
  const double ell = estimator.gain_1_s;
  const double K_I = K / estimator.inertia_kg_m2, D_I = D / estimator.inertia_kg_m2;
  Compensator made;
  made.dynamics = Eigen::MatrixXd::Constant(1, 1, -(ell + D_I));
  made.input = Eigen::VectorXd::Constant(1, -(ell + D_I) * ell - K_I);
  made.torque = Eigen::RowVectorXd::Constant(1, -D);
  made.torque_of_angle = -(D * ell + K);
  made.of_angle = {{-(D * ell + K), -K * ell}, {1, ell + D_I}};
  return made;
}

}  // namespace

Compensator make_compensator(const LinearFeedback& feedback, const AngleEstimator& estimator) {
  Compensator made;
  if (const auto* law = std::get_if<LeadCompensation>(&feedback.law))
    made = lead(*law);
  else if (const auto* second = std::get_if<SecondOrderAngleEstimator>(&estimator))
    made = estimated(std::get<AttitudeRateFeedback>(feedback.law), *second);
  else if (const auto* first = std::get_if<FirstOrderAngleEstimator>(&estimator))
    made = estimated(std::get<AttitudeRateFeedback>(feedback.law), *first);
  else
    made = direct(std::get<AttitudeRateFeedback>(feedback.law));
  made.loop_gain = feedback.loop_gain;
  return made;
}

Eigen::VectorXd initial_state(const LinearFeedback& feedback, const AngleEstimator& estimator,
                              double error_rad, const InitialEstimate& estimate) {
  if (std::holds_alternative<LeadCompensation>(feedback.law)) return Eigen::VectorXd::Zero(1);
  if (std::holds_alternative<SecondOrderAngleEstimator>(estimator))
    return Eigen::Vector2d(estimate.rate_rad_s, estimate.error_rad.value_or(error_rad));
  if (const auto* first = std::get_if<FirstOrderAngleEstimator>(&estimator))
    return Eigen::VectorXd::Constant(1, estimate.rate_rad_s - first->gain_1_s * error_rad);
  return {};
}

std::optional<double> estimated_rate_rad_s(const AngleEstimator& estimator, std::span<const double> x,
                                           double error_rad) {
  if (std::holds_alternative<SecondOrderAngleEstimator>(estimator)) return x[0];
  if (const auto* first = std::get_if<FirstOrderAngleEstimator>(&estimator))
    return x[0] + first->gain_1_s * error_rad;
  return std::nullopt;
}

std::optional<double> estimated_error_rad(const AngleEstimator& estimator, std::span<const double> x) {
  return std::holds_alternative<SecondOrderAngleEstimator>(estimator) ? std::optional(x[1]) : std::nullopt;
}

}  // namespace slew
