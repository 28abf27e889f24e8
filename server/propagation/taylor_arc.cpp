#include "server/propagation/taylor_arc.hpp"

#include <algorithm>
#include <cmath>

#include "server/control/balancing.hpp"

namespace slew {

using Eigen::Index;

double TaylorPolynomial::value(double tau) const {
  double value = 0;
  for (std::size_t k = c.size(); k-- > 0;) value = value * tau + c[k];
  return value;
}

double TaylorPolynomial::slope(double tau) const {
  double value = 0;
  for (std::size_t k = c.size(); k-- > 1;) value = value * tau + static_cast<double>(k) * c[k];
  return value;
}

double TaylorPolynomial::slope_bound(double tau) const {
  double value = 0;
  for (std::size_t k = c.size(); k-- > 1;) value = value * tau + static_cast<double>(k) * std::abs(c[k]);
  return value;
}

double TaylorPolynomial::curvature_bound(double tau) const {
  double value = 0;
  for (std::size_t k = c.size(); k-- > 2;)
    value = value * tau + static_cast<double>(k * (k - 1)) * std::abs(c[k]);
  return value;
}

double TaylorPolynomial::integral(double a, double b) const {
  const auto up_to = [this](double tau) {
    double value = 0;
    for (std::size_t k = c.size(); k-- > 0;) value = value * tau + c[k] / static_cast<double>(k + 1);
    return value * tau;
  };
  return up_to(b) - up_to(a);
}

double TaylorPolynomial::integral_of_square(double a, double b) const {
  std::array<double, 2 * kTaylorOrder + 1> square{};
  for (std::size_t i = 0; i < c.size(); ++i)
    for (std::size_t k = 0; k < c.size(); ++k) square[i + k] += c[i] * c[k];
  const auto up_to = [&square](double tau) {
    double value = 0;
    for (std::size_t k = square.size(); k-- > 0;)
      value = value * tau + square[k] / static_cast<double>(k + 1);
    return value * tau;
  };
  return up_to(b) - up_to(a);
}

LinearSystem::LinearSystem(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& input) {
  Balanced balanced = balance(matrix);
  matrix_ = std::move(balanced.matrix);
  scale_ = std::move(balanced.scale);
  input_ = input.cwiseQuotient(scale_);
  // A system without any dynamics may take steps as long as it likes, but for what a table of powers holds.
  constexpr double kLeastNorm = 1e-6;
  const double norm = std::max(kLeastNorm, matrix_.cwiseAbs().rowwise().sum().maxCoeff());
  step_s_ = std::exp2(std::floor(-std::log2(norm)));
}

TaylorArc::TaylorArc(std::shared_ptr<const LinearSystem> system, const Eigen::VectorXd& state)
    : system_(std::move(system)), series_(state.size(), kTaylorOrder + 1) {
  series_.setZero();
  series_.col(0) = state.cwiseQuotient(system_->scale_);
}

// Column by column, in an order that does not depend on where the numbers lie in memory.
void TaylorArc::expand(double input) {
  const Index n = series_.rows();
  for (Index k = 0; k < static_cast<Index>(kTaylorOrder); ++k) {
    const double* from = series_.col(k).data();
    double* to = series_.col(k + 1).data();
    for (Index i = 0; i < n; ++i) to[i] = k == 0 ? system_->input_[i] * input : 0;
    for (Index j = 0; j < n; ++j) {
      const double* column = system_->matrix_.col(j).data();
      for (Index i = 0; i < n; ++i) to[i] += column[i] * from[j];
    }
    for (Index i = 0; i < n; ++i) to[i] /= static_cast<double>(k + 1);
  }
}

double TaylorArc::value(Index i, double tau) const {
  double value = 0;
  for (Index k = series_.cols(); k-- > 0;) value = value * tau + series_(i, k);
  return value;
}

void TaylorArc::jump(const Eigen::VectorXd& by, double factor) {
  for (Index i = 0; i < series_.rows(); ++i) series_(i, 0) += factor * by[i] / system_->scale_[i];
}

void TaylorArc::move(double tau) {
  for (Index i = 0; i < series_.rows(); ++i) series_(i, 0) = value(i, tau);
}

void TaylorArc::state_at(double tau, std::span<double> state) const {
  for (Index i = 0; i < series_.rows(); ++i)
    state[static_cast<std::size_t>(i)] = system_->scale_[i] * value(i, tau);
}

TaylorPolynomial TaylorArc::component(std::size_t i) const {
  const auto row = static_cast<Index>(i);
  TaylorPolynomial polynomial;
  for (std::size_t k = 0; k < polynomial.c.size(); ++k)
    polynomial.c[k] = system_->scale_[row] * series_(row, static_cast<Index>(k));
  return polynomial;
}

TaylorPolynomial TaylorArc::combination(const Eigen::RowVectorXd& weights) const {
  TaylorPolynomial polynomial;
  for (Index i = 0; i < series_.rows(); ++i) {
    const double weight = weights[i] * system_->scale_[i];
    if (weight == 0) continue;
    for (std::size_t k = 0; k < polynomial.c.size(); ++k)
      polynomial.c[k] += weight * series_(i, static_cast<Index>(k));
  }
  return polynomial;
}

}  // namespace slew
