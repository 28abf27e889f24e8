// Frames that tests share: the arm of Agrawal & Bang 1995 as the reference models it, and one of everything.
#pragma once

#include <algorithm>
#include <array>
#include <ostream>

#include "server/structure/space_frame.hpp"

namespace slew::test {

inline constexpr DofFlags kAllHeld{true, true, true, true, true, true};
inline constexpr DofFlags kInPlane{false, false, true, true, true, false};  ///< held: what leaves x-y

/// A section with one bending stiffness, and as much of everything else as a round tube would have.
inline BeamSection round_section(double mass_per_length_kg_m, double bending_stiffness_N_m2,
                                 double axial_stiffness_N) {
  BeamSection section;
  section.mass_per_length_kg_m = mass_per_length_kg_m;
  section.polar_inertia_per_length_kg_m = 2e-4 * mass_per_length_kg_m;
  section.axial_stiffness_N = axial_stiffness_N;
  section.bending_stiffness_y_N_m2 = section.bending_stiffness_z_N_m2 = bending_stiffness_N_m2;
  section.torsional_stiffness_N_m2 = 0.8 * bending_stiffness_N_m2;
  return section;
}

/// One beam from the origin along x, in the x-y plane.
inline SpaceFrame plane_beam(double length_m, const BeamSection& section, int elements) {
  SpaceFrame frame;
  frame.nodes.resize(2);
  frame.nodes[1].position_m.x() = length_m;
  FrameBeam& beam = frame.beams.emplace_back();
  beam.to_node = 1;
  beam.section = section;
  beam.orientation = Eigen::Vector3d::UnitY();
  frame.held_everywhere = kInPlane;
  frame.elements_per_member = elements;
  return frame;
}

/// What the arm leaves open, fitted to Table 1, and what follows from it.
struct ArmFit {
  const char* name;
  double bending_stiffness_N_m2;
  std::array<double, 6> mass_kg;  ///< at the ends of the elements, from the hub outwards
  std::array<double, 6> frequency_hz;
  std::array<double, 6> coupling_sqrt_kg_m;
  double modal_inertia_kg_m2;  ///< all modes
  double inertia_kg_m2;        ///< about the hub's axis
};

inline void PrintTo(const ArmFit& fit, std::ostream* out) {
  *out << fit.name;
}

inline constexpr ArmFit kElbowHeavy{"ElbowHeavy",
                                    0.4495,
                                    {0.8077, 0.8077, 5.001, 0.1641, 0.1641, 0.5153},
                                    {0.1390, 0.4203, 2.446, 4.283, 6.904, 12.852},
                                    {2.447, 0.833, 0.358, 0.126, 0.162, 0.007},
                                    6.8519,
                                    6.8531};
inline constexpr ArmFit kTipHeavy{"TipHeavy",
                                  0.601,
                                  {1.1238, 1.1238, 0.2256, 0.2199, 0.2199, 1.9889},
                                  {0.1391, 0.4199, 2.475, 4.238, 6.852, 12.944},
                                  {1.641, 1.292, 0.401, 0.160, 0.184, 0.008},
                                  4.5828,
                                  4.5839};

inline constexpr double kArmRadius_m = 0.381, kArmLength_m = 0.61, kArmMassPerLength_kg_m = 0.1129;

/// Base beam along b1 from the hub's rim, rigid elbow, tip beam along b2; three elements to a beam.
inline SpaceFrame arm(const ArmFit& fit) {
  SpaceFrame frame;
  frame.held_everywhere = kInPlane;
  for (int i = 0; i <= 6; ++i) {
    const double along_b1 = std::min(i, 3) / 3.0, along_b2 = std::max(i - 3, 0) / 3.0;
    frame.nodes.emplace_back().position_m << kArmRadius_m + along_b1 * kArmLength_m, along_b2 * kArmLength_m,
        0;
  }
  frame.nodes.front().held = kAllHeld;
  for (std::size_t i = 0; i < 6; ++i) {
    FrameBeam& beam = frame.beams.emplace_back();
    beam.from_node = i;
    beam.to_node = i + 1;
    beam.section.mass_per_length_kg_m = kArmMassPerLength_kg_m;
    beam.section.axial_stiffness_N = 2.86e6;
    beam.section.bending_stiffness_y_N_m2 = beam.section.bending_stiffness_z_N_m2 =
        fit.bending_stiffness_N_m2;
    PointMass& point = frame.point_masses.emplace_back();
    point.node = i + 1;
    point.mass_kg = fit.mass_kg[i];
  }
  return frame;
}

/// Skew beams with two bending stiffnesses, a released end, bars, a body with products of inertia; clamped at
/// node 0, away from the origin.
inline SpaceFrame one_of_everything() {
  SpaceFrame frame;
  for (const auto& [x, y, z] : {std::array{0.3, 0.1, -0.2}, std::array{1.1, 0.4, 0.3},
                                std::array{1.5, 1.2, 0.5}, std::array{0.6, 0.9, 1.1}})
    frame.nodes.emplace_back().position_m << x, y, z;
  frame.nodes[0].held = kAllHeld;
  BeamSection section = round_section(0.4, 30, 4e5);
  section.bending_stiffness_y_N_m2 = 55;
  for (std::size_t i = 0; i < 3; ++i) {
    FrameBeam& beam = frame.beams.emplace_back();
    beam.from_node = i;
    beam.to_node = i + 1;
    beam.section = section;
    beam.orientation << 0.2, -0.3, 1;
  }
  frame.beams[1].released_at_to = {false, false, false, false, true, false};
  frame.bars.push_back({1, 3, 0.05, 2e5});
  frame.bars.push_back({0, 3, 0.05, 2e5});
  PointMass& body = frame.point_masses.emplace_back();
  body.node = 3;
  body.mass_kg = 0.7;
  body.inertia_kg_m2 << 0.02, -0.004, 0.001, -0.004, 0.03, 0.002, 0.001, 0.002, 0.025;
  frame.elements_per_member = 2;
  return frame;
}

}  // namespace slew::test
