#include "server/propagation/modal_basis.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <numeric>
#include <stdexcept>

namespace slew {
namespace {

using Complex = std::complex<double>;

}  // namespace

ModalBasis::ModalBasis(SingleAxisPlant plant, std::span<const Sinusoid> sinusoids)
    : plant_(std::move(plant)) {
  const auto n = static_cast<Eigen::Index>(plant_.modes.size());
  if (!(residual_inertia_kg_m2(plant_) > 0)) throw std::domain_error("I - sum D^2 must be positive");
  if (n > 0) add_modes();
  for (const Sinusoid& sinusoid : sinusoids) add_sinusoid(sinusoid);
  divide_time();
}

void ModalBasis::divide_time() {
  double fastest = 0;
  for (const Complex lambda : lambda_) fastest = std::max(fastest, std::abs(lambda));
  if (fastest > 0) panel_s_ = 1 / fastest;
  for (const Complex lambda : lambda_) {
    damping_.push_back(2 * lambda.real());
    stiffness_.push_back(std::norm(lambda));
  }
  for (std::int64_t i = 0; i < kPanelTable; ++i)
    for (const Complex lambda : lambda_) {
      near_.push_back(std::exp(lambda * ((static_cast<double>(i) + 0.5) * panel_s_)));
      far_.push_back(std::exp(lambda * (static_cast<double>(i * kPanelTable) * panel_s_)));
    }
  double term = 1;
  for (std::size_t j = 1; j < kPanelTerms; ++j) {
    // Against the term before last, so that the recurrence has its two.
    if (j > 2) term /= static_cast<double>(j - 2);
    first_in_term_[j] = first_in_term_[j - 1];
    while (first_in_term_[j] + 1 < size() &&
           std::pow(0.5 * panel_s_ * std::sqrt(stiffness_[first_in_term_[j]]), static_cast<double>(j) - 2) *
                   term <
               1e-19)
      ++first_in_term_[j];
  }
}

void ModalBasis::panel_factors(std::int64_t i, std::span<Complex> factors) const {
  if (i >= kPanelTable * kPanelTable) {
    for (std::size_t k = 0; k < size(); ++k)
      factors[k] = std::exp(lambda_[k] * ((static_cast<double>(i) + 0.5) * panel_s_));
    return;
  }
  const Complex* near = near_.data() + static_cast<std::size_t>(i % kPanelTable) * size();
  const Complex* far = far_.data() + static_cast<std::size_t>(i / kPanelTable) * size();
  if (i < kPanelTable) {
    std::copy(near, near + size(), factors.begin());
    return;
  }
  for (std::size_t k = 0; k < size(); ++k)
    factors[k] = {near[k].real() * far[k].real() - near[k].imag() * far[k].imag(),
                  near[k].real() * far[k].imag() + near[k].imag() * far[k].real()};
}

// M q'' + C q' + K q = -D torque / I, the hub eliminated.
ModalBasis::Reduced ModalBasis::reduced() const {
  const auto n = static_cast<Eigen::Index>(plant_.modes.size());
  Reduced system{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n), {}};
  for (Eigen::Index i = 0; i < n; ++i) {
    const ElasticMode& mode = plant_.modes[static_cast<std::size_t>(i)];
    system.coupling(i) = mode.coupling_sqrt_kg_m;
    system.damping(i) = 2 * mode.damping * mode.frequency_rad_s;
    system.stiffness(i) = mode.frequency_rad_s * mode.frequency_rad_s;
  }
  system.mass =
      Eigen::MatrixXd::Identity(n, n) - system.coupling * system.coupling.transpose() / plant_.inertia_kg_m2;
  return system;
}

