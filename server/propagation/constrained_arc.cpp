#include "server/propagation/constrained_arc.hpp"

#include <algorithm>
#include <cmath>

namespace slew {
namespace {

using Complex = std::complex<double>;

}  // namespace

ConstrainedArc::ConstrainedArc(const SingleAxisPlant& plant, std::span<const Sinusoid> sinusoids)
    : plant_(plant), z_(sinusoids.size()), q_(plant.modes.size()), v_(plant.modes.size()) {
  for (const ElasticMode& mode : plant.modes) {
    const double w = mode.frequency_rad_s, zeta = mode.damping;
    modes_.push_back(
        {mode.coupling_sqrt_kg_m, Complex(-zeta * w, w * std::sqrt((1 - zeta) * (1 + zeta))), 0, 0, {}});
  }
  for (const Sinusoid& sinusoid : sinusoids) frequency_.push_back(sinusoid.frequency_rad_s);
}

void ConstrainedArc::begin(const HubPath& path, std::span<const double> q, std::span<const double> v,
                           std::span<const Complex> z) {
  path_ = path;
  std::copy(z.begin(), z.end(), z_.begin());
  solve(q, v);
}

void ConstrainedArc::turn_into(const HubPath& path) {
  deflection_at(0, q_, v_);
  path_ = path;
  solve(q_, v_);
}

void ConstrainedArc::solve(std::span<const double> q, std::span<const double> v) {
  for (std::size_t i = 0; i < modes_.size(); ++i) {
    Mode& mode = modes_[i];
    const double w = plant_.modes[i].frequency_rad_s, damping = 2 * plant_.modes[i].damping * w;
    mode.still = mode.follow = 0;
    if (path_.is_parabola()) {
      mode.still = -mode.coupling * path_.acceleration_rad_s2 / (w * w);
    } else {
      const double rate = 1 / path_.decay_s;
      mode.follow = mode.coupling * path_.rate_rad_s * rate / (rate * rate - damping * rate + w * w);
    }
    const double x = q[i] - mode.still - mode.follow;
    const double slope = v[i] + (path_.is_parabola() ? 0 : mode.follow / path_.decay_s);
    mode.swing = {x, (mode.lambda.real() * x - slope) / mode.lambda.imag()};
  }
}

double ConstrainedArc::required_torque_at(double tau) const {
  double torque = plant_.inertia_kg_m2 * path_.acceleration_at(tau);
  for (const Mode& mode : modes_) {
    double second = (mode.lambda * mode.lambda * mode.swing * std::exp(mode.lambda * tau)).real();
    if (!path_.is_parabola())
      second += mode.follow / (path_.decay_s * path_.decay_s) * std::exp(-tau / path_.decay_s);
    torque += mode.coupling * second;
  }
  for (std::size_t j = 0; j < z_.size(); ++j)
    torque -= (z_[j] * std::exp(Complex(0, frequency_[j] * tau))).imag();
  return torque;
}

double ConstrainedArc::momentum_at(double tau) const {
  double momentum = plant_.inertia_kg_m2 * path_.rate_at(tau);
  for (const Mode& mode : modes_) {
    double slope = (mode.lambda * mode.swing * std::exp(mode.lambda * tau)).real();
    if (!path_.is_parabola()) slope -= mode.follow / path_.decay_s * std::exp(-tau / path_.decay_s);
    momentum += mode.coupling * slope;
  }
  return momentum;
}

double ConstrainedArc::required_impulse(double tau) const {
  double impulse = momentum_at(tau) - momentum_at(0);
  for (std::size_t j = 0; j < z_.size(); ++j)
    impulse += ((z_[j] * std::exp(Complex(0, frequency_[j] * tau))).real() - z_[j].real()) / frequency_[j];
  return impulse;
}

void ConstrainedArc::deflection_at(double tau, std::span<double> q, std::span<double> v) const {
  for (std::size_t i = 0; i < modes_.size(); ++i) {
    const Mode& mode = modes_[i];
    const Complex swing = mode.swing * std::exp(mode.lambda * tau);
    q[i] = mode.still + swing.real();
    v[i] = (mode.lambda * swing).real();
    if (path_.is_parabola()) continue;
    const double follow = mode.follow * std::exp(-tau / path_.decay_s);
    q[i] += follow;
    v[i] -= follow / path_.decay_s;
  }
}

void ConstrainedArc::sinusoids_at(double tau, std::span<Complex> z) const {
  for (std::size_t j = 0; j < z_.size(); ++j) z[j] = z_[j] * std::exp(Complex(0, frequency_[j] * tau));
}

void ConstrainedArc::move(double tau) {
  if (tau == 0) return;
  deflection_at(tau, q_, v_);
  sinusoids_at(tau, z_);
  path_ = {path_.angle_at(tau), path_.rate_at(tau), path_.acceleration_rad_s2, path_.decay_s};
  solve(q_, v_);
}

// Required torque minus a level; its derivatives are bounded by the sums of the amplitudes of its parts.
struct ConstrainedArc::TorqueScan {
  const ConstrainedArc& arc;
  double level;

  template <typename Term>
  static void add(Term& term, Complex lambda, Complex amplitude, double tau) {
    const Complex value = amplitude * std::exp(lambda * tau);
    term.value += value.real();
    term.slope += (lambda * value).real();
  }
  ScanPoint at(double tau) const {
    ScanPoint point{-level, 0};
    each([&](Complex lambda, Complex amplitude) { add(point, lambda, amplitude, tau); });
    return point;
  }
  ScanLook look(double a, double b) const {
    const double middle = 0.5 * (a + b);
    ScanLook look{-level, 0, 0};
    each([&](Complex lambda, Complex amplitude) {
      add(look, lambda, amplitude, middle);
      look.curvature +=
          std::norm(lambda) * std::abs(amplitude) * std::exp(std::max(lambda.real() * a, lambda.real() * b));
    });
    return look;
  }
  template <typename Function>
  void each(Function&& function) const {
    const HubPath& path = arc.path_;
    if (path.is_parabola()) {
      function(Complex(0), Complex(arc.plant_.inertia_kg_m2 * path.acceleration_rad_s2));
    } else {
      double amplitude = -arc.plant_.inertia_kg_m2 * path.rate_rad_s / path.decay_s;
      for (const Mode& mode : arc.modes_)
        amplitude += mode.coupling * mode.follow / (path.decay_s * path.decay_s);
      function(Complex(-1 / path.decay_s), Complex(amplitude));
    }
    for (const Mode& mode : arc.modes_)
      function(mode.lambda, mode.coupling * mode.lambda * mode.lambda * mode.swing);
    for (std::size_t j = 0; j < arc.z_.size(); ++j)
      function(Complex(0, arc.frequency_[j]), Complex(0, 1) * arc.z_[j]);
  }
};

std::optional<ConstrainedArc::Excess> ConstrainedArc::leaves(double least_N_m, double most_N_m,
                                                             double h) const {
  if (h <= 0) return std::nullopt;
  const double resolution = 1e-13 * h;
  // What is held at an end of the range, as nothing is by no thrust, is not let go for its rounding.
  const double rounding_N_m = 1e-12 * std::max(std::abs(least_N_m), std::abs(most_N_m));
  const auto above = first_crossing(TorqueScan{*this, most_N_m + rounding_N_m}, 1, 0, h, resolution);
  const auto below =
      first_crossing(TorqueScan{*this, least_N_m - rounding_N_m}, -1, 0, above.value_or(h), resolution);
  if (below && (!above || *below <= *above)) return Excess{*below, -1};
  if (above) return Excess{*above, 1};
  return std::nullopt;
}

}  // namespace slew
