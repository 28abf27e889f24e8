// Motion of a flexible axis under a constant torque, in closed form (propagation/modal_basis.hpp), and the
// times at which something happens on it.
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/propagation/modal_basis.hpp"
#include "server/propagation/motion_scan.hpp"

namespace slew {

/// Holds the state at its beginning (tau = 0). Allocates when made, never afterwards.
class ModalArc {
 public:
  /// Elastic coordinates at rest and undeflected. The basis must outlive it.
  ModalArc(const ModalBasis& basis, double angle_rad, double rate_rad_s,
           std::span<const Sinusoid> sinusoids = {});

  const ModalBasis& basis() const { return *basis_; }
  double torque_N_m() const { return torque_N_m_; }
  void set_torque(double torque_N_m);
  /// What at(tau) and move(tau) will need is made once.
  void make_ready(double tau);
  /// Moves the beginning to tau.
  void move(double tau);

  AxisMotion begin() const { return begin_; }
  AxisMotion at(double tau) const;
  double angle_at(double tau) const { return at(tau).angle_rad; }
  double rate_at(double tau) const { return at(tau).rate_rad_s; }
  double momentum_at(double tau) const;
  /// From here on: z as it was at the beginning moved by tau. The torque stays.
  void begin_anew(double angle_rad, double rate_rad_s, std::span<const double> q, std::span<const double> v,
                  std::span<const std::complex<double>> z);
  /// z_j = A_j exp(i (W_j t + phi_j)) at its beginning.
  std::span<const std::complex<double>> sinusoids() const { return std::span(c_).last(basis_->sinusoids()); }
  /// q and q' at tau; `scratch` has room for basis().size().
  void deflection_at(double tau, std::span<std::complex<double>> scratch, std::span<double> q,
                     std::span<double> v) const;
  std::span<const std::complex<double>> coordinates() const { return c_; }

  /// What rounding may make of a rate of zero, rad/s.
  double rate_rounding_rad_s() const { return 1e-14 * rate_sum_; }
  /// At least the largest |acceleration| and |jerk| on [a, b].
  double acceleration_bound(double a, double b) const;
  double jerk_bound(double a, double b) const;
  /// The same, at less cost and not as near.
  double loose_jerk_bound(double a, double b) const { return jerk_sum_ * growth(a, b); }

 private:
  // p in a panel of time (ModalBasis::panel_s) as a power series about its middle, and a bound of |p'''| in
  // it.
  static constexpr std::size_t kTerms = ModalBasis::kPanelTerms;
  struct Panel {
    std::uint64_t arc = 0;  ///< of which it is
    std::int64_t index;
    std::array<double, kTerms> coefficient;
    double third_derivative;
  };

  void renew();
  double growth(double a, double b) const;
  const Panel& panel(std::int64_t index) const;
  std::int64_t panel_at(double tau) const { return static_cast<std::int64_t>(tau / basis_->panel_s()); }

  const ModalBasis* basis_;
  double angle_rad_;
  double momentum_N_m_s_;  ///< without what the sinusoids make of it, but for a constant
  double torque_N_m_ = 0;
  std::vector<std::complex<double>> c_;
  AxisMotion begin_{};

  // Of the arc: P_k = w_k (c_k - S_k T), sums of |P_k| |lambda_k|^m / I.
  std::vector<std::complex<double>> amplitude_;
  double p_begin_ = 0;
  double p_rest_ = 0;
  double rate_sum_ = 0;
  double acceleration_sum_ = 0;
  double jerk_sum_ = 0;
  double fastest_growth_ = 0;

  // Panels of this arc that were looked at last, and room to make one. Nothing depends on which they are.
  static constexpr std::size_t kPanels = 32;
  std::uint64_t arc_ = 0;  ///< counts them
  mutable std::array<Panel, kPanels> panels_;
  mutable std::vector<std::complex<double>> panel_factor_;
  mutable std::vector<double> derivative_, next_derivative_;

  bool is_ready(double tau) const { return std::abs(tau - stepped_) <= kSameStep_s; }

  // exp(lambda_k tau) of the length that came last: sampled laws step by the same one again and again, but
  // for the rounding of the difference of two times.
  static constexpr double kSameStep_s = 1e-13;
  double stepped_ = -1;
  std::vector<std::complex<double>> factor_;
};

}  // namespace slew
