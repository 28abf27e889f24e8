// Maneuvers of the sources as problems for the planner.
#pragma once

#include "server/guidance/maneuver_problem.hpp"
#include "server/plant/astrex.hpp"

namespace slew::test {

inline constexpr double kRadian = std::numbers::pi / 180;

inline Vector4<double> euler_deg(double yaw, double pitch, double roll) {
  return euler_parameters_of_angles(kRadian * Eigen::Vector3d(yaw, pitch, roll));
}

/// Kim & Crassidis 1998, Table 1; Bilimoria & Wie 1993: unit inertia, |u_i| <= 1, rest to rest about axis 3.
inline ManeuverProblem sphere(double angle_deg) {
  ManeuverProblem problem;
  problem.final.attitude = euler_parameters_about(Eigen::Vector3d::UnitZ(), kRadian * angle_deg);
  return problem;
}

/// 150 deg about axis 1, 50 N m about each axis.
inline ManeuverProblem reorientation() {
  ManeuverProblem problem;
  problem.plant.inertia_kg_m2 = Eigen::Vector3d(5621, 4547, 2364).asDiagonal();
  problem.plant.influence_N_m *= 50;
  problem.final.attitude = euler_parameters_about(Eigen::Vector3d::UnitX(), kRadian * 150);
  return problem;
}

/// A body whose second control has a singular arc, for more than a third of the time.
inline ManeuverProblem with_singular_arc() {
  ManeuverProblem problem;
  problem.plant.inertia_kg_m2 << 1.9, 0.2, 0, 0.2, 2.4, 0.3, 0, 0.3, 1.8;
  problem.plant.influence_N_m.diagonal() << 1.7, 4.9, 1.1;
  const Eigen::Vector3d axis(0.1, -0.8, 0.6);
  problem.final.attitude = euler_parameters_about(axis.normalized(), kRadian * 109);
  return problem;
}

/// Vadali, Singh & Carter 1993, the floating article.
inline ManeuverProblem floating(AstrexThrusters thrusters) {
  ManeuverProblem problem;
  problem.plant = astrex_floating(thrusters);
  problem.initial.attitude = euler_deg(0, -30, 0);
  problem.final.attitude = euler_deg(150, -10, 5);
  return problem;
}

/// The same, on its pedestal.
inline ManeuverProblem on_pedestal(AstrexThrusters thrusters) {
  ManeuverProblem problem;
  problem.plant = astrex_on_pedestal(thrusters);
  problem.initial.attitude = euler_deg(0, -30, 0);
  problem.final.attitude = euler_deg(150, -30, 5);
  return problem;
}

inline ManeuverProblem with_air(ManeuverProblem problem) {
  problem.most_consumption = kAstrexAir_ft3;
  return problem;
}

inline ManeuverProblem smooth(ManeuverProblem problem, std::vector<int> switches) {
  problem.family = ProfileFamily::smooth_switches;
  problem.switches = std::move(switches);
  return problem;
}

}  // namespace slew::test
