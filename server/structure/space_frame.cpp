#include "server/structure/space_frame.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace slew {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

// ---- what may be assembled

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

std::size_t count(const DofFlags& flags) {
  std::size_t set = 0;
  for (const bool flag : flags) set += flag ? 1 : 0;
  return set;
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
  return mass_kg;
}

// ---- elements, in local axes

/// Rows and columns of `small` go to `at`; `sign` turns those of the rotations, which bending in the x-z
/// plane counts the other way (ry = -dw/dx).
void add_bending(Matrix12d& whole, const Eigen::Matrix4d& small, const std::array<Index, 4>& at,
                 double sign) {
  const std::array<double, 4> turn{1, sign, 1, sign};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      whole(at[i], at[j]) += turn[i] * turn[j] * small(static_cast<Index>(i), static_cast<Index>(j));
}

void add_pair(Matrix12d& whole, Index first, double own, double other) {
  whole(first, first) += own;
  whole(first + 6, first + 6) += own;
  whole(first, first + 6) += other;
  whole(first + 6, first) += other;
}

constexpr std::array<Index, 4> kBendingAlongY{1, 5, 7, 11}, kBendingAlongZ{2, 4, 8, 10};

Matrix12d beam_stiffness(const BeamSection& section, double l) {
  Matrix12d k = Matrix12d::Zero();
  add_pair(k, 0, section.axial_stiffness_N / l, -section.axial_stiffness_N / l);
  add_pair(k, 3, section.torsional_stiffness_N_m2 / l, -section.torsional_stiffness_N_m2 / l);
  Eigen::Matrix4d bending;
  bending << 12, 6 * l, -12, 6 * l,         //
      6 * l, 4 * l * l, -6 * l, 2 * l * l,  //
      -12, -6 * l, 12, -6 * l,              //
      6 * l, 2 * l * l, -6 * l, 4 * l * l;
  bending /= l * l * l;
  add_bending(k, section.bending_stiffness_z_N_m2 * bending, kBendingAlongY, 1);
  add_bending(k, section.bending_stiffness_y_N_m2 * bending, kBendingAlongZ, -1);
  return k;
}

Matrix12d beam_mass(const BeamSection& section, double l) {
  Matrix12d m = Matrix12d::Zero();
  const double mass = section.mass_per_length_kg_m * l;
  const double polar = section.polar_inertia_per_length_kg_m * l;
  add_pair(m, 0, mass / 3, mass / 6);
  add_pair(m, 3, polar / 3, polar / 6);
  Eigen::Matrix4d bending;
  bending << 156, 22 * l, 54, -13 * l,        //
      22 * l, 4 * l * l, 13 * l, -3 * l * l,  //
      54, 13 * l, 156, -22 * l,               //
      -13 * l, -3 * l * l, -22 * l, 4 * l * l;
  bending *= mass / 420;
  add_bending(m, bending, kBendingAlongY, 1);
  add_bending(m, bending, kBendingAlongZ, -1);
  return m;
}

/// Rows are the local axes.
Matrix3d local_axes(const Vector3d& from, const Vector3d& to, const Vector3d& orientation) {
  const Vector3d x = (to - from).normalized();
  Vector3d in_plane = orientation;
  if (in_plane.isZero(0)) {  // y and z are alike: whichever axis is farthest from the beam
    Index farthest = 0;
    x.cwiseAbs().minCoeff(&farthest);
    in_plane = Vector3d::Unit(farthest);
  }
  const Vector3d z = x.cross(in_plane).normalized();
  Matrix3d axes;
  axes << x.transpose(), z.cross(x).transpose(), z.transpose();
  return axes;
}

// ---- putting them together

/// One displacement as a sum of coordinates.
struct Term {
  Index coordinate;
  double factor;
};

class Assembly {
 public:
  explicit Assembly(const SpaceFrame& frame) : frame_(frame) {
    const auto n = static_cast<Index>(coordinate_count(frame));
    out_.mass = MatrixXd::Zero(n, n);
    out_.stiffness = MatrixXd::Zero(n, n);
    out_.rigid_motion.setZero(n, 6);
    out_.held_by_node.reserve(static_cast<std::size_t>(n));
    out_.held_everywhere.reserve(static_cast<std::size_t>(n));
  }

