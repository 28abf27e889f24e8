// Rigid spacecraft about one axis: I theta'' = N u + d (Agrawal & Bang 1995, Eq. 1).
#pragma once

namespace slew {

struct RigidAxisParameters {
  double inertia_kg_m2 = 1;
};

/// Angle in rad, rate in rad/s.
template <typename Scalar>
struct AxisState {
  Scalar angle_rad;
  Scalar rate_rad_s;
};

/// Right-hand side: the derivative of the state under a torque in N m.
template <typename Scalar>
AxisState<Scalar> derivative(const RigidAxisParameters& plant, const AxisState<Scalar>& state,
                             const Scalar& torque_N_m) {
  return {state.rate_rad_s, torque_N_m / plant.inertia_kg_m2};
}

}  // namespace slew
