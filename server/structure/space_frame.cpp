#include "server/structure/space_frame.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "server/attitude/mrp.hpp"

namespace slew {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

std::size_t count(const DofFlags& flags) {
  std::size_t set = 0;
  for (const bool flag : flags) set += flag ? 1 : 0;
  return set;
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

/// Places and weights of Gauss's rule of five points on [0, 1].
constexpr std::array<std::array<double, 2>, 5> kGauss{{{0.046910077030668004, 0.11846344252809454},
                                                       {0.23076534494715845, 0.23931433524968324},
                                                       {0.5, 0.28444444444444444},
                                                       {0.7692346550528415, 0.23931433524968324},
                                                       {0.953089922969332, 0.11846344252809454}}};

/// How the point at x of a beam's length moves for each of its twelve local displacements: a linear function
/// along it, Hermite's across. Twisting moves no point of the axis.
std::vector<Vector3d> beam_functions(const Matrix3d& axes, double l, double x) {
  const Vector3d along = axes.row(0), y = axes.row(1), z = axes.row(2), none = Vector3d::Zero();
  const double from = 1 - x * x * (3 - 2 * x), turn = l * x * (1 - x) * (1 - x);
  const double to = x * x * (3 - 2 * x), turn_to = l * x * x * (x - 1);
  return {(1 - x) * along, from * y, from * z, none, -turn * z,    turn * y,
          x * along,       to * y,   to * z,   none, -turn_to * z, turn_to * y};
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
    for (const PointMass& point : frame_.point_masses)
      add_rigid_part(point.node, point.mass_kg, Vector3d::Zero(), point.inertia_kg_m2);
    for (const RigidPlate& plate : frame_.plates) {
      const Vector3d square = plate.sides_m.cwiseAbs2();
      add_rigid_part(plate.node, plate.mass_kg, plate.offset_m,
                     plate.mass_kg / 12 * (Vector3d::Constant(square.sum()) - square).asDiagonal());
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

  /// Its centre moves by u + phi x c.
  void add_rigid_part(std::size_t node, double mass_kg, const Vector3d& offset_m, const Matrix3d& inertia) {
    const auto first = static_cast<Index>(6 * node);
    const Matrix3d cross = cross_matrix<double>(offset_m);
    out_.mass.block<3, 3>(first, first) += mass_kg * Matrix3d::Identity();
    out_.mass.block<3, 3>(first, first + 3) -= mass_kg * cross;
    out_.mass.block<3, 3>(first + 3, first) += mass_kg * cross;
    out_.mass.block<3, 3>(first + 3, first + 3) += inertia - mass_kg * cross * cross;
    out_.rigid_parts.push_back({first, frame_.nodes[node].position_m + offset_m, offset_m, mass_kg, inertia});
  }

  /// A point of a member: one function of the local displacements for each, with the direction in which it
  /// moves the point.
  void add_mass_point(const Vector3d& position, double mass_kg,
                      const std::vector<std::vector<Term>>& displacements,
                      const std::vector<Vector3d>& functions) {
    if (mass_kg == 0) return;
    MassPoint& point = out_.mass_points.emplace_back(MassPoint{position, mass_kg, {}});
    for (std::size_t i = 0; i < displacements.size(); ++i)
      for (const Term& term : displacements[i]) {
        const auto known =
            std::find_if(point.motions.begin(), point.motions.end(),
                         [&](const PointMotion& motion) { return motion.coordinate == term.coordinate; });
        PointMotion& motion =
            known != point.motions.end()
                ? *known
                : point.motions.emplace_back(PointMotion{term.coordinate, Vector3d::Zero()});
        motion.displacement += term.factor * functions[i];
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
      for (const auto& [x, weight] : kGauss)
        add_mass_point(here + x * (there - here), weight * beam.section.mass_per_length_kg_m * length_m,
                       displacements, beam_functions(axes, length_m, x));
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
    const Matrix3d axes = local_axes(from, to, Vector3d::Zero());
    std::vector<Term> here = end(bar.from_node, along);
    for (int part = 1; part <= parts; ++part) {
      std::vector<Term> there = end(bar.to_node, along);
      if (part < parts)
        there = {{add_coordinate(from + (to - from) * part / parts, along, false, false,
                                 is_held_everywhere(along, false)),
                  1}};
      scatter(out_.stiffness, bar.axial_stiffness_N * parts / length_m * stretched, {here, there});
      scatter(out_.mass, bar.mass_per_length_kg_m * length_m / parts * shared, {here, there});
      for (const auto& [x, weight] : kGauss) {
        const double s = (part - 1 + x) / parts;  // along the whole bar
        const Vector3d y = axes.row(1), z = axes.row(2);
        add_mass_point(from + s * (to - from), weight * bar.mass_per_length_kg_m * length_m / parts,
                       {here, there, end(bar.from_node, y), end(bar.to_node, y), end(bar.from_node, z),
                        end(bar.to_node, z)},
                       {(1 - x) * along, x * along, (1 - s) * y, s * y, (1 - s) * z, s * z});
      }
      here = std::move(there);
    }

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
