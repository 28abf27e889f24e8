#include "server/experiment/frame_request.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

namespace slew {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using nlohmann::json;

Vector3d vector(const json& numbers) {
  return {numbers.at(0).get<double>(), numbers.at(1).get<double>(), numbers.at(2).get<double>()};
}

DofFlags motions(const json& names) {
  static constexpr std::array<const char*, 6> kNames{"ux", "uy", "uz", "rx", "ry", "rz"};
  DofFlags flags{};
  for (const json& name : names)
    for (std::size_t i = 0; i < flags.size(); ++i) flags[i] = flags[i] || name == kNames[i] || name == "all";
  return flags;
}

std::size_t normal_of(const std::string& plane) {
  return plane == "yz" ? 0 : plane == "zx" ? 1 : 2;
}

/// Displacement along the plane's normal and rotation about any other axis.
DofFlags held_outside(const std::string& plane) {
  DofFlags held{};
  for (std::size_t i = 0; i < 3; ++i) {
    held[i] = i == normal_of(plane);
    held[3 + i] = i != normal_of(plane);
  }
  return held;
}

BeamSection specify_section(const json& section) {
  const double either = section.value("bending_stiffness_N_m2", 0.0);
  return {.mass_per_length_kg_m = section.at("mass_per_length_kg_m"),
          .polar_inertia_per_length_kg_m = section.at("polar_inertia_per_length_kg_m"),
          .axial_stiffness_N = section.at("axial_stiffness_N"),
          .bending_stiffness_y_N_m2 = section.value("bending_stiffness_y_N_m2", either),
          .bending_stiffness_z_N_m2 = section.value("bending_stiffness_z_N_m2", either),
          .torsional_stiffness_N_m2 = section.at("torsional_stiffness_N_m2")};
}

FrameBeam specify_beam(const json& beam, const json& sections) {
  FrameBeam spec;
  spec.from_node = beam.at("from_node");
  spec.to_node = beam.at("to_node");
  // Where there is no such section the beam is still to be judged by its ends.
  const auto section = sections.find(beam.at("section").get_ref<const std::string&>());
  spec.section = section != sections.end() ? specify_section(*section) : BeamSection{1, 0, 1, 1, 1, 0};
  if (const auto orientation = beam.find("orientation"); orientation != beam.end())
    spec.orientation = vector(*orientation).stableNormalized();
  spec.released_at_from = motions(beam.at("released_at_from"));
  spec.released_at_to = motions(beam.at("released_at_to"));
  return spec;
}

/// In a plane frame local z is the plane's normal, unless the beam says otherwise.
void orient_in_plane(SpaceFrame& frame, const Vector3d& normal) {
  for (FrameBeam& beam : frame.beams)
    if (beam.orientation.isZero(0) && std::max(beam.from_node, beam.to_node) < frame.nodes.size())
      beam.orientation =
          normal.cross(frame.nodes[beam.to_node].position_m - frame.nodes[beam.from_node].position_m)
              .stableNormalized();
}

PointMass specify_point_mass(const json& point) {
  PointMass spec;
  spec.node = point.at("node");
  spec.mass_kg = point.at("mass_kg");
  const json& inertia = point.at("inertia_kg_m2");
  if (inertia.is_number())
    spec.inertia_kg_m2.diagonal().setConstant(inertia.get<double>());
  else
    for (std::size_t row = 0; row < 3; ++row)
      spec.inertia_kg_m2.row(static_cast<Index>(row)) = vector(inertia.at(row));
  return spec;
}

}  // namespace

bool is_frame(const json& plant) {
  return plant.is_object() && plant.value("type", json()) == "flexible_axis_frame";
}

SpaceFrame specify_frame(const json& plant) {
  SpaceFrame frame;
  frame.elements_per_member = plant.at("elements_per_member");
  for (const json& node : plant.at("nodes"))
    frame.nodes.push_back({vector(node.at("position_m")), motions(node.at("held"))});
  for (const json& beam : plant.at("beams")) frame.beams.push_back(specify_beam(beam, plant.at("sections")));
  for (const json& bar : plant.at("bars"))
    frame.bars.push_back({bar.at("from_node"), bar.at("to_node"), bar.at("mass_per_length_kg_m"),
                          bar.at("axial_stiffness_N")});
  for (const json& point : plant.at("point_masses")) frame.point_masses.push_back(specify_point_mass(point));
  if (const auto plates = plant.find("plates"); plates != plant.end())
    for (const json& plate : *plates)
      frame.plates.push_back(
          {plate.at("node"), plate.at("mass_kg"), vector(plate.at("sides_m")), vector(plate.at("offset_m"))});
  if (const auto plane = plant.find("plane"); plane != plant.end()) {
    frame.held_everywhere = held_outside(*plane);
    orient_in_plane(frame, Vector3d::Unit(static_cast<Index>(normal_of(*plane))));
  }
  return frame;
}

Vector3d hub_axis(const json& plant) {
  if (const auto axis = plant.find("axis"); axis != plant.end()) return vector(*axis).stableNormalized();
  return Vector3d::Unit(static_cast<Index>(normal_of(plant.value("plane", ""))));
}

DerivedFrame derive_frame(const json& plant) {
  DerivedFrame out{assemble(specify_frame(plant)), {}, {}, 0, 0};
  out.clamped = normal_modes(out.assembled, FrameBoundary::kClamped);
  out.coupling = hub_coupling(out.assembled, out.clamped, hub_axis(plant));
  if (const auto whole = plant.find("inertia_kg_m2"); whole != plant.end()) {
    out.inertia_kg_m2 = *whole;
    out.hub_inertia_kg_m2 = out.inertia_kg_m2 - out.coupling.inertia_kg_m2;
  } else {
    out.hub_inertia_kg_m2 = plant.at("hub_inertia_kg_m2");
    out.inertia_kg_m2 = out.hub_inertia_kg_m2 + out.coupling.inertia_kg_m2;
  }
  return out;
}

SingleAxisPlant keep_modes(const json& plant, const DerivedFrame& frame) {
  constexpr double kRadPerCycle = 2 * std::numbers::pi;
  SingleAxisPlant spec{frame.inertia_kg_m2, {}};
  // By way of Hz, so that these modes given as a flexible_axis fly the same bits.
  for (Index i = 0; i < plant.at("modes_kept").get<Index>(); ++i)
    spec.modes.push_back({.frequency_rad_s = kRadPerCycle * (frame.clamped.frequency_rad_s(i) / kRadPerCycle),
                          .damping = plant.at("damping_ratio"),
                          .coupling_sqrt_kg_m = std::abs(frame.coupling.coupling_sqrt_kg_m(i))});
  return spec;
}

SingleAxisPlant specify_frame_plant(const json& plant) {
  return keep_modes(plant, derive_frame(plant));
}

}  // namespace slew
