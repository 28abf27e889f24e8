// The elastic part of a flexible axis in its own modes, where a constant torque has a closed form.
//
// Momentum h = I omega + D.q' obeys h' = torque, so the hub can be eliminated:
//   (1 - D D^T / I) q'' + C q' + K q = -D torque / I.
// With the eigenvalues lambda_k of this system in first-order form, every quantity is
//   Re sum_k w_k (S_k T + (c_k - S_k T) exp(lambda_k tau))
// and theta, omega follow from h and p = D.q:  I theta = I theta_0 + h_0 tau + T tau^2/2 - (p - p_0),
//   I omega = h - p'.
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "server/plant/single_axis.hpp"

namespace slew {

/// Immutable once made. One entry for each pair of conjugate eigenvalues, and for each real one.
class ModalBasis {
 public:
  /// Throws std::domain_error when I - sum D^2 is not positive, or when the modes have no complete set of
  /// eigenvectors (two that are exactly alike and critically damped).
  explicit ModalBasis(SingleAxisPlant plant);

  double inertia_kg_m2() const { return plant_.inertia_kg_m2; }
  std::span<const ElasticMode> modes() const { return plant_.modes; }
  std::size_t size() const { return lambda_.size(); }

  /// Eigenvalues with the hub free, 1/s, ascending by magnitude.
  std::span<const std::complex<double>> lambda() const { return lambda_; }
  /// Undamped natural frequencies with the hub free, rad/s, ascending.
  std::span<const double> free_frequencies_rad_s() const { return free_rad_s_; }

  /// w_k of p = D.q.
  std::span<const std::complex<double>> p_weights() const { return p_weight_; }
  /// S_k: where the modal coordinates rest under a torque of 1 N m.
  std::span<const std::complex<double>> rest() const { return rest_; }

  /// Between modal coordinates c (size()) and physical q, q' (modes().size() each).
  void to_modal(std::span<const double> q, std::span<const double> v,
                std::span<std::complex<double>> c) const;
  void to_physical(std::span<const std::complex<double>> c, std::span<double> q, std::span<double> v) const;

 private:
  SingleAxisPlant plant_;
  std::vector<std::complex<double>> lambda_, p_weight_, rest_;
  std::vector<std::complex<double>> to_modal_;     ///< size() rows of 2 n
  std::vector<std::complex<double>> to_physical_;  ///< 2 n rows of size()
  std::vector<double> free_rad_s_;
};

}  // namespace slew
