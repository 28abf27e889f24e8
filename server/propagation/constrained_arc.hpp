// Motion with the hub on a known path, and the torque that this takes.
//
// On a switching surface the thrusters chatter so that s stays where it is (Filippov): theta follows from the
// law alone, the appendages follow theta, q_i'' + 2 zeta_i w_i q_i' + w_i^2 q_i = -D_i theta'', and
//   required torque = I theta'' + sum D_i q_i'' - sum A_j sin(W_j t + phi_j)
// tells for how long constant torques and thrusters can supply it. The same holds for a hub that friction
// holds.
#pragma once

#include <complex>
#include <optional>
#include <span>
#include <vector>

#include "server/plant/disturbance.hpp"
#include "server/plant/single_axis.hpp"
#include "server/propagation/crossing_scan.hpp"
#include "server/propagation/hub_path.hpp"

namespace slew {

/// Allocates when made, never afterwards. Expects modes that are less than critically damped.
class ConstrainedArc {
 public:
  ConstrainedArc(const SingleAxisPlant& plant, std::span<const Sinusoid> sinusoids);

  /// From here on along `path`; q, q' (one for each mode) and z_j = A_j exp(i (W_j t + phi_j)) at its
  /// beginning.
  void begin(const HubPath& path, std::span<const double> q, std::span<const double> v,
             std::span<const std::complex<double>> z);
  /// The same motion goes on along another path.
  void turn_into(const HubPath& path);
  void move(double tau);

  const HubPath& path() const { return path_; }
  /// N m, from thrusters, friction and constant disturbances together.
  double required_torque_at(double tau) const;
  /// Its integral over [0, tau], N m s.
  double required_impulse(double tau) const;
  /// The first time in [0, h] at which the required torque leaves [least, most], and by which end.
  struct Excess {
    double tau;
    int end;  ///< -1: below least, +1: above most
  };
  std::optional<Excess> leaves(double least_N_m, double most_N_m, double h) const;

  void deflection_at(double tau, std::span<double> q, std::span<double> v) const;
  void sinusoids_at(double tau, std::span<std::complex<double>> z) const;
  /// I omega + sum D q', N m s.
  double momentum_at(double tau) const;

 private:
  struct Mode {
    double coupling;
    std::complex<double> lambda;
    double still = 0;            ///< q under the parabola's acceleration
    double follow = 0;           ///< of exp(-tau/T)
    std::complex<double> swing;  ///< of exp(lambda tau), real part
  };
  struct TorqueScan;

  void solve(std::span<const double> q, std::span<const double> v);

  const SingleAxisPlant& plant_;
  HubPath path_;
  std::vector<Mode> modes_;
  std::vector<double> frequency_;  ///< W_j, rad/s
  std::vector<std::complex<double>> z_;
  std::vector<double> q_, v_;  ///< room for move and turn_into
};

}  // namespace slew
