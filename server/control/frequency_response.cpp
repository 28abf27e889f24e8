#include "server/control/frequency_response.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/control/balancing.hpp"

namespace slew {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr double kLeastGain = 1e-9, kMostGain = 1e9;

// The open loop, c (s - A)^-1 b = -L(s), in units in which its parts are of like size.
struct OpenLoop {
  MatrixXd a;
  VectorXd b;
  RowVectorXd c;
};

OpenLoop open_loop(const ControlLoop& loop, double loop_gain) {
  const Balanced closed = balance(loop.matrix(loop_gain));
  const VectorXd inverse = closed.scale.cwiseInverse();
  OpenLoop open{inverse.asDiagonal() * loop.open() * closed.scale.asDiagonal(),
                inverse.cwiseProduct(loop.torque_input()),
                loop_gain * loop.torque().cwiseProduct(closed.scale.transpose())};
  const double share = std::sqrt(open.c.norm() / open.b.norm());
  if (share > 0 && std::isfinite(share)) {
    open.b *= share;
    open.c /= share;
  }
  return open;
}

// Frequencies near which one of these may be on the imaginary axis.
std::vector<double> near_the_axis(const std::vector<Complex>& values) {
  std::vector<double> frequencies;
  for (const Complex s : values)
    if (s.imag() > 0 && std::abs(s.real()) <= 1e-2 * std::abs(s) && std::isfinite(s.imag()))
      frequencies.push_back(s.imag());
  return frequencies;
}

// The zero of f in the smallest bracket around each candidate that has one. No bracket: no crossing.
template <typename Function>
std::vector<double> refined(const std::vector<double>& candidates, Function&& f) {
  std::vector<double> found;
  for (const double candidate : candidates) {
    double a = 0, b = 0;
    bool is_bracketed = false;
    for (double width = 1e-12; width < 0.03 && !is_bracketed; width *= 4) {
      a = candidate * (1 - width);
      b = candidate * (1 + width);
      is_bracketed = (f(a) < 0) != (f(b) < 0);
    }
    if (!is_bracketed) continue;
    const bool begins_below = f(a) < 0;
    for (int i = 0; i < 200; ++i) {
      const double middle = 0.5 * (a + b);
      if (!(middle > a && middle < b)) break;
      ((f(middle) < 0) == begins_below ? a : b) = middle;
    }
    // Of the two neighbours the one that is nearer.
    found.push_back(std::abs(f(a)) < std::abs(f(b)) ? a : b);
  }
  std::sort(found.begin(), found.end());
  const auto same = [](double x, double y) { return y - x <= 1e-9 * y; };
  found.erase(std::unique(found.begin(), found.end(), same), found.end());
  return found;
}

// Zeros of the odd function L(s) - L(-s), which are where L is real on the imaginary axis. It vanishes at
// infinity, so that its zeros are no ordinary eigenvalue problem; with s = alpha (1 + z)/(1 - z), which takes
// the axis to the unit circle, they are one:
//   (1 - z) C (z + M)^-1 N = C (z + M)^-1 (1 + M) N - C N,    M = E^-1 (alpha - A),  N = E^-1 B,  E = alpha +
//   A.
std::vector<double> where_real(const OpenLoop& open, double scale_rad_s) {
  const Index n = open.a.rows();
  MatrixXd a = MatrixXd::Zero(2 * n, 2 * n);
  a.topLeftCorner(n, n) = open.a;
  a.bottomRightCorner(n, n) = -open.a;
  VectorXd b(2 * n);
  b << open.b, open.b;
  RowVectorXd c(2 * n);
  c << open.c, open.c;
  const MatrixXd one = MatrixXd::Identity(2 * n, 2 * n);
  // Any alpha will do that is no eigenvalue and no zero itself.
  for (const double factor : {1.0, 1.37, 0.61, 2.9, 0.23}) {
    const double alpha = factor * scale_rad_s;
    const Eigen::PartialPivLU<MatrixXd> e(alpha * one + a);
    const VectorXd input = e.solve(b);
    const double through = c.dot(input);
    if (!(std::abs(through) > 1e-10 * c.norm() * input.norm())) continue;
    const MatrixXd m = e.solve(alpha * one - a);
    const MatrixXd zeros = -m + (input + m * input) * c / through;
    if (!zeros.allFinite()) continue;
    std::vector<Complex> found;
    for (const Complex z : eigenvalues(zeros)) found.push_back(alpha * (1.0 + z) / (1.0 - z));
    return near_the_axis(found);
  }
  // L(s) = L(-s) everywhere: it is real everywhere, and no gain tells from another.
  return {};
}

// Eigenvalues of this matrix on the axis are where |L| = 1 (bounded-real lemma).
std::vector<double> where_one(const OpenLoop& open) {
  const Index n = open.a.rows();
  MatrixXd hamiltonian(2 * n, 2 * n);
  hamiltonian << open.a, open.b * open.b.transpose(), -open.c.transpose() * open.c, -open.a.transpose();
  return hamiltonian.allFinite() ? near_the_axis(eigenvalues(hamiltonian)) : std::vector<double>{};
}

// Around the middle of what the loop has, on a logarithmic scale.
double scale_of(const ControlLoop& loop, double loop_gain) {
  double sum = 0, count = 0;
  for (const Complex pole : loop.poles(loop_gain))
    if (std::abs(pole) > 0) {
      sum += std::log(std::abs(pole));
      ++count;
    }
  return count > 0 ? std::exp(sum / count) : 1;
}

// The phase of s - root as s goes up the axis, without jumps but at a root on the axis, where it is that of
// one just left of it. Conjugate pairs begin at 0.
double phase_of(double frequency_rad_s, Complex root) {
  const double above = frequency_rad_s - root.imag();
  if (root.real() <= 1e-12 * std::abs(root)) return std::atan2(above, std::max(0.0, -root.real()));
  return (root.imag() == 0 ? std::numbers::pi : 0) - std::atan2(above, root.real());
}

}  // namespace

