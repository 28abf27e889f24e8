// What is wrong with a frame, by its fields.
#include <Eigen/Dense>
#include <cmath>
#include <cstdio>

#include "server/structure/space_frame.hpp"

namespace slew {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Members shorter than this are two nodes at one place.
constexpr double kShortestMember_m = 1e-9;
/// Sine of the angle between a member and its orientation below which there is no plane.
constexpr double kParallel = 1e-6;

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", value);
  return buffer;
}

std::string text(const Vector3d& v) {
  return "[" + text(v(0)) + ", " + text(v(1)) + ", " + text(v(2)) + "]";
}

class FaultList {
 public:
  void add(std::string field, std::string problem, std::string given, std::string allowed) {
    faults_.push_back({std::move(field), std::move(problem), std::move(given), std::move(allowed)});
  }
  void not_negative(const std::string& field, double value) {
    if (!(value >= 0 && std::isfinite(value)))
      add(field, "not a finite number from 0 on", text(value), "0 or more");
  }
  void positive(const std::string& field, double value) {
    if (!(value > 0 && std::isfinite(value)))
      add(field, "not a finite number above 0", text(value), "more than 0");
  }
  std::vector<FrameFault> take() { return std::move(faults_); }

 private:
  std::vector<FrameFault> faults_;
};

bool node_exists(FaultList& faults, const SpaceFrame& frame, const std::string& field, std::size_t node) {
  if (node < frame.nodes.size()) return true;
  faults.add(field, "no such node", std::to_string(node),
             frame.nodes.empty() ? "there is no node" : "0 to " + std::to_string(frame.nodes.size() - 1));
  return false;
}

/// Whether the member has two ends and a length.
bool has_ends(FaultList& faults, const SpaceFrame& frame, const std::string& member, std::size_t from,
              std::size_t to) {
  const bool has_from = node_exists(faults, frame, member + "/from_node", from);
  const bool has_to = node_exists(faults, frame, member + "/to_node", to);
  if (!has_from || !has_to) return false;
  const double length_m = (frame.nodes[to].position_m - frame.nodes[from].position_m).norm();
  if (length_m >= kShortestMember_m) return true;
  if (std::isfinite(length_m))  // else the node has been named already
    faults.add(member + "/to_node", "its two nodes are at one place", std::to_string(to),
               "a node at another place");
  return false;
}

void check_beam(FaultList& faults, const SpaceFrame& frame, const FrameBeam& beam, const std::string& name) {
  const BeamSection& section = beam.section;
  faults.not_negative(name + "/section/mass_per_length_kg_m", section.mass_per_length_kg_m);
  faults.not_negative(name + "/section/polar_inertia_per_length_kg_m", section.polar_inertia_per_length_kg_m);
  faults.positive(name + "/section/axial_stiffness_N", section.axial_stiffness_N);
  faults.not_negative(name + "/section/bending_stiffness_y_N_m2", section.bending_stiffness_y_N_m2);
  faults.not_negative(name + "/section/bending_stiffness_z_N_m2", section.bending_stiffness_z_N_m2);
  faults.not_negative(name + "/section/torsional_stiffness_N_m2", section.torsional_stiffness_N_m2);
  if (!has_ends(faults, frame, name, beam.from_node, beam.to_node)) return;

  const auto alike = [](const DofFlags& released) {
    return released[1] == released[2] && released[4] == released[5];
  };
  const bool any_will_do = section.bending_stiffness_y_N_m2 == section.bending_stiffness_z_N_m2 &&
                           alike(beam.released_at_from) && alike(beam.released_at_to);
  if (beam.orientation.isZero(0)) {
    if (!any_will_do)
      faults.add(name + "/orientation", "y and z are not alike, so they must be told apart",
                 text(beam.orientation), "a vector that is not parallel to the beam");
    return;
  }
  const Vector3d along =
      (frame.nodes[beam.to_node].position_m - frame.nodes[beam.from_node].position_m).normalized();
  if (!(along.cross(beam.orientation.normalized()).norm() > kParallel))
    faults.add(name + "/orientation", "parallel to the beam, or not finite", text(beam.orientation),
               "a vector that is not parallel to the beam");
}

