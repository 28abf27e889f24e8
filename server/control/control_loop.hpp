// The linear closed loop of one axis: plant, compensator and loop gain k_0 as x' = A(k_0) x + b d, with the
// error theta - theta_f, the rate, q_i, q_i' and the compensator's state in x and a torque d besides the
// thrusters'.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <vector>

#include "server/control/compensator.hpp"
#include "server/plant/single_axis.hpp"

namespace slew {

class ControlLoop {
 public:
  ControlLoop(SingleAxisPlant plant, const LinearFeedback& feedback, const AngleEstimator& estimator);

  const SingleAxisPlant& plant() const { return plant_; }
  const Compensator& compensator() const { return compensator_; }
  Eigen::Index size() const { return open_.rows(); }

  /// A(k_0) = A(0) + k_0 b c.
  Eigen::MatrixXd matrix(double loop_gain) const;
  const Eigen::MatrixXd& open() const { return open_; }
  const Eigen::VectorXd& torque_input() const { return input_; }  ///< b, per N m
  const Eigen::RowVectorXd& torque() const { return torque_; }    ///< c, N m, of k_0 = 1

  /// Ascending by magnitude, of a pair the upper one first. By quadratic formulas where the loop falls apart
  /// into its regulator and its estimator, so that double poles come out as such; by eigenvalues otherwise.
  std::vector<std::complex<double>> poles(double loop_gain) const;
  /// Of the rigid axis, highest power first and monic: s^2 den - k_0 num/I. Empty with elastic modes.
  Polynomial characteristic_polynomial(double loop_gain) const;

  /// L(s) = -Q(s)/theta(s) theta(s)/Q(s) of k_0 = 1. Infinite at a pole.
  std::complex<double> loop_response(std::complex<double> s) const;
  /// Its zeros and poles.
  std::vector<std::complex<double>> loop_zeros() const;
  std::vector<std::complex<double>> loop_poles() const;

 private:
  SingleAxisPlant plant_;
  Compensator compensator_;
  Eigen::MatrixXd open_;
  Eigen::VectorXd input_;
  Eigen::RowVectorXd torque_;
  bool is_direct_;                   ///< both attitude and rate are sensed
  std::vector<Polynomial> factors_;  ///< of the characteristic polynomial of k_0 = 1, where it has them
};

/// -Re s/|s|; 1 at the origin.
double damping_ratio(std::complex<double> pole);

/// Ascending by magnitude, of a pair the upper one first.
std::vector<std::complex<double>> eigenvalues(const Eigen::MatrixXd& matrix);

}  // namespace slew
