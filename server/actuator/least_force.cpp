#include "server/actuator/least_force.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace slew {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-14;
constexpr double kRank = 1e-6;  // of lever arms, the least against the greatest

}  // namespace

LeastForce::LeastForce(const ThrusterMatrix& torque_m, const ThrusterMatrix& force)
    : columns_(6, torque_m.cols()) {
  if (torque_m.cols() > 0 && !torque_m.isZero(0)) arm_m_ = torque_m.colwise().norm().maxCoeff();
  columns_ << torque_m / arm_m_, force;
}

// With A = (B; F) and E = eps on the rows of force, the minimum over the free thrusters, the others fixed at
// zero, is f = A^T y with (A A^T + E) y = (torque; 0): six equations, however many thrusters. They are solved
// by way of R^T R = A A^T + E from the rows of A^T and the root of E, whose condition is the root of theirs.
class LeastForce::Free {
 public:
  Free(const LeastForce& set, Set free) : set_(set), free_(free), count_(std::popcount(free)) {
    if (count_ < 3) return;
    TorqueRows rows(count_, 3);
    Eigen::Index row = 0;
    for (Eigen::Index i = 0; i < set.columns_.cols(); ++i)
      if (has(i)) rows.row(row++) = torque(i).transpose();
    of_torque_.compute(rows);
  }

  bool has(Eigen::Index i) const { return free_ >> i & 1; }
  bool makes_every_torque() const {
    if (count_ < 3) return false;
    const auto& r = of_torque_.matrixQR();
    return std::abs(r(2, 2)) > kRank * std::abs(r(0, 0));
  }

  /// y and f. Where there has to be a net force y is of the size of 1/eps, hence the refinement. Expects that
  /// every torque can be made.
  void minimum(const Vector6& right, Vector6& y, Thrusts& f) const {
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::ColMajor, int{kMaxThrusters} + 3, 6>;
    Rows rows = Rows::Zero(count_ + 3, 6);
    rows.topRightCorner<3, 3>().diagonal().setConstant(std::sqrt(kOfThrust));
    Eigen::Index row = 3;
    for (Eigen::Index i = 0; i < set_.columns_.cols(); ++i)
      if (has(i)) rows.row(row++) = set_.columns_.col(i).transpose();
    const Eigen::HouseholderQR<Rows> factor(rows);
    const auto r = factor.matrixQR().topRows<6>().triangularView<Eigen::Upper>();

    y.setZero();
    f.setZero(set_.columns_.cols());
    Vector6 missing = right;
    for (int refinement = 0; refinement < 3; ++refinement) {
      Vector6 more = r.transpose().solve(missing);
      r.solveInPlace(more);
      y += more;
      missing = right;
      missing.tail<3>() -= kOfThrust * y.tail<3>();
      for (Eigen::Index i = 0; i < f.size(); ++i) {
        if (!has(i)) continue;
        f[i] += set_.columns_.col(i).dot(more);
        missing -= f[i] * set_.columns_.col(i);
      }
    }
  }

  /// Adds to the thrusts what the torque still lacks.
  void make_exact(const Vector6& right, Thrusts& f) const {
    Eigen::Vector3d missing = right.head<3>();
    for (Eigen::Index i = 0; i < f.size(); ++i) missing -= f[i] * torque(i);
    const Eigen::Vector3d more = over_squares(missing);
    for (Eigen::Index i = 0; i < f.size(); ++i)
      if (has(i)) f[i] += torque(i).dot(more);
  }

  /// What y changes by for each unit of the multiplier of a free thruster without which the others would not
  /// make every torque: across the torques of those others, so that no thrust changes.
  Vector6 across(Eigen::Index i) const {
    Vector6 change = Vector6::Zero();
    change.head<3>() = -over_squares(torque(i));
    return change;
  }

 private:
  using TorqueRows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, int{kMaxThrusters}, 3>;

  Eigen::Vector3d torque(Eigen::Index i) const { return set_.columns_.col(i).head<3>(); }
  /// (B B^T)^-1 v
  Eigen::Vector3d over_squares(const Eigen::Vector3d& v) const {
    const auto r = of_torque_.matrixQR().topRows<3>().triangularView<Eigen::Upper>();
    Eigen::Vector3d w = of_torque_.colsPermutation().transpose() * v;
    w = r.transpose().solve(w).eval();
    w = r.solve(w).eval();
    return of_torque_.colsPermutation() * w;
  }

  const LeastForce& set_;
  Set free_;
  int count_;
  Eigen::ColPivHouseholderQR<TorqueRows> of_torque_;
};

void LeastForce::allocate(const Eigen::Vector3d& torque_N_m, std::span<double> thrust_N) const {
  const Eigen::Index count = columns_.cols();
  Vector6 right = Vector6::Zero();
  right.head<3>() = torque_N_m / arm_m_;

  Set free = static_cast<Set>((std::uint64_t{1} << count) - 1);
  Vector6 y, y_without;
  Thrusts f, f_without;
  const Free all(*this, free);
  std::fill(thrust_N.begin(), thrust_N.end(), 0.0);
  if (!all.makes_every_torque()) return;
  all.minimum(right, y, f);
  bool is_possible = true;
  for (Eigen::Index change = 0; change < 8 * count; ++change) {
    // What would pull most is to be zero: its multiplier grows until it is. On the way the multipliers of
    // others, already at zero, may vanish; then those are free again.
    Eigen::Index worst = 0;
    if (!(f.minCoeff(&worst) < -kRounding * f.cwiseAbs().maxCoeff())) break;
    double multiplier = 0;
    for (;;) {
      const Free without(*this, free & ~(Set{1} << worst));
      const bool can_be_zero = without.makes_every_torque();
      Vector6 direction;
      if (can_be_zero) {
        without.minimum(right, y_without, f_without);
        direction = y_without - y;
      } else {
        direction = Free(*this, free).across(worst);
      }
      double part = can_be_zero ? 1 : kInfinity;  // of the direction
      Eigen::Index released = -1;
      for (Eigen::Index i = 0; i < count; ++i) {
        if (i == worst || without.has(i)) continue;
        const double now = std::max(-columns_.col(i).dot(y), 0.0), fall = columns_.col(i).dot(direction);
        if (fall > kRounding * direction.cwiseAbs().maxCoeff() && now < part * fall)
          part = now / fall, released = i;
      }
      is_possible = can_be_zero || released >= 0;
      if (released < 0) break;
      multiplier += part * (can_be_zero ? -columns_.col(worst).dot(y_without) - multiplier : 1);
      free |= Set{1} << released;
      Free(*this, free).minimum(right - multiplier * columns_.col(worst), y, f);
    }
    if (!is_possible) break;
    free &= ~(Set{1} << worst);
    y = y_without;
    f = f_without;
  }
  f = f.cwiseMax(0.0).eval();
  Free(*this, free).make_exact(right, f);
  for (Eigen::Index i = 0; i < count; ++i) thrust_N[i] = std::max(f[i], 0.0);
}

}  // namespace slew