void ModalBasis::add_modes() {
  const double inertia_kg_m2 = plant_.inertia_kg_m2;
  const auto n = static_cast<Eigen::Index>(plant_.modes.size());
  const auto& [coupling, damping, stiffness, mass] = reduced();
  const Eigen::MatrixXd inverse = mass.inverse();

  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> undamped(stiffness.asDiagonal(), mass,
                                                                           Eigen::EigenvaluesOnly);
  for (Eigen::Index i = 0; i < n; ++i) free_rad_s_.push_back(std::sqrt(undamped.eigenvalues()(i)));

  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  system.topRightCorner(n, n).setIdentity();
  system.bottomLeftCorner(n, n) = -inverse * stiffness.asDiagonal();
  system.bottomRightCorner(n, n) = -inverse * damping.asDiagonal();
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(system);
  const Eigen::MatrixXcd vectors = solver.eigenvectors();
  const Eigen::PartialPivLU<Eigen::MatrixXcd> factored(vectors);
  if (solver.info() != Eigen::Success || !(factored.rcond() > 1e-12))
    throw std::domain_error("the modes have no complete set of eigenvectors");
  const Eigen::MatrixXcd left = factored.inverse();

  // One of every conjugate pair stands for both: its weight is doubled.
  std::vector<Eigen::Index> kept;
  for (Eigen::Index k = 0; k < 2 * n; ++k)
    if (solver.eigenvalues()(k).imag() >= 0) kept.push_back(k);
  std::sort(kept.begin(), kept.end(), [&](Eigen::Index a, Eigen::Index b) {
    return std::abs(solver.eigenvalues()(a)) < std::abs(solver.eigenvalues()(b));
  });
  Eigen::VectorXd at_rest = Eigen::VectorXd::Zero(2 * n);
  at_rest.head(n) = -coupling.cwiseQuotient(stiffness) / inertia_kg_m2;
  const auto pairs = kept.size();
  for (std::size_t j = 0; j < pairs; ++j) {
    const Eigen::Index k = kept[j];
    const Complex lambda = solver.eigenvalues()(k);
    const double doubled = lambda.imag() > 0 ? 2 : 1;
    lambda_.push_back(lambda);
    p_weight_.push_back(doubled * coupling.cast<Complex>().cwiseProduct(vectors.col(k).head(n)).sum());
    rest_.push_back((left.row(k) * at_rest.cast<Complex>())(0));
    for (Eigen::Index i = 0; i < 2 * n; ++i) {
      to_modal_.push_back(left(k, i));
      to_physical_.push_back(doubled * vectors(i, k));
    }
  }
}

// Im(G z) = Re(-i G z), with the response G of q to exp(i W t), and what the torque does to a rigid body.
void ModalBasis::add_sinusoid(const Sinusoid& sinusoid) {
  const double w = sinusoid.frequency_rad_s;
  const auto n = static_cast<Eigen::Index>(plant_.modes.size());
  Complex weight = 1 / (w * w);
  ++sinusoids_;
  if (n > 0) {
    const auto& [coupling, damping, stiffness, mass] = reduced();
    Eigen::MatrixXcd dynamic = -w * w * mass.cast<Complex>();
    dynamic.diagonal() += stiffness.cast<Complex>() + Complex(0, w) * damping.cast<Complex>();
    const Eigen::PartialPivLU<Eigen::MatrixXcd> factored(dynamic);
    if (!(factored.rcond() > 1e-14)) throw std::domain_error("a sinusoid meets an undamped mode");
    const Eigen::VectorXcd response = factored.solve(-coupling.cast<Complex>() / plant_.inertia_kg_m2);
    weight += coupling.cast<Complex>().cwiseProduct(response).sum();
    for (Eigen::Index i = 0; i < n; ++i) to_physical_.push_back(Complex(0, -1) * response(i));
    for (Eigen::Index i = 0; i < n; ++i) to_physical_.push_back(w * response(i));
  }
  lambda_.emplace_back(0, w);
  p_weight_.push_back(Complex(0, -1) * weight);
  rest_.emplace_back(0);
}

void ModalBasis::to_modal(std::span<const double> q, std::span<const double> v, std::span<Complex> c) const {
  const std::size_t n = plant_.modes.size(), modal = size() - sinusoids_;
  for (std::size_t k = 0; k < modal; ++k) {
    const Complex* row = to_modal_.data() + 2 * n * k;
    c[k] = 0;
    for (std::size_t i = 0; i < 2 * n; ++i) {
      double value = i < n ? q[i] : v[i - n];
      for (std::size_t j = modal; j < size(); ++j) value -= (to_physical_[2 * n * j + i] * c[j]).real();
      c[k] += row[i] * value;
    }
  }
}

void ModalBasis::to_physical(std::span<const Complex> c, std::span<double> q, std::span<double> v) const {
  const std::size_t n = plant_.modes.size();
  for (std::size_t i = 0; i < 2 * n; ++i) {
    double value = 0;
    for (std::size_t k = 0; k < size(); ++k) {
      const Complex weight = to_physical_[2 * n * k + i];
      value += weight.real() * c[k].real() - weight.imag() * c[k].imag();
    }
    (i < n ? q[i] : v[i - n]) = value;
  }
}

}  // namespace slew
