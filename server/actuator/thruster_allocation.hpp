// From a torque to what each thruster of a set is to give.
#pragma once

#include <Eigen/Core>
#include <span>
#include <variant>

#include "server/actuator/least_force.hpp"
#include "server/actuator/least_thrust.hpp"
#include "server/actuator/thruster_set.hpp"

namespace slew {

class ThrusterAllocation {
 public:
  /// Expects thrusters that can make every torque: none in torques_that_cannot_be_made
  /// (torque_authority.hpp).
  ThrusterAllocation(std::span<const Thruster> thrusters, AllocationMethod method);

  /// Thrust of each, N: not negative, and not limited to what the thruster has. They give the torque to
  /// rounding (1e-12 of it) and are continuous in it, and twice the torque is twice the thrust.
  /// Deterministic; allocates nothing; for twelve thrusters some 10 microseconds, a linear programme a tenth
  /// of one. Expects room for every thruster.
  void allocate(const Eigen::Vector3d& torque_N_m, std::span<double> thrust_N) const;

 private:
  std::variant<LeastForce, LeastThrust> method_;
};

}  // namespace slew