  AssembledFrame build() {
    for (const FrameNode& node : frame_.nodes) add_node(node.position_m, node.held);
    for (const FrameBeam& beam : frame_.beams) add_beam(beam);
    for (const FrameBar& bar : frame_.bars) add_bar(bar);
    for (const PointMass& point : frame_.point_masses) {
      const auto first = static_cast<Index>(6 * point.node);
      out_.mass.block<3, 3>(first, first) += point.mass_kg * Matrix3d::Identity();
      out_.mass.block<3, 3>(first + 3, first + 3) += point.inertia_kg_m2;
    }
    return std::move(out_);
  }

 private:
  /// A coordinate along, or about, a direction at a place.
  Index add_coordinate(const Vector3d& position, const Vector3d& direction, bool is_rotation, bool by_node,
                       bool everywhere) {
    const Index added = next_++;
    if (is_rotation)
      out_.rigid_motion.row(added).tail<3>() = direction;
    else
      out_.rigid_motion.row(added) << direction.transpose(), position.cross(direction).transpose();
    out_.held_by_node.push_back(by_node);
    out_.held_everywhere.push_back(everywhere);
    return added;
  }

  /// The first of six.
  Index add_node(const Vector3d& position, const DofFlags& held) {
    const Index first = next_;
    for (std::size_t dof = 0; dof < 6; ++dof)
      add_coordinate(position, Vector3d::Unit(static_cast<Index>(dof % 3)), dof >= 3, held[dof],
                     frame_.held_everywhere[dof]);
    return first;
  }

  /// A released motion is held when all of it lies where nothing may move, such as out of a plane frame's
  /// plane.
  bool is_held_everywhere(const Vector3d& direction, bool is_rotation) const {
    constexpr double kRounding = 1e-12;
    for (std::size_t i = 0; i < 3; ++i)
      if (!frame_.held_everywhere[i + (is_rotation ? 3 : 0)] &&
          std::abs(direction(static_cast<Index>(i))) > kRounding)
        return false;
    return true;
  }

  /// The six local displacements of a beam's end: the node's, but for a released one, which is a coordinate
  /// of its own. So the consistent mass stays exact, which condensing the element would spoil.
  void push_end(std::vector<std::vector<Term>>& displacements, const Vector3d& position, const Matrix3d& axes,
                Index node, const DofFlags& released) {
    for (std::size_t dof = 0; dof < 6; ++dof) {
      const bool is_rotation = dof >= 3;
      const Vector3d direction = axes.row(static_cast<Index>(dof % 3));
      std::vector<Term>& terms = displacements.emplace_back();
      if (released[dof]) {
        terms.push_back({add_coordinate(position, direction, is_rotation, false,
                                        is_held_everywhere(direction, is_rotation)),
                         1});
        continue;
      }
      for (Index i = 0; i < 3; ++i) terms.push_back({node + i + (is_rotation ? 3 : 0), direction(i)});
    }
  }

  static void scatter(MatrixXd& whole, const Eigen::Ref<const MatrixXd>& element,
                      const std::vector<std::vector<Term>>& displacements) {
    for (std::size_t i = 0; i < displacements.size(); ++i)
      for (std::size_t j = 0; j < displacements.size(); ++j)
        for (const Term& a : displacements[i])
          for (const Term& b : displacements[j])
            whole(a.coordinate, b.coordinate) +=
                a.factor * b.factor * element(static_cast<Index>(i), static_cast<Index>(j));
  }

