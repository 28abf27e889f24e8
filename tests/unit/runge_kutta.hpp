// One classical Runge-Kutta step of x' = slope(t, x): the tests' own propagator.
#pragma once

template <typename State, typename Slope>
State runge_kutta(const Slope& slope, double t, const State& x, double step) {
  const State k1 = slope(t, x);
  const State k2 = slope(t + step / 2, x + step / 2 * k1);
  const State k3 = slope(t + step / 2, x + step / 2 * k2);
  const State k4 = slope(t + step, x + step * k3);
  return x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
}
