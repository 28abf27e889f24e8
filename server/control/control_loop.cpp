#include "server/control/control_loop.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "server/control/balancing.hpp"

namespace slew {
namespace {

using Complex = std::complex<double>;

void sort(std::vector<Complex>& values) {
  std::sort(values.begin(), values.end(), [](Complex a, Complex b) {
    return std::tuple(std::abs(a), a.real(), -a.imag()) < std::tuple(std::abs(b), b.real(), -b.imag());
  });
}

void add(std::vector<Complex>& values, const std::vector<Complex>& more) {
  values.insert(values.end(), more.begin(), more.end());
}

// s^2 + 2 zeta w s + w^2.
Polynomial clamped(const ElasticMode& mode) {
  return {1, 2 * mode.damping * mode.frequency_rad_s, mode.frequency_rad_s * mode.frequency_rad_s};
}

// What the loop falls apart into when the estimator believes what is true.
std::vector<Polynomial> separated(const SingleAxisPlant& plant, const LinearFeedback& feedback,
                                  const AngleEstimator& estimator) {
  const auto* law = std::get_if<AttitudeRateFeedback>(&feedback.law);
  if (!law || !plant.modes.empty()) return {};
  const auto believes = [&](const auto* one) { return one && one->inertia_kg_m2 != plant.inertia_kg_m2; };
  if (believes(std::get_if<SecondOrderAngleEstimator>(&estimator)) ||
      believes(std::get_if<FirstOrderAngleEstimator>(&estimator)))
    return {};
  return {regulator_polynomial(*law, plant.inertia_kg_m2), error_polynomial(estimator)};
}

}  // namespace

double damping_ratio(Complex pole) {
  return pole == 0.0 ? 1 : -pole.real() / std::abs(pole);
}

std::vector<Complex> eigenvalues(const Eigen::MatrixXd& matrix) {
  if (matrix.rows() == 0) return {};
  const Eigen::VectorXcd found = balance(matrix).matrix.eigenvalues();
  std::vector<Complex> values(found.begin(), found.end());
  sort(values);
  return values;
}

ControlLoop::ControlLoop(SingleAxisPlant plant, const LinearFeedback& feedback,
                         const AngleEstimator& estimator)
    : plant_(std::move(plant)),
      compensator_(make_compensator(feedback, estimator)),
      is_direct_(compensator_.size() == 0),
      factors_(separated(plant_, feedback, estimator)) {
  const auto moving = static_cast<Eigen::Index>(2 + 2 * plant_.modes.size());
  const Eigen::Index n = moving + compensator_.size();
  open_.setZero(n, n);
  input_.setZero(n);
  torque_.setZero(n);

  // The plant's columns from its own right-hand side.
  std::vector<double> state(static_cast<std::size_t>(moving));
  const auto slope = [&](double torque_N_m, double* into) {
    derivative<double>(plant_, state, torque_N_m, std::span(into, state.size()));
  };
  for (Eigen::Index j = 0; j < moving; ++j) {
    state[static_cast<std::size_t>(j)] = 1;
    slope(0, open_.col(j).data());
    state[static_cast<std::size_t>(j)] = 0;
  }
  slope(1, input_.data());

  open_.bottomRightCorner(compensator_.size(), compensator_.size()) = compensator_.dynamics;
  open_.col(0).tail(compensator_.size()) = compensator_.input;
  torque_[0] = compensator_.torque_of_angle;
  torque_[1] = compensator_.torque_of_rate;
  torque_.tail(compensator_.size()) = compensator_.torque;
}

Eigen::MatrixXd ControlLoop::matrix(double loop_gain) const {
  return open_ + loop_gain * input_ * torque_;
}

std::vector<Complex> ControlLoop::poles(double loop_gain) const {
  std::vector<Complex> found;
  if (is_direct_ && plant_.modes.empty())
    found = roots(characteristic_polynomial(loop_gain));
  else if (loop_gain == 1 && !factors_.empty())
    for (const Polynomial& factor : factors_) add(found, roots(factor));
  else
    return eigenvalues(matrix(loop_gain));
  sort(found);
  return found;
}

Polynomial ControlLoop::characteristic_polynomial(double loop_gain) const {
  if (!plant_.modes.empty()) return {};
  Polynomial numerator = compensator_.of_angle.numerator;
  for (double& coefficient : numerator) coefficient *= -loop_gain / plant_.inertia_kg_m2;
  return sum(product(compensator_.of_angle.denominator, Polynomial{1, 0, 0}), numerator);
}

// theta/Q = 1/(s^2 (I - sum D_i^2 s^2/p_i)), with p_i of the clamped modes.
Complex ControlLoop::loop_response(Complex s) const {
  const Complex control = -value_at<Complex>(compensator_.of_angle.numerator, s) /
                          value_at<Complex>(compensator_.of_angle.denominator, s);
  Complex inertia = plant_.inertia_kg_m2;
  for (const ElasticMode& mode : plant_.modes) {
    if (mode.coupling_sqrt_kg_m == 0) continue;
    const Complex p = value_at<Complex>(clamped(mode), s);
    // A clamped mode without damping holds the hub at its frequency.
    if (p == 0.0) return 0;
    inertia -= mode.coupling_sqrt_kg_m * mode.coupling_sqrt_kg_m * s * s / p;
  }
  const Complex below = s * s * inertia;
  if (below == 0.0) return std::numeric_limits<double>::infinity();
  return control / below;
}

std::vector<Complex> ControlLoop::loop_zeros() const {
  std::vector<Complex> found = roots(compensator_.of_angle.numerator);
  for (const ElasticMode& mode : plant_.modes) add(found, roots(clamped(mode)));
  sort(found);
  return found;
}

std::vector<Complex> ControlLoop::loop_poles() const {
  std::vector<Complex> found = roots(compensator_.of_angle.denominator);
  // The rigid body's two are at the origin, not where an eigenvalue problem puts them.
  add(found, {0, 0});
  const auto n = static_cast<Eigen::Index>(2 * plant_.modes.size());
  add(found, eigenvalues(open_.block(2, 2, n, n)));
  sort(found);
  return found;
}

}  // namespace slew