  void add_beam(const FrameBeam& beam) {
    const Vector3d from = frame_.nodes[beam.from_node].position_m;
    const Vector3d to = frame_.nodes[beam.to_node].position_m;
    const Matrix3d axes = local_axes(from, to, beam.orientation);
    const int parts = frame_.elements_per_member;
    const double length_m = (to - from).norm() / parts;
    const Matrix12d stiffness = beam_stiffness(beam.section, length_m);
    const Matrix12d mass = beam_mass(beam.section, length_m);
    Vector3d here = from;
    auto here_first = static_cast<Index>(6 * beam.from_node);
    for (int part = 1; part <= parts; ++part) {
      const bool is_last = part == parts;
      const Vector3d there = is_last ? to : Vector3d(from + (to - from) * part / parts);
      const Index there_first = is_last ? static_cast<Index>(6 * beam.to_node) : add_node(there, {});
      std::vector<std::vector<Term>> displacements;
      push_end(displacements, here, axes, here_first, part == 1 ? beam.released_at_from : DofFlags{});
      push_end(displacements, there, axes, there_first, is_last ? beam.released_at_to : DofFlags{});
      scatter(out_.stiffness, stiffness, displacements);
      scatter(out_.mass, mass, displacements);
      here = there;
      here_first = there_first;
    }
  }

  /// Along the bar a chain of elements; across it the bar moves as a straight line between its ends, so that
  /// refinement makes no mechanism of it.
  void add_bar(const FrameBar& bar) {
    const Vector3d from = frame_.nodes[bar.from_node].position_m;
    const Vector3d to = frame_.nodes[bar.to_node].position_m;
    const Vector3d along = (to - from).normalized();
    const int parts = frame_.elements_per_member;
    const double length_m = (to - from).norm();
    const auto end = [&](std::size_t node, const Vector3d& direction) {
      const auto first = static_cast<Index>(6 * node);
      return std::vector<Term>{{first, direction(0)}, {first + 1, direction(1)}, {first + 2, direction(2)}};
    };

    const Eigen::Matrix2d shared = (Eigen::Matrix2d() << 2, 1, 1, 2).finished() / 6;
    const Eigen::Matrix2d stretched = (Eigen::Matrix2d() << 1, -1, -1, 1).finished();
    std::vector<Term> here = end(bar.from_node, along);
    for (int part = 1; part <= parts; ++part) {
      std::vector<Term> there = end(bar.to_node, along);
      if (part < parts)
        there = {{add_coordinate(from + (to - from) * part / parts, along, false, false,
                                 is_held_everywhere(along, false)),
                  1}};
      scatter(out_.stiffness, bar.axial_stiffness_N * parts / length_m * stretched, {here, there});
      scatter(out_.mass, bar.mass_per_length_kg_m * length_m / parts * shared, {here, there});
      here = std::move(there);
    }

    const Matrix3d axes = local_axes(from, to, Vector3d::Zero());
    for (Index across = 1; across < 3; ++across)
      scatter(out_.mass, bar.mass_per_length_kg_m * length_m * shared,
              {end(bar.from_node, axes.row(across)), end(bar.to_node, axes.row(across))});
  }

  const SpaceFrame& frame_;
  AssembledFrame out_;
  Index next_ = 0;
};

}  // namespace

std::size_t coordinate_count(const SpaceFrame& frame) {
  const auto inside = static_cast<std::size_t>(frame.elements_per_member - 1);
  std::size_t coordinates =
      6 * (frame.nodes.size() + frame.beams.size() * inside) + frame.bars.size() * inside;
  for (const FrameBeam& beam : frame.beams)
    coordinates += count(beam.released_at_from) + count(beam.released_at_to);
  return coordinates;
}

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

std::vector<Index> AssembledFrame::moving(FrameBoundary boundary) const {
  std::vector<Index> out;
  for (std::size_t i = 0; i < held_everywhere.size(); ++i)
    if (!held_everywhere[i] && !(boundary == FrameBoundary::kClamped && held_by_node[i]))
      out.push_back(static_cast<Index>(i));
  return out;
}

AssembledFrame assemble(const SpaceFrame& frame) {
  if (const std::vector<FrameFault> faults = validate(frame); !faults.empty()) {
    const FrameFault& first = faults.front();
    throw std::invalid_argument(first.field + ": " + first.problem + " (" + first.given + "; " +
                                first.allowed + ")");
  }
  return Assembly(frame).build();
}

}  // namespace slew
