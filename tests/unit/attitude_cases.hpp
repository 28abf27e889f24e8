// The cases of Kim & Crassidis 1998, and the common slew that many programs were timed on.
#pragma once

#include <cmath>
#include <numbers>

#include "server/simulation/attitude.hpp"
#include "tests/unit/single_axis_cases.hpp"

namespace slew::test {

inline RunReport fly(const AttitudeSpecification& spec) {
  return fly(*make_attitude_run(spec));
}

inline SlidingMode sliding_mode(double lambda, double gain, const Eigen::Matrix3d& inertia) {
  SlidingMode law;
  law.lambda_1_s.setConstant(lambda);
  law.gain_rad_s2.setConstant(gain);
  law.inertia_kg_m2 = inertia;
  return law;
}

/// Table 1: J = J^ = 1, a pulse-width pulse-frequency modulator in each axis.
inline AttitudeSpecification table_1(double angle_deg, double lambda, double gain) {
  AttitudeSpecification spec;
  spec.maneuver.initial_mrp = {0, 0, std::tan(angle_deg * std::numbers::pi / 720)};
  spec.law = sliding_mode(lambda, gain, Eigen::Matrix3d::Identity());
  spec.actuator = AxisThrusters{};
  spec.settling = {AttitudeQuantity::mrp_3, true, 0.01};
  spec.duration_s = 20;
  spec.telemetry_period_s = 0.1;
  return spec;
}

/// Cases A to D: 180 deg of yaw.
inline AttitudeSpecification yaw_half_turn(bool inertia_is_uncertain, bool is_disturbed) {
  AttitudeSpecification spec = table_1(0, -0.3854, 0.0421);
  if (inertia_is_uncertain)
    spec.plant.inertia_kg_m2 = Eigen::Vector3d(125.4, 108.3, 131.1).asDiagonal();
  else
    spec.plant.inertia_kg_m2 = 114 * Eigen::Matrix3d::Identity();
  spec.law = sliding_mode(-0.3854, 0.0421, 114 * Eigen::Matrix3d::Identity());
  if (is_disturbed) spec.disturbances.sinusoids.push_back({{0.001, -0.001, 0.001}, 1, 0});
  spec.maneuver.initial_mrp = {0, 0, 1};
  spec.duration_s = 120;
  return spec;
}

inline AttitudeSpecification observed(AttitudeSpecification spec, ObserverFeeding feeding) {
  spec.observer = DisturbanceObserver{10, std::get<SlidingMode>(spec.law).inertia_kg_m2, feeding};
  return spec;
}

inline AttitudeSpecification common_slew() {
  AttitudeSpecification spec;
  spec.plant.inertia_kg_m2 = Eigen::Vector3d(100, 80, 60).asDiagonal();
  spec.maneuver.initial_mrp = std::tan(std::numbers::pi / 6) * Eigen::Vector3d(1, 2, 3) / std::sqrt(14.0);
  LinearSurface law;
  law.inertia_kg_m2 = spec.plant.inertia_kg_m2;
  spec.law = law;
  spec.sample_period_s = 0.01;
  spec.actuator = IdealTorque{Eigen::Vector3d::Constant(4)};
  spec.duration_s = 60;
  spec.telemetry_period_s = 0.01;
  return spec;
}

}  // namespace slew::test
