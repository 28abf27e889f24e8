// A spacecraft about one axis: rigid, I theta'' = N u + d (Agrawal & Bang 1995, Eq. 1), or with elastic
// appendages in the correct form of their Eq. 21:
//   I theta'' + sum D_i q_i'' = N u + d,    q_i'' + 2 zeta_i w_i q_i' + w_i^2 q_i + D_i theta'' = 0.
// The paper prints D_i q_i' in the first line and D_i theta' in the second, and leaves the damping out; its
// own Eqs. 24 and 25 and its 0.4 % of damping ask for this form. With the printed one momentum is not
// conserved.
#pragma once

#include <span>
#include <vector>

namespace slew {

/// One cantilever mode of an appendage, mass-normalised.
struct ElasticMode {
  double frequency_rad_s;     ///< w_i, clamped and undamped
  double damping;             ///< zeta_i
  double coupling_sqrt_kg_m;  ///< D_i, kg^1/2 m; its sign is free
};

struct SingleAxisPlant {
  double inertia_kg_m2 = 1;        ///< of the whole spacecraft, undeformed
  std::vector<ElasticMode> modes;  ///< none: rigid
};

/// I - sum D_i^2: the hub's inertia with what the modes leave out of the appendages. Must be positive.
inline double residual_inertia_kg_m2(const SingleAxisPlant& plant) {
  double residual = plant.inertia_kg_m2;
  for (const ElasticMode& mode : plant.modes) residual -= mode.coupling_sqrt_kg_m * mode.coupling_sqrt_kg_m;
  return residual;
}

/// Right-hand side. `state` is (theta, omega, q_1 … q_n, q_1' … q_n') in rad, rad/s, kg^1/2 m, kg^1/2 m/s;
/// the torque is N u + d in N m.
template <typename Scalar>
void derivative(const SingleAxisPlant& plant, std::span<const Scalar> state, const Scalar& torque_N_m,
                std::span<Scalar> slope) {
  const std::size_t n = plant.modes.size();
  const std::span<const Scalar> q = state.subspan(2, n), v = state.subspan(2 + n, n);
  // The modes' own accelerations would turn the hub as well; both at once by Sherman & Morrison's formula.
  Scalar coupled = torque_N_m;
  for (std::size_t i = 0; i < n; ++i) {
    const ElasticMode& mode = plant.modes[i];
    const double w = mode.frequency_rad_s;
    coupled += mode.coupling_sqrt_kg_m * (2 * mode.damping * w * v[i] + w * w * q[i]);
  }
  const Scalar acceleration = coupled / residual_inertia_kg_m2(plant);
  slope[0] = state[1];
  slope[1] = acceleration;
  for (std::size_t i = 0; i < n; ++i) {
    const ElasticMode& mode = plant.modes[i];
    const double w = mode.frequency_rad_s;
    slope[2 + i] = v[i];
    slope[2 + n + i] = -2 * mode.damping * w * v[i] - w * w * q[i] - mode.coupling_sqrt_kg_m * acceleration;
  }
}

/// I omega + sum D_i q_i', N m s: the integral of the torque, exactly.
template <typename Scalar>
Scalar momentum_N_m_s(const SingleAxisPlant& plant, std::span<const Scalar> state) {
  Scalar momentum = plant.inertia_kg_m2 * state[1];
  for (std::size_t i = 0; i < plant.modes.size(); ++i)
    momentum += plant.modes[i].coupling_sqrt_kg_m * state[2 + plant.modes.size() + i];
  return momentum;
}

}  // namespace slew
