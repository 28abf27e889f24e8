// The elastic part of a flexible axis in its own modes, where a constant torque has a closed form.
//
// Momentum h = I omega + D.q' obeys h' = torque, so the hub can be eliminated:
//   (1 - D D^T / I) q'' + C q' + K q = -D torque / I.
// With the eigenvalues lambda_k of this system in first-order form, every quantity is
//   Re sum_k w_k (S_k T + (c_k - S_k T) exp(lambda_k tau))
// and theta, omega follow from h and p = D.q:  I theta = I theta_0 + h_0 tau + T tau^2/2 - (p - p_0),
//   I omega = h - p'.
// A sinusoidal disturbance is one more oscillator, z = A exp(i (W t + phi)), that drives the modes and is not
// driven: with its forced response taken out of the c_k these stay as they are, z is one more coordinate with
// lambda = i W, and what it does to p, and to the hub itself, is its weight.
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <cstdint>
#include <span>
#include <vector>

#include "server/plant/disturbance.hpp"
#include "server/plant/single_axis.hpp"

namespace slew {

/// Immutable once made. One entry for each pair of conjugate eigenvalues, for each real one, and after them
/// one for each sinusoid.
class ModalBasis {
 public:
  /// Throws std::domain_error when I - sum D^2 is not positive, or when the modes have no complete set of
  /// eigenvectors (two that are exactly alike and critically damped), or when a sinusoid meets an undamped
  /// mode at its very frequency.
  explicit ModalBasis(SingleAxisPlant plant, std::span<const Sinusoid> sinusoids = {});

  double inertia_kg_m2() const { return plant_.inertia_kg_m2; }
  std::span<const ElasticMode> modes() const { return plant_.modes; }
  std::size_t size() const { return lambda_.size(); }
  std::size_t sinusoids() const { return sinusoids_; }

  /// Eigenvalues with the hub free, 1/s, ascending by magnitude.
  std::span<const std::complex<double>> lambda() const { return lambda_; }
  /// Undamped natural frequencies with the hub free, rad/s, ascending.
  std::span<const double> free_frequencies_rad_s() const { return free_rad_s_; }

  /// w_k of p = D.q.
  std::span<const std::complex<double>> p_weights() const { return p_weight_; }
  /// S_k: where the modal coordinates rest under a torque of 1 N m.
  std::span<const std::complex<double>> rest() const { return rest_; }

  /// Time is divided into panels short enough that a power series about the middle of one converges at once:
  /// |lambda| times half of its length is at most 1.
  double panel_s() const { return panel_s_; }
  /// exp(lambda_k tau) at the middle of panel i, for each k; the same bits whatever came before.
  void panel_factors(std::int64_t i, std::span<std::complex<double>> factors) const;
  /// 2 Re lambda_k and |lambda_k|^2: d^2/dtau^2 of exp(lambda_k tau) is the first times d/dtau minus the
  /// second.
  std::span<const double> damping_per_s() const { return damping_; }
  std::span<const double> stiffness_per_s2() const { return stiffness_; }
  static constexpr std::size_t kPanelTerms = 15;  ///< of the series; the rest is below 1/19!, 1e-17
  /// The first coordinate that matters to term j: slow ones are done sooner (they stand in ascending order).
  std::size_t first_in_term(std::size_t j) const { return first_in_term_[j]; }

  /// Between coordinates c (size(), of which the last are the sinusoids' z and are left as they are) and
  /// physical q, q' (modes().size() each).
  void to_modal(std::span<const double> q, std::span<const double> v,
                std::span<std::complex<double>> c) const;
  void to_physical(std::span<const std::complex<double>> c, std::span<double> q, std::span<double> v) const;

 private:
  struct Reduced {
    Eigen::VectorXd coupling, damping, stiffness;
    Eigen::MatrixXd mass;
  };
  Reduced reduced() const;
  void add_modes();
  void add_sinusoid(const Sinusoid& sinusoid);

  SingleAxisPlant plant_;
  std::size_t sinusoids_ = 0;
  std::vector<std::complex<double>> lambda_, p_weight_, rest_;
  std::vector<std::complex<double>> to_modal_;     ///< a row of 2 n for each mode's coordinate
  std::vector<std::complex<double>> to_physical_;  ///< a column of 2 n for each coordinate
  std::vector<double> free_rad_s_;

  // exp(lambda_k tau) at the middles of the first kPanelTable panels, and over so many panels at a time;
  // size() to each.
  static constexpr std::int64_t kPanelTable = 16;
  void divide_time();
  double panel_s_ = 1;
  std::vector<std::complex<double>> near_, far_;
  std::vector<double> damping_, stiffness_;
  std::array<std::size_t, kPanelTerms> first_in_term_{};
};

}  // namespace slew
