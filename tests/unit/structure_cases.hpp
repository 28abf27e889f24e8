// The Spacecraft Control Laboratory Experiment as the reference models it (Sung, Lee & Kim 2001; sections and
// plate chosen), and its numbers.
#pragma once

#include <cmath>
#include <numbers>

#include "server/simulation/structure.hpp"
#include "server/simulation/structure_system.hpp"

namespace slew::test {

inline constexpr double kFeet_m = 0.3048;
inline constexpr double kFootPound_N_m = 1.3558179483314004;
inline constexpr double kPoundForce_N = 4.4482216152605;
inline constexpr std::size_t kScoleTip = 7, kScoleHub = 13;  ///< of the mast; of the antenna

inline BeamSection tube(double outer_m, double wall_m, double young_Pa, double shear_Pa,
                        double density_kg_m3) {
  const double inner = outer_m - 2 * wall_m;
  const double area = std::numbers::pi / 4 * (outer_m * outer_m - inner * inner);
  const double inertia = std::numbers::pi / 64 * (std::pow(outer_m, 4) - std::pow(inner, 4));
  BeamSection section;
  section.mass_per_length_kg_m = density_kg_m3 * area;
  section.polar_inertia_per_length_kg_m = density_kg_m3 * 2 * inertia;
  section.axial_stiffness_N = young_Pa * area;
  section.bending_stiffness_y_N_m2 = section.bending_stiffness_z_N_m2 = young_Pa * inertia;
  section.torsional_stiffness_N_m2 = shear_Pa * 2 * inertia;
  return section;
}

inline SpaceFrame scole() {
  constexpr double kMast_m = 10 * kFeet_m, kTube_m = 2 * kFeet_m;
  const double height = kTube_m * std::sqrt(3.0) / 2;
  SpaceFrame frame;
  for (int i = 0; i <= 7; ++i) frame.nodes.push_back({{0, 0, kMast_m * i / 7}, {}});
  frame.nodes[0].held = {true, true, true, true, true, true};
  for (const auto& [x, y] :
       {std::pair{1.5, 1.0}, {1.0, 2.0}, {0.0, 2.0}, {-0.5, 1.0}, {1.0, 0.0}, {0.5, 1.0}})
    frame.nodes.push_back({{x * kTube_m, y * height, kMast_m}, {}});
  const BeamSection mast = tube(0.01905, 0.001524, 200e9, 77.5e9, 7850);
  const BeamSection antenna = tube(0.0254, 0.0014732, 69e9, 26e9, 2700);
  for (std::size_t i = 0; i < 7; ++i)
    frame.beams.push_back({i, i + 1, mast, Eigen::Vector3d::Zero(), {}, {}});
  const std::size_t ends[][2] = {{8, 9},  {9, 10}, {10, 11}, {11, 7},  {7, 12}, {12, 8},
                                 {13, 8}, {13, 9}, {13, 10}, {13, 11}, {13, 7}, {13, 12}};
  for (const auto& [from, to] : ends)
    frame.beams.push_back({from, to, antenna, Eigen::Vector3d::Zero(), {}, {}});
  frame.plates.push_back({0, 202.1241, {1.3716, 2.12852, 0.008819485096790267}, Eigen::Vector3d::Zero()});
  return frame;
}

inline std::vector<NodeMotion> along(std::size_t node, std::size_t first, std::size_t count) {
  std::vector<NodeMotion> motions;
  for (std::size_t i = 0; i < count; ++i) motions.push_back({node, first + i});
  return motions;
}

/// Twelve degrees of freedom: two vectors at 55 rad/s, four at 10.
inline KrylovVectors scole_vectors() {
  return {{55, 10, 10}, along(kScoleTip, 0, 2)};
}

/// The 30 deg roll, shaped for the first mode; nobody controls it.
inline StructureSpecification scole_slew() {
  StructureSpecification spec;
  spec.frame = scole();
  spec.axis = Eigen::Vector3d::UnitX();
  spec.alpha_1_s = spec.beta_s = 0.01;
  spec.plant = scole_vectors();
  spec.antenna_node = kScoleHub;
  spec.guidance = {.torque_N_m = 20 * kFootPound_N_m,
                   .pulse_rad_s = 4,
                   .angle_rad = std::numbers::pi / 6,
                   .shaper = {ShaperType::zero_vibration, {0}, {}},
                   .loads = ZeroOrderLoads::all};
  spec.actuators = {{"shuttle_force", along(0, 0, 3)},
                    {"shuttle_torque", along(0, 3, 3)},
                    {"tip_torque", along(kScoleTip, 3, 3)}};
  spec.sensors = {{along(kScoleTip, 0, 3), true, true}};
  spec.settling = {StructureQuantity::pointing, 0.02 * std::numbers::pi / 180, true};
  spec.duration_s = 12;
  spec.relative_tolerance = 1e-9;
  spec.telemetry_period_s = 0.01;
  return spec;
}

enum class ScoleCase { a, b, open, rigid, open_ideal, rigid_d };

inline StructureSpecification scole_slew(ScoleCase which) {
  StructureSpecification spec = scole_slew();
  if (which == ScoleCase::open) spec.guidance.loads = ZeroOrderLoads::about_axis_only;
  if (which == ScoleCase::open || which == ScoleCase::open_ideal) return spec;
  StructureControl& control = spec.control.emplace();
  control.design = spec.plant;
  control.tracked_modes = which == ScoleCase::a || which == ScoleCase::b ? 2 : 0;
  control.gains.knows_loads = control.filter_knows_loads =
      which == ScoleCase::a || which == ScoleCase::rigid_d;
  return spec;
}

}  // namespace slew::test
