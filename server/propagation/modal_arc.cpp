#include "server/propagation/modal_arc.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slew {
namespace {

using Complex = std::complex<double>;

// Products of finite numbers, without the library's care for infinities.
Complex times(Complex a, Complex b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

Complex exponential(Complex lambda, double tau) {
  const double size = std::exp(lambda.real() * tau);
  return {size * std::cos(lambda.imag() * tau), size * std::sin(lambda.imag() * tau)};
}

}  // namespace

ModalArc::ModalArc(const ModalBasis& basis, double angle_rad, double rate_rad_s,
                   std::span<const Sinusoid> sinusoids)
    : basis_(&basis),
      c_(basis.size()),
      amplitude_(basis.size()),
      panel_factor_(basis.size()),
      derivative_(basis.size()),
      next_derivative_(basis.size()),
      factor_(basis.size()) {
  for (const Complex lambda : basis.lambda()) fastest_growth_ = std::max(fastest_growth_, lambda.real());
  std::vector<Complex> z;
  for (const Sinusoid& sinusoid : sinusoids)
    z.push_back(std::polar(sinusoid.amplitude_N_m, sinusoid.phase_rad));
  const std::vector<double> still(basis.modes().size());
  begin_anew(angle_rad, rate_rad_s, still, still, z);
}

void ModalArc::begin_anew(double angle_rad, double rate_rad_s, std::span<const double> q,
                          std::span<const double> v, std::span<const Complex> z) {
  angle_rad_ = angle_rad;
  momentum_N_m_s_ = basis_->inertia_kg_m2() * rate_rad_s;
  for (std::size_t i = 0; i < v.size(); ++i) momentum_N_m_s_ += basis_->modes()[i].coupling_sqrt_kg_m * v[i];
  const std::size_t modal = c_.size() - z.size();
  for (std::size_t j = 0; j < z.size(); ++j) {
    c_[modal + j] = z[j];
    momentum_N_m_s_ += z[j].real() / basis_->lambda()[modal + j].imag();
  }
  basis_->to_modal(q, v, c_);
  renew();
}

double ModalArc::momentum_at(double tau) const {
  double momentum = momentum_N_m_s_ + torque_N_m_ * tau;
  for (std::size_t k = c_.size() - basis_->sinusoids(); k < c_.size(); ++k) {
    const Complex lambda = basis_->lambda()[k];
    momentum -= times(c_[k], exponential(lambda, tau)).real() / lambda.imag();
  }
  return momentum;
}

void ModalArc::set_torque(double torque_N_m) {
  if (torque_N_m == torque_N_m_) return;
  torque_N_m_ = torque_N_m;
  renew();
}

// What follows from state and torque.
void ModalArc::renew() {
  const auto lambda = basis_->lambda(), weight = basis_->p_weights(), rest = basis_->rest();
  double p = 0, p_slope = 0, p_curvature = 0, p_rest = 0;
  rate_sum_ = acceleration_sum_ = jerk_sum_ = 0;
  for (std::size_t k = 0; k < c_.size(); ++k) {
    const Complex still = rest[k] * torque_N_m_;
    const Complex amplitude = times(weight[k], c_[k] - still);
    amplitude_[k] = amplitude;
    p_rest += times(weight[k], still).real();
    const Complex first = times(lambda[k], amplitude), second = times(lambda[k], first);
    p += amplitude.real();
    p_slope += first.real();
    p_curvature += second.real();
    // |x| + |y| bounds the magnitude without a root.
    rate_sum_ += std::abs(first.real()) + std::abs(first.imag());
    acceleration_sum_ += std::abs(second.real()) + std::abs(second.imag());
    const Complex third = times(lambda[k], second);
    jerk_sum_ += std::abs(third.real()) + std::abs(third.imag());
  }
  p_rest_ = p_rest;
  p_begin_ = p_rest + p;
  const double inertia = basis_->inertia_kg_m2();
  rate_sum_ = (rate_sum_ + std::abs(momentum_N_m_s_)) / inertia;
  acceleration_sum_ = (acceleration_sum_ + std::abs(torque_N_m_)) / inertia;
  jerk_sum_ /= inertia;
  begin_ = {angle_rad_, (momentum_N_m_s_ - p_slope) / inertia, (torque_N_m_ - p_curvature) / inertia};
  ++arc_;
}

const ModalArc::Panel& ModalArc::panel(std::int64_t index) const {
  Panel& panel = panels_[static_cast<std::size_t>(index) % kPanels];
  if (panel.index == index && panel.arc == arc_) return panel;
  panel.arc = arc_;
  panel.index = index;
  const auto lambda = basis_->lambda();
  const double* const damping = basis_->damping_per_s().data();
  const double* const stiffness = basis_->stiffness_per_s2().data();
  const std::size_t size = amplitude_.size();
  basis_->panel_factors(index, panel_factor_);
  double value = p_rest_, slope = 0;
  for (std::size_t k = 0; k < size; ++k) {
    const Complex moved = times(amplitude_[k], panel_factor_[k]);
    derivative_[k] = moved.real();
    next_derivative_[k] = times(lambda[k], moved).real();
    value += derivative_[k];
    slope += next_derivative_[k];
  }
  double* const __restrict earlier = derivative_.data();
  double* const __restrict later = next_derivative_.data();
  panel.coefficient[0] = value;
  panel.coefficient[1] = slope;
  double factorial = 1;
  for (std::size_t j = 2; j < kTerms; ++j) {
    factorial *= static_cast<double>(j);
    for (std::size_t k = basis_->first_in_term(j); k < size; ++k) {
      const double next = damping[k] * later[k] - stiffness[k] * earlier[k];
      earlier[k] = later[k];
      later[k] = next;
    }
    double sum = 0;
    for (std::size_t k = basis_->first_in_term(j); k < size; ++k) sum += later[k];
    panel.coefficient[j] = sum / factorial;
  }
  const double reach = 0.5 * basis_->panel_s();
  double bound = 0;
  for (std::size_t j = kTerms; j-- > 3;)
    bound = bound * reach + std::abs(panel.coefficient[j]) * static_cast<double>(j * (j - 1) * (j - 2));
  panel.third_derivative = bound;
  return panel;
}

AxisMotion ModalArc::at(double tau) const {
  if (tau == 0) return begin_;
  double p = p_rest_, p_slope = 0, p_curvature = 0;
  if (is_ready(tau)) {
    const auto lambda = basis_->lambda();
    for (std::size_t k = 0; k < amplitude_.size(); ++k) {
      const Complex moved = times(amplitude_[k], factor_[k]), first = times(lambda[k], moved);
      p += moved.real();
      p_slope += first.real();
      p_curvature += times(lambda[k], first).real();
    }
  } else {
    const std::int64_t index = panel_at(tau);
    const auto& coefficient = panel(index).coefficient;
    const double d = tau - (static_cast<double>(index) + 0.5) * basis_->panel_s();
    p = coefficient[kTerms - 1];
    for (std::size_t j = kTerms - 1; j-- > 0;) {
      p_curvature = p_curvature * d + p_slope;
      p_slope = p_slope * d + p;
      p = p * d + coefficient[j];
    }
    p_curvature *= 2;
  }
  const double inertia = basis_->inertia_kg_m2();
  return {angle_rad_ + (tau * (momentum_N_m_s_ + 0.5 * torque_N_m_ * tau) - (p - p_begin_)) / inertia,
          (momentum_N_m_s_ + torque_N_m_ * tau - p_slope) / inertia, (torque_N_m_ - p_curvature) / inertia};
}

void ModalArc::make_ready(double tau) {
  if (is_ready(tau)) return;
  stepped_ = tau;
  for (std::size_t k = 0; k < c_.size(); ++k) factor_[k] = exponential(basis_->lambda()[k], tau);
}

void ModalArc::move(double tau) {
  if (tau == 0) return;
  make_ready(tau);
  angle_rad_ = at(tau).angle_rad;
  momentum_N_m_s_ += torque_N_m_ * tau;
  for (std::size_t k = 0; k < c_.size(); ++k) {
    const Complex still = basis_->rest()[k] * torque_N_m_;
    c_[k] = still + times(c_[k] - still, factor_[k]);
  }
  renew();
}

void ModalArc::deflection_at(double tau, std::span<Complex> scratch, std::span<double> q,
                             std::span<double> v) const {
  for (std::size_t k = 0; k < c_.size(); ++k) {
    const Complex still = basis_->rest()[k] * torque_N_m_;
    scratch[k] = tau == 0 ? c_[k] : still + times(c_[k] - still, exponential(basis_->lambda()[k], tau));
  }
  basis_->to_physical(scratch, q, v);
}

// Of the amplitudes, at most, since the beginning of the arc.
double ModalArc::growth(double, double b) const {
  return fastest_growth_ > 0 ? std::exp(fastest_growth_ * b) : 1;
}

double ModalArc::acceleration_bound(double a, double b) const {
  return acceleration_sum_ * growth(a, b);
}

// Within one panel by its series, which knows the signs of what adds up; else by the sum of all amplitudes.
double ModalArc::jerk_bound(double a, double b) const {
  const std::int64_t index = panel_at(a);
  if (b <= static_cast<double>(index + 1) * basis_->panel_s())
    return panel(index).third_derivative / basis_->inertia_kg_m2();
  return loose_jerk_bound(a, b);
}

}  // namespace slew
