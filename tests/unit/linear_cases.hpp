// The loops of Bryson 1994, section 3.2, with omega_0 = 1 and I = 1, and random ones.
#pragma once

#include <cmath>

#include "server/control/root_locus.hpp"
#include "tests/unit/flexible_cases.hpp"

namespace slew::test {

/// A second from 30 deg to 0 with D = K = 2: poles at -1 +- j.
inline LinearAxisSpecification attitude_rate() {
  LinearAxisSpecification spec;
  spec.maneuver.initial_angle_rad = 30 * kRadPerDeg;
  spec.feedback.law = AttitudeRateFeedback{2, 2};
  spec.duration_s = 10;
  spec.telemetry_period_s = 0.1;
  return spec;
}

inline LinearAxisSpecification problem_3_2_2() {
  auto spec = attitude_rate();
  spec.estimator = SecondOrderAngleEstimator{2, 2, 1};
  return spec;
}

inline LinearAxisSpecification problem_3_2_4() {
  auto spec = attitude_rate();
  spec.estimator = FirstOrderAngleEstimator{1, 1};
  return spec;
}

/// Fig. 3.3: b > a > 0.
inline LinearAxisSpecification lead(double gain, double a, double b) {
  auto spec = attitude_rate();
  spec.feedback.law = LeadCompensation{gain, a, b};
  return spec;
}

/// Laws, estimators, disturbances and, with `flexible`, modes at random; the loop is stable.
inline LinearAxisSpecification random_loop(std::mt19937_64& random, bool flexible) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  while (true) {
    LinearAxisSpecification spec = attitude_rate();
    if (flexible)
      spec.plant = random_plant(random);
    else
      spec.plant.inertia_kg_m2 = uniform(0.5, 50);
    const double inertia = spec.plant.inertia_kg_m2;
    const std::complex<double> pole{-uniform(0.1, 1), uniform(0, 1)};
    spec.feedback.law = place_regulator(pole, inertia);
    switch (random() % 4) {
      case 0:
        break;
      case 1:
        spec.estimator = place_second_order(uniform(1, 4) * pole, uniform(0.8, 1.2) * inertia);
        break;
      case 2:
        spec.estimator = place_first_order(-uniform(0.3, 3), uniform(0.8, 1.2) * inertia);
        break;
      default:
        const double a = uniform(0.1, 1);
        spec.feedback.law = LeadCompensation{uniform(0.2, 2) * inertia, a, a * uniform(2, 10)};
    }
    spec.feedback.loop_gain = uniform(0.5, 1.5);
    if (!is_stable(control_loop(spec).poles(spec.feedback.loop_gain))) continue;
    spec.maneuver = {uniform(-1, 1), uniform(-0.2, 0.2), uniform(-1, 1)};
    spec.estimate.rate_rad_s = uniform(-0.1, 0.1);
    if (random() % 2) spec.estimate.error_rad = uniform(-1, 1);
    spec.disturbances.constant_N_m = uniform(-0.1, 0.1) * inertia;
    if (random() % 2) spec.disturbances.steps = {{uniform(0, 5), uniform(-0.1, 0.1) * inertia}};
    if (random() % 2)
      spec.disturbances.sinusoids = {{0.1 * inertia, uniform(0.1, 10), uniform(0, 6)},
                                     {0.02 * inertia, uniform(0.1, 10), uniform(0, 6)}};
    return spec;
  }
}

inline RunReport fly(const LinearAxisSpecification& spec) {
  return fly(*make_linear_axis_run(spec));
}

}  // namespace slew::test
