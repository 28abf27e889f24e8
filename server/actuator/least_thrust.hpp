// Least total thrust that gives a torque: the linear programme
//   min sum f  with  B f = torque, f >= 0
// for every torque at once. The torque is on the right-hand side only, so that a basis of three thrusters
// whose reduced costs are not negative is optimal for all torques in its cone (parametric programming; Gal
// 1995, "Postoptimal Analyses, Parametric Programming, and Related Topics", ch. 4). These cones tile the
// space.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "server/actuator/thruster_matrix.hpp"

namespace slew {

class LeastThrust {
 public:
  /// Thrusters 3 x n, torque for each newton, m. Expects that they can make every torque.
  explicit LeastThrust(const ThrusterMatrix& torque_m);

  /// Continuous in the torque: where several sets of thrusters cost the same, each direction has one of its
  /// own all the same, as if later thrusters were dearer by a trace. Allocates nothing.
  void allocate(const Eigen::Vector3d& torque_N_m, std::span<double> thrust_N) const;

  /// At most 2 n - 4: the faces of a convex polyhedron.
  std::size_t bases() const { return bases_.size(); }

 private:
  struct Basis {
    std::array<int, 3> thrusters;
    Eigen::Matrix3d inverse;  ///< thrust of each for a torque, 1/m
  };
  bool is_optimal(const Basis& basis) const;

  ThrusterMatrix torque_m_;
  std::vector<Basis> bases_;
};

}  // namespace slew
