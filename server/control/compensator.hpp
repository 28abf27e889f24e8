// What a linear law and an estimator make together: from the measured attitude error z (and omega, where the
// rate is sensed) to the torque, in one state-space form
//   x' = A x + B z,    Q = k_0 (C x + D_z z + D_omega omega),
// and as the transfer functions that Bryson 1994 asks for in Problems 3.2.2 and 3.2.4. All but k_0 is that of
// k_0 = 1.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "server/control/linear_feedback.hpp"
#include "server/control/polynomial.hpp"
#include "server/estimation/angle_estimator.hpp"

namespace slew {

struct TransferFunction {
  Polynomial numerator;
  Polynomial denominator;  ///< monic
};

/// Where the estimator begins: the error as first measured unless told otherwise, and this rate.
struct InitialEstimate {
  std::optional<double> error_rad;
  double rate_rad_s = 0;
};

struct Compensator {
  Eigen::MatrixXd dynamics;    ///< A
  Eigen::VectorXd input;       ///< B
  Eigen::RowVectorXd torque;   ///< C, N m per unit of x
  double torque_of_angle = 0;  ///< D_z, N m/rad
  double torque_of_rate = 0;   ///< D_omega, N m s/rad; 0 where the rate is not sensed
  double loop_gain = 1;        ///< k_0
  TransferFunction of_angle;   ///< Q(s)/z(s), N m/rad; improper where the rate is sensed

  Eigen::Index size() const { return input.size(); }
};

/// Lead compensation has no use for an estimator and leaves it aside.
Compensator make_compensator(const LinearFeedback& feedback, const AngleEstimator& estimator);

/// x at t = 0 from the error measured there. Lead compensation begins at xi = 0.
Eigen::VectorXd initial_state(const LinearFeedback& feedback, const AngleEstimator& estimator,
                              double error_rad, const InitialEstimate& estimate);

/// Rate (rad/s), then error (rad), as an estimator in state x has them; only the second-order one infers the
/// error.
std::optional<double> estimated_rate_rad_s(const AngleEstimator& estimator, std::span<const double> x,
                                           double error_rad);
std::optional<double> estimated_error_rad(const AngleEstimator& estimator, std::span<const double> x);

}  // namespace slew
