#include "server/actuator/torque_authority.hpp"

#include <Eigen/QR>
#include <cmath>

#include "server/actuator/thruster_matrix.hpp"

namespace slew {
namespace {

constexpr double kTolerance = 1e-9;

struct Search {
  bool found[3][2] = {};

  // Some non-negative combination of these columns, which may depend on each other.
  void look_at(const Eigen::Matrix3d& columns) {
    const Eigen::ColPivHouseholderQR<Eigen::Matrix3d> factor(columns);
    for (int axis = 0; axis < 3; ++axis)
      for (int sign = 0; sign < 2; ++sign) {
        if (found[axis][sign]) continue;
        const Eigen::Vector3d torque = (sign ? -1 : 1) * Eigen::Vector3d::Unit(axis);
        const Eigen::Vector3d thrust = factor.solve(torque);
        found[axis][sign] =
            thrust.minCoeff() >= -kTolerance && (columns * thrust.cwiseMax(0) - torque).norm() <= kTolerance;
      }
  }
};

}  // namespace

// A vector in the cone of some columns is in that of three or fewer (Caratheodory). A repeated column stands
// for one less.
std::vector<AxisDirection> torques_that_cannot_be_made(std::span<const Thruster> thrusters) {
  ThrusterMatrix torque = torque_matrix_m(thrusters);
  for (Eigen::Index i = 0; i < torque.cols(); ++i)
    if (const double size = torque.col(i).norm(); size > 0) torque.col(i) /= size;

  Search search;
  for (Eigen::Index i = 0; i < torque.cols(); ++i)
    for (Eigen::Index j = i; j < torque.cols(); ++j)
      for (Eigen::Index k = j; k < torque.cols(); ++k) {
        Eigen::Matrix3d columns;
        columns << torque.col(i), torque.col(j), torque.col(k);
        search.look_at(columns);
      }

  std::vector<AxisDirection> missing;
  for (int axis = 0; axis < 3; ++axis)
    for (int sign = 0; sign < 2; ++sign)
      if (!search.found[axis][sign]) missing.push_back({axis, sign ? -1 : 1});
  return missing;
}

}  // namespace slew
