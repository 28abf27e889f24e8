#include "server/estimation/sampled_disturbance_observer.hpp"

#include <cmath>

namespace slew {

SampledDisturbanceObserver::SampledDisturbanceObserver(const DisturbanceObserver& observer, double period_s)
    : observer_(observer), period_s_(period_s) {
  const std::array<double, 3> l = observer_gains(observer.pole_rad_s);
  // M has the triple eigenvalue -a, so N = M + a 1 has N^3 = 0 and
  //   exp(M T) - 1 = (exp(-a T) - 1) 1 + exp(-a T) (N T + (N T)^2 / 2).
  Eigen::Matrix3d n;
  n << -l[0], 1, 0, -l[1], 0, 1, -l[2], 0, 0;
  n.diagonal().array() += observer.pole_rad_s;
  n *= period_s;
  const double decay = -observer.pole_rad_s * period_s;
  increment_ = std::expm1(decay) * Eigen::Matrix3d::Identity() + std::exp(decay) * (n + n * n / 2);
}

// Q' = M z^ - l u, and l = -M (1, 0, 0): so z^' = M (z^ + (u, 0, 0)) + l J^ s', which subtracts J^ s' from u.
ObserverState<double> SampledDisturbanceObserver::step(const ObserverState<double>& q,
                                                       const Eigen::Vector3d& surface_rad_s,
                                                       const Eigen::Vector3d& next_surface_rad_s,
                                                       const Eigen::Vector3d& input_N_m) const {
  const Eigen::Vector3d change_rad_s = next_surface_rad_s - surface_rad_s;
  const ObserverState<double> z = estimate(q, surface_rad_s);
  const Eigen::Vector3d moving = z[0] + input_N_m - observer_.inertia_kg_m2 * change_rad_s / period_s_;
  ObserverState<double> next = q;
  for (int i = 0; i < 3; ++i)
    next[i] += increment_(i, 0) * moving + increment_(i, 1) * z[1] + increment_(i, 2) * z[2];
  // Q = z^ - K1 s, and K1 s has changed too.
  return estimated_disturbance<double>(observer_, next, -change_rad_s);
}

}  // namespace slew
