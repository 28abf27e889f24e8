#include "server/actuator/least_thrust.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace slew {
namespace {

// Of numbers of order 1: what is smaller has come from rounding.
constexpr double kRounding = 1e-10;

}  // namespace

LeastThrust::LeastThrust(const ThrusterMatrix& torque_m) : torque_m_(torque_m) {
  const int count = static_cast<int>(torque_m.cols());
  for (int i = 0; i < count; ++i)
    for (int j = i + 1; j < count; ++j)
      for (int k = j + 1; k < count; ++k) {
        Eigen::Matrix3d columns;
        columns << torque_m.col(i), torque_m.col(j), torque_m.col(k);
        const double sizes = columns.colwise().norm().prod();
        if (!(std::abs(columns.determinant()) > kRounding * sizes)) continue;
        const Basis basis{{i, j, k}, columns.inverse()};
        if (is_optimal(basis)) bases_.push_back(basis);
      }
}

// The reduced cost of thruster j is 1 - sum w with w = (basis)^-1 (torque of j). Where that is zero the faces
// of the polyhedron have more than three corners; costs 1 + e_k with e_0 << e_1 << ... (Dantzig, Orden &
// Wolfe 1955) cut them into triangles that do not overlap: the largest e_k that remains decides.
bool LeastThrust::is_optimal(const Basis& basis) const {
  for (int j = 0; j < torque_m_.cols(); ++j) {
    const auto& own = basis.thrusters;
    if (std::find(own.begin(), own.end(), j) != own.end()) continue;
    const Eigen::Vector3d w = basis.inverse * torque_m_.col(j);
    const double rounding = kRounding * (1 + w.cwiseAbs().sum());
    const double reduced = 1 - w.sum();
    if (reduced > rounding) continue;
    if (reduced < -rounding) return false;
    for (int k = static_cast<int>(torque_m_.cols()) - 1; k >= 0; --k) {
      if (k == j) break;  // its own e_k counts for it
      const auto place = std::find(own.begin(), own.end(), k);
      if (place == own.end()) continue;
      const double of_trace = -w[place - own.begin()];
      if (of_trace > rounding) break;
      if (of_trace < -rounding) return false;
    }
  }
  return true;
}

void LeastThrust::allocate(const Eigen::Vector3d& torque_N_m, std::span<double> thrust_N) const {
  std::fill(thrust_N.begin(), thrust_N.end(), 0.0);
  // Inside its cone a basis gives positive thrusts, and no other does; where cones meet they agree.
  const Basis* best = nullptr;
  Eigen::Vector3d thrust = Eigen::Vector3d::Zero();
  double least = 0;
  for (const Basis& basis : bases_) {
    const Eigen::Vector3d candidate = basis.inverse * torque_N_m;
    if (best && candidate.minCoeff() <= least) continue;
    best = &basis;
    thrust = candidate;
    least = candidate.minCoeff();
  }
  if (!best) return;
  Eigen::Vector3d missing = torque_N_m;
  for (int i = 0; i < 3; ++i) missing -= thrust[i] * torque_m_.col(best->thrusters[i]);
  thrust += best->inverse * missing;
  for (int i = 0; i < 3; ++i) thrust_N[best->thrusters[i]] = std::max(thrust[i], 0.0);
}

}  // namespace slew
