#include "server/actuator/least_force.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>

namespace slew {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-14;
constexpr double kRankOfSquares = 1e-12;  // least against greatest; of lever arms a millionth

}  // namespace

LeastForce::LeastForce(const ThrusterMatrix& torque_m, const ThrusterMatrix& force)
    : columns_(6, torque_m.cols()) {
  if (torque_m.cols() > 0 && !torque_m.isZero(0)) arm_m_ = torque_m.colwise().norm().maxCoeff();
  columns_ << torque_m / arm_m_, force;
}

// With A = (B; F) and E = eps on the rows of force, the minimum over the free thrusters, the others fixed at
// zero, is f = A^T y with (A A^T + E) y = (torque; 0): six equations, however many thrusters.
class LeastForce::Free {
 public:
  Free(const LeastForce& set, Set free) : set_(set), free_(free) {
    Matrix6 matrix = Matrix6::Zero();
    matrix.diagonal().tail<3>().setConstant(kOfThrust);
    for (Eigen::Index i = 0; i < set.columns_.cols(); ++i)
      if (has(i)) matrix.noalias() += set.columns_.col(i) * set.columns_.col(i).transpose();
    factor_.compute(matrix);
    of_torque_.compute(matrix.topLeftCorner<3, 3>());
  }

  bool has(Eigen::Index i) const { return free_ >> i & 1; }
  bool makes_every_torque() const {
    const auto pivots = of_torque_.vectorD();
    return pivots.minCoeff() > kRankOfSquares * pivots.maxCoeff();
  }

  /// y and f. Where there has to be a net force y is of the size of 1/eps, hence the refinement.
  void minimum(const Vector6& right, Vector6& y, Thrusts& f) const {
    y.setZero();
    f.setZero(set_.columns_.cols());
    Vector6 missing = right;
    for (int refinement = 0; refinement < 3; ++refinement) {
      const Vector6 more = factor_.solve(missing);
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

  /// What y changes by for each unit of the multiplier of a free thruster without which the others would not
  /// make every torque: across the torques of those others, so that no thrust changes.
  Vector6 across(Eigen::Index i) const {
    Vector6 change = Vector6::Zero();
    change.head<3>() = -of_torque_.solve(set_.columns_.col(i).head<3>());
    return change;
  }

 private:
  const LeastForce& set_;
  Set free_;
  Eigen::LLT<Matrix6> factor_;
  Eigen::LDLT<Eigen::Matrix3d> of_torque_;
};

void LeastForce::allocate(const Eigen::Vector3d& torque_N_m, std::span<double> thrust_N) const {
  const Eigen::Index count = columns_.cols();
  Vector6 right = Vector6::Zero();
  right.head<3>() = torque_N_m / arm_m_;

  Set free = static_cast<Set>((std::uint64_t{1} << count) - 1);
  Vector6 y, y_without;
  Thrusts f, f_without;
  Free(*this, free).minimum(right, y, f);
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
  for (Eigen::Index i = 0; i < count; ++i) thrust_N[i] = std::max(f[i], 0.0);
}

}  // namespace slew