std::vector<PhaseCrossover> phase_crossovers(const ControlLoop& loop) {
  const auto is_imaginary = [&](double w) {
    const Complex response = loop.loop_response({0, w});
    return response.imag() / std::abs(response);
  };
  std::vector<PhaseCrossover> found;
  for (const double w : refined(where_real(open_loop(loop, 1), scale_of(loop, 1)), is_imaginary)) {
    const double gain = -1 / loop.loop_response({0, w}).real();
    if (gain > kLeastGain && gain < kMostGain) found.push_back({w, gain});
  }
  return found;
}

std::vector<GainCrossover> gain_crossovers(const ControlLoop& loop, double loop_gain) {
  const auto size = [&](double w) { return std::log(loop_gain * std::abs(loop.loop_response({0, w}))); };
  std::vector<GainCrossover> found;
  for (const double w : refined(where_one(open_loop(loop, loop_gain)), size))
    found.push_back({w, std::arg(-loop.loop_response({0, w})) * kDegPerRad});
  return found;
}

std::vector<BodePoint> bode(const ControlLoop& loop, double loop_gain, std::span<const double> frequencies) {
  const auto zeros = loop.loop_zeros(), poles = loop.loop_poles();
  // -num/den of the compensator begins with a positive coefficient, or is zero.
  std::vector<BodePoint> points;
  for (const double w : frequencies) {
    double phase = 0;
    for (const Complex zero : zeros) phase += phase_of(w, zero);
    for (const Complex pole : poles) phase -= phase_of(w, pole);
    points.push_back(
        {w, 20 * std::log10(loop_gain * std::abs(loop.loop_response({0, w}))), phase * kDegPerRad});
  }
  return points;
}

std::vector<double> bode_grid(const ControlLoop& loop, double loop_gain, std::size_t points) {
  auto marks = loop.loop_zeros();
  for (const auto& more : {loop.loop_poles(), loop.poles(loop_gain)})
    marks.insert(marks.end(), more.begin(), more.end());
  constexpr double kLeastWidth = 1e-4;  // without damping there is no peak to be drawn
  double least = HUGE_VAL, most = 0;
  std::vector<double> grid;
  for (const Complex mark : marks) {
    const double size = std::abs(mark);
    if (size == 0) continue;
    least = std::min(least, size);
    most = std::max(most, size);
    // A resonance is as wide as it is damped.
    if (mark.imag() <= 0 || damping_ratio(mark) > 0.2) continue;
    const double width = std::max(std::abs(damping_ratio(mark)), kLeastWidth);
    for (int i = -8; i <= 8; ++i)
      if (i != 0 || width > kLeastWidth) grid.push_back(size * std::exp(0.5 * i * width));
  }
  if (!(most > 0)) least = most = 1;
  least /= 100;
  most *= 100;
  for (std::size_t i = 0; i < points; ++i)
    grid.push_back(least * std::pow(most / least, static_cast<double>(i) / static_cast<double>(points - 1)));
  std::sort(grid.begin(), grid.end());
  return grid;
}

}  // namespace slew
