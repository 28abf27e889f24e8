// The flexible spacecraft of Agrawal & Bang 1995, Table 1, with the couplings that the paper leaves out
// (derived from a beam frame, elbow-heavy), and random ones.
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/single_axis_cases.hpp"

namespace slew::test {

inline constexpr double kRadPerDeg = std::numbers::pi / 180;

inline SingleAxisPlant table_1_plant() {
  SingleAxisPlant plant{13, {}};
  const double hz[] = {0.139, 0.42, 2.463, 4.295, 6.86, 12.82};
  const double coupling[] = {2.447, 0.833, 0.358, 0.126, 0.162, 0.007};
  for (int i = 0; i < 6; ++i) plant.modes.push_back({2 * std::numbers::pi * hz[i], 0.004, coupling[i]});
  return plant;
}

/// 50 deg, 6 % of disturbance along the slew, end box of 0.5 deg and 0.5 deg/s.
inline OnOffAxisSpecification flexible_slew(double gamma_bar, double period_s) {
  OnOffAxisSpecification spec;
  spec.plant = table_1_plant();
  spec.maneuver.final_angle_rad = 50 * kRadPerDeg;
  spec.law.inertia_kg_m2 = 13;
  spec.law.torque_N_m = spec.actuator.torque_N_m = 0.3;
  spec.law.gamma_bar = gamma_bar;
  spec.law.end_box = EndBox{0.5 * kRadPerDeg, 0.5 * kRadPerDeg};
  spec.evaluation = Evaluation::sampled;
  spec.sample_period_s = period_s;
  spec.disturbances.constant_N_m = 0.018;
  spec.duration_s = 40;
  spec.telemetry_period_s = 0.1;
  return spec;
}

/// Up to eight modes that carry at most 70 % of the inertia.
inline SingleAxisPlant random_plant(std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  SingleAxisPlant plant{uniform(1, 50), {}};
  double left = uniform(0.1, 0.7) * plant.inertia_kg_m2;
  for (int n = 1 + static_cast<int>(random() % 8); n > 0; --n) {
    const double part = uniform(0, left);
    left -= part;
    plant.modes.push_back({2 * std::numbers::pi * std::exp(uniform(std::log(0.05), std::log(20))),
                           random() % 4 == 0 ? 0 : uniform(0, 0.1),
                           random() % 2 ? std::sqrt(part) : -std::sqrt(part)});
  }
  return plant;
}

/// A slew that this plant makes in some seconds, sampled or with a minimum on-time.
inline OnOffAxisSpecification random_flexible_slew(std::mt19937_64& random, bool is_sampled) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  auto spec = flexible_slew(uniform(0.8, 1.6), uniform(0.01, 0.1));
  spec.plant = random_plant(random);
  spec.law.inertia_kg_m2 = spec.plant.inertia_kg_m2;
  spec.actuator.torque_N_m = spec.law.torque_N_m = uniform(0.02, 0.1) * spec.plant.inertia_kg_m2;
  spec.disturbances.constant_N_m = uniform(-0.1, 0.1) * spec.actuator.torque_N_m;
  spec.maneuver.initial_angle_rad = uniform(-1, 1);
  spec.maneuver.final_angle_rad = uniform(-1, 1);
  spec.law.deadband = static_cast<Deadband>(random() % 3);
  spec.law.deadband_rad = uniform(0.01, 0.05);
  spec.duration_s = 10;
  return is_sampled ? spec : continuous(spec, uniform(0.05, 0.2));
}

}  // namespace slew::test
