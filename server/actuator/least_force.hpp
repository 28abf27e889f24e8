// Torque exactly as asked for, with as little net force as can be:
//   min |F f|^2 + eps |f|^2  with  B f = torque, f >= 0.
// That the torque is a constraint and not one more row of a least-squares problem keeps it exact; eps makes
// the solution unique, and so continuous (piecewise linear) in the torque. Solved by the dual active set
// method (Goldfarb & Idnani 1983), which begins with all thrusters free and takes out those that would have
// to pull; unlike the method for non-negative least squares (Lawson & Hanson 1974, ch. 23), which gives the
// same minimum, it needs no penalty for the torque and cannot cycle where thrusts are zero.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "server/actuator/thruster_matrix.hpp"

namespace slew {

class LeastForce {
 public:
  /// eps: what a thrust counts against a net force of the same size.
  static constexpr double kOfThrust = 1e-6;

  /// Both 3 x n: torque for each newton, m, and force for each newton. Expects that every torque can be made.
  LeastForce(const ThrusterMatrix& torque_m, const ThrusterMatrix& force);

  /// Allocates nothing.
  void allocate(const Eigen::Vector3d& torque_N_m, std::span<double> thrust_N) const;

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Thrusts = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, int{kMaxThrusters}, 1>;
  using Set = std::uint32_t;  ///< of thrusters: a bit for each
  class Free;

  Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, int{kMaxThrusters}> columns_;
  double arm_m_ = 1;  ///< the longest: torques are divided by it, so that rows are of one size
};

}  // namespace slew