void check_point_mass(FaultList& faults, const SpaceFrame& frame, const PointMass& point,
                      const std::string& name) {
  node_exists(faults, frame, name + "/node", point.node);
  faults.not_negative(name + "/mass_kg", point.mass_kg);
  const Matrix3d& inertia = point.inertia_kg_m2;
  const double scale = inertia.cwiseAbs().maxCoeff();
  const bool is_fit = inertia.allFinite() && inertia == inertia.transpose() &&
                      inertia.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff() >= -1e-12 * scale;
  if (!is_fit)
    faults.add(name + "/inertia_kg_m2", "not an inertia matrix",
               "rows " + text(inertia.row(0)) + ", " + text(inertia.row(1)) + ", " + text(inertia.row(2)),
               "symmetric and positive semidefinite");
}

void check_plate(FaultList& faults, const SpaceFrame& frame, const RigidPlate& plate,
                 const std::string& name) {
  node_exists(faults, frame, name + "/node", plate.node);
  faults.not_negative(name + "/mass_kg", plate.mass_kg);
  if (!(plate.sides_m.allFinite() && plate.sides_m.minCoeff() >= 0))
    faults.add(name + "/sides_m", "not the sides of a plate", text(plate.sides_m), "lengths from 0 on");
  if (!plate.offset_m.allFinite())
    faults.add(name + "/offset_m", "not finite", text(plate.offset_m), "finite numbers");
}

double total_mass(const SpaceFrame& frame) {
  const auto length = [&](std::size_t from, std::size_t to) {
    return (frame.nodes[to].position_m - frame.nodes[from].position_m).norm();
  };
  double mass_kg = 0;
  for (const FrameBeam& beam : frame.beams)
    mass_kg += beam.section.mass_per_length_kg_m * length(beam.from_node, beam.to_node);
  for (const FrameBar& bar : frame.bars)
    mass_kg += bar.mass_per_length_kg_m * length(bar.from_node, bar.to_node);
  for (const PointMass& point : frame.point_masses) mass_kg += point.mass_kg;
  for (const RigidPlate& plate : frame.plates) mass_kg += plate.mass_kg;
  return mass_kg;
}

}  // namespace

std::vector<FrameFault> validate(const SpaceFrame& frame) {
  FaultList faults;
  if (frame.nodes.empty()) faults.add("nodes", "a frame needs a node", "0", "1 or more");
  for (std::size_t i = 0; i < frame.nodes.size(); ++i)
    if (!frame.nodes[i].position_m.allFinite())
      faults.add("nodes/" + std::to_string(i) + "/position_m", "not finite", text(frame.nodes[i].position_m),
                 "finite numbers");
  for (std::size_t i = 0; i < frame.beams.size(); ++i)
    check_beam(faults, frame, frame.beams[i], "beams/" + std::to_string(i));
  for (std::size_t i = 0; i < frame.bars.size(); ++i) {
    const FrameBar& bar = frame.bars[i];
    const std::string name = "bars/" + std::to_string(i);
    has_ends(faults, frame, name, bar.from_node, bar.to_node);
    faults.not_negative(name + "/mass_per_length_kg_m", bar.mass_per_length_kg_m);
    faults.positive(name + "/axial_stiffness_N", bar.axial_stiffness_N);
  }
  for (std::size_t i = 0; i < frame.point_masses.size(); ++i)
    check_point_mass(faults, frame, frame.point_masses[i], "point_masses/" + std::to_string(i));
  for (std::size_t i = 0; i < frame.plates.size(); ++i)
    check_plate(faults, frame, frame.plates[i], "plates/" + std::to_string(i));
  if (frame.elements_per_member < 1 ||
      static_cast<std::size_t>(frame.elements_per_member) > kMostFrameCoordinates) {
    faults.add("elements_per_member", "out of range", std::to_string(frame.elements_per_member),
               "1 to " + std::to_string(kMostFrameCoordinates));
  } else if (coordinate_count(frame) > kMostFrameCoordinates) {
    faults.add("elements_per_member", "the frame has too many coordinates",
               std::to_string(coordinate_count(frame)), "at most " + std::to_string(kMostFrameCoordinates));
  }
  std::vector<FrameFault> found = faults.take();
  if (found.empty() && !(total_mass(frame) > 0))
    found.push_back({"point_masses", "nothing in the frame has mass", "0 kg", "more than 0 kg"});
  return found;
}

}  // namespace slew
