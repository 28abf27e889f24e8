// Motion of a linear system under a constant input, x' = A x + b u, by its own power series: with c_0 = x,
// c_1 = A x + b u and c_{k+1} = A c_k/(k+1) a step's dense output is the sum of c_k tau^k, and so is every
// derivative of it. A may be defective (Bryson 1994, Problem 3.2.2(c): double poles), which an expansion in
// eigenvectors would not survive. Steps are so short that what is left out is below rounding.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>

#include "server/propagation/motion_scan.hpp"

namespace slew {

/// h |A| is at most 1, so the terms left out are below 1/21! = 2e-20 of the state.
inline constexpr std::size_t kTaylorOrder = 20;

/// A scalar on [0, h] of an arc: the sum of c_k tau^k.
struct TaylorPolynomial {
  std::array<double, kTaylorOrder + 1> c{};

  double value(double tau) const;
  double slope(double tau) const;
  /// At least the largest |slope| and |second derivative| on [0, tau].
  double slope_bound(double tau) const;
  double curvature_bound(double tau) const;
  /// Of the polynomial, and of its square, over [a, b].
  double integral(double a, double b) const;
  double integral_of_square(double a, double b) const;

  // As crossing_scan.hpp asks.
  ScanPoint at(double tau) const { return {value(tau), slope(tau)}; }
  ScanLook look(double a, double b) const {
    const double middle = 0.5 * (a + b);
    return {value(middle), slope(middle), curvature_bound(b)};
  }
  double slope_bound(double, double b) const { return slope_bound(b); }
};

/// An axis on an arc, asked like a ModalArc.
struct TaylorMotion {
  TaylorPolynomial angle, rate;

  AxisMotion at(double tau) const { return {angle.value(tau), rate.value(tau), rate.slope(tau)}; }
  double angle_at(double tau) const { return angle.value(tau); }
  double rate_at(double tau) const { return rate.value(tau); }
  double acceleration_bound(double, double b) const { return rate.slope_bound(b); }
  double jerk_bound(double, double b) const { return rate.curvature_bound(b); }
  double loose_jerk_bound(double a, double b) const { return jerk_bound(a, b); }
};

/// x' = A x + b u, in units in which A is balanced. Immutable once made.
class LinearSystem {
 public:
  LinearSystem(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& input);

  std::size_t size() const { return static_cast<std::size_t>(scale_.size()); }
  /// The largest power of two with h |A| <= 1, s: sums of steps are exact.
  double step_s() const { return step_s_; }

 private:
  friend class TaylorArc;
  Eigen::MatrixXd matrix_;
  Eigen::VectorXd input_;
  Eigen::VectorXd scale_;  ///< x = scale y
  double step_s_;
};

/// Holds the state at its beginning (tau = 0). Allocates when made, never afterwards.
class TaylorArc {
 public:
  TaylorArc(std::shared_ptr<const LinearSystem> system, const Eigen::VectorXd& state);

  double step_s() const { return system_->step_s(); }
  /// From the state at the beginning: the series under this input.
  void expand(double input);
  /// The state at the beginning jumps; expand() then makes the series from there.
  void jump(const Eigen::VectorXd& by, double factor);
  /// Moves the beginning to tau; expand() then makes the series from there.
  void move(double tau);
  void state_at(double tau, std::span<double> state) const;
  /// Of one component, and of weights times the state.
  TaylorPolynomial component(std::size_t i) const;
  TaylorPolynomial combination(const Eigen::RowVectorXd& weights) const;

 private:
  double value(Eigen::Index i, double tau) const;

  std::shared_ptr<const LinearSystem> system_;
  Eigen::MatrixXd series_;  ///< column k is c_k in balanced units
};

}  // namespace slew
