// Motion under a constant torque: theta(tau) = theta_0 + omega_0 tau + alpha tau^2/2, exact, and the times at
// which something happens on it.
#pragma once

#include <array>
#include <cmath>
#include <optional>

namespace slew {

template <typename Scalar>
struct QuadraticArc {
  Scalar angle_rad{};   ///< at tau = 0
  Scalar rate_rad_s{};  ///< at tau = 0
  Scalar acceleration_rad_s2{};

  Scalar angle_at(const Scalar& tau) const {
    return angle_rad + tau * (rate_rad_s + 0.5 * acceleration_rad_s2 * tau);
  }
  Scalar rate_at(const Scalar& tau) const { return rate_rad_s + acceleration_rad_s2 * tau; }
};

/// The real roots of c0 + c1 tau + c2 tau^2, ascending, without cancellation. A double root counts once.
struct QuadraticRoots {
  int count = 0;
  std::array<double, 2> tau{};
};

inline QuadraticRoots quadratic_roots(double c0, double c1, double c2) {
  QuadraticRoots roots;
  if (c2 == 0) {
    if (c1 != 0) roots = {1, {-c0 / c1, 0}};
    return roots;
  }
  const double discriminant = c1 * c1 - 4 * c0 * c2;
  if (discriminant < 0) return roots;
  // The sum of equal signs, then the other root from the product c0/c2.
  const double q = -0.5 * (c1 + std::copysign(std::sqrt(discriminant), c1));
  if (q == 0) return {1, {0, 0}};
  const double first = q / c2;
  const double second = c0 / q;
  if (first == second) return {1, {first, 0}};
  return {2, {std::fmin(first, second), std::fmax(first, second)}};
}

/// A few times in ascending order, without a heap and without a library sort.
template <std::size_t N>
class AscendingTimes {
 public:
  void add(double tau) {
    std::size_t place = count_++;
    for (; place > 0 && times_[place - 1] > tau; --place) times_[place] = times_[place - 1];
    times_[place] = tau;
  }
  std::size_t count() const { return count_; }
  double operator[](std::size_t i) const { return times_[i]; }

 private:
  std::array<double, N> times_{};
  std::size_t count_ = 0;
};

/// When the rate passes through zero, if that is in (0, h].
inline std::optional<double> rest_time(const QuadraticArc<double>& arc, double h) {
  if (arc.acceleration_rad_s2 == 0) return std::nullopt;
  const double tau = -arc.rate_rad_s / arc.acceleration_rad_s2;
  if (tau > 0 && tau <= h) return tau;
  return std::nullopt;
}

/// The first time in (0, h] at which theta reaches the angle.
inline std::optional<double> reach_time(const QuadraticArc<double>& arc, double angle_rad, double h) {
  const auto roots =
      quadratic_roots(arc.angle_rad - angle_rad, arc.rate_rad_s, 0.5 * arc.acceleration_rad_s2);
  for (int i = 0; i < roots.count; ++i)
    if (roots.tau[static_cast<std::size_t>(i)] > 0 && roots.tau[static_cast<std::size_t>(i)] <= h)
      return roots.tau[static_cast<std::size_t>(i)];
  return std::nullopt;
}

}  // namespace slew
