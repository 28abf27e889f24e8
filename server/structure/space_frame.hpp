// A space frame of Euler-Bernoulli beams, bars, point masses and rigid plates: consistent mass and stiffness
// in three dimensions (Przemieniecki 1968, chs. 5 and 11; no shear deformation, no rotary inertia of a
// section in bending). It is what an elastic appendage's modes and its couplings to the hub come from.
//
// Frame of reference: the hub's, origin on its axis of rotation. A degree of freedom that is held is held to
// the hub and moves rigidly with it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace slew {

/// One flag each for ux, uy, uz, rx, ry, rz.
using DofFlags = std::array<bool, 6>;

struct FrameNode {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  DofFlags held{};  ///< along the hub's axes
};

/// What a beam has at every cross-section. Local x runs along the beam, y and z are principal axes.
struct BeamSection {
  double mass_per_length_kg_m = 0;           ///< rho A
  double polar_inertia_per_length_kg_m = 0;  ///< rho J, kg m^2 per m; without it torsion has no mass
  double axial_stiffness_N = 0;              ///< E A
  double bending_stiffness_y_N_m2 = 0;       ///< E I about local y: deflection along z
  double bending_stiffness_z_N_m2 = 0;       ///< E I about local z: deflection along y
  double torsional_stiffness_N_m2 = 0;       ///< G J
};

struct FrameBeam {
  std::size_t from_node = 0, to_node = 0;
  BeamSection section;
  /// A vector in the local x-y plane, on the side of +y. Zero: any, where y and z are alike.
  Eigen::Vector3d orientation = Eigen::Vector3d::Zero();
  /// Local motions of the beam's end that the node does not share: a pin about z is {0, 0, 0, 0, 0, 1}.
  DofFlags released_at_from{}, released_at_to{};
};

/// A straight rod, pinned at both ends, that stays straight: tension and compression only.
struct FrameBar {
  std::size_t from_node = 0, to_node = 0;
  double mass_per_length_kg_m = 0;
  double axial_stiffness_N = 0;
};

/// A rigid body whose mass centre is at the node.
struct PointMass {
  std::size_t node = 0;
  double mass_kg = 0;
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Zero();  ///< about the node, along the hub's axes
};

/// A homogeneous rigid cuboid that moves with a node, its edges along the hub's axes.
struct RigidPlate {
  std::size_t node = 0;
  double mass_kg = 0;
  Eigen::Vector3d sides_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  ///< of its centre from the node
};

struct SpaceFrame {
  std::vector<FrameNode> nodes;
  std::vector<FrameBeam> beams;
  std::vector<FrameBar> bars;
  std::vector<PointMass> point_masses;
  std::vector<RigidPlate> plates;
  /// Held at every node, those inside members included: {0, 0, 1, 1, 1, 0} leaves the x-y plane.
  DofFlags held_everywhere{};
  int elements_per_member = 1;
};

/// One thing that is wrong with a frame: where ("beams/2/to_node"), what, what stood there, what may.
struct FrameFault {
  std::string field;
  std::string problem;
  std::string given;
  std::string allowed;
};

/// The modes cost the cube of it.
inline constexpr std::size_t kMostFrameCoordinates = 1200;

/// Six for each node, those inside members included, and one for each released motion, held or not. Looks at
/// counts only: the frame need not be valid, but for `elements_per_member`, which must be positive.
std::size_t coordinate_count(const SpaceFrame& frame);

/// Everything that is wrong; empty when it can be assembled.
std::vector<FrameFault> validate(const SpaceFrame& frame);

/// Which of the frame's coordinates move.
enum class FrameBoundary {
  kClamped,  ///< what the nodes hold is held
  kFree,     ///< only what is held everywhere is: a plane frame stays in its plane
};

/// How far a point moves for a unit of one coordinate.
struct PointMotion {
  Eigen::Index coordinate;
  Eigen::Vector3d displacement;
};

/// A point of a member and its share of the mass by Gauss's rule: sums over all of them are the integrals
/// over the members, exact up to the ninth degree along an element.
struct MassPoint {
  Eigen::Vector3d position_m;
  double mass_kg;
  std::vector<PointMotion> motions;
};

/// What is rigid at a node: a point mass, or a plate whose centre may stand off.
struct RigidPart {
  Eigen::Index first_coordinate;  ///< of the node's six
  Eigen::Vector3d centre_m;
  Eigen::Vector3d offset_m;  ///< of the centre from the node
  double mass_kg;
  Eigen::Matrix3d inertia_kg_m2;  ///< about the centre
};

/// Matrices over all coordinates, held ones included: first six for each node in its order, then those of the
/// nodes inside members and of released ends.
struct AssembledFrame {
  Eigen::MatrixXd mass;       ///< positive semidefinite
  Eigen::MatrixXd stiffness;  ///< positive semidefinite
  /// Displacement of every coordinate for unit translations along, and unit rotations about, the hub's axes.
  Eigen::Matrix<double, Eigen::Dynamic, 6> rigid_motion;
  std::vector<bool> held_by_node, held_everywhere;
  /// Where the mass is, for what needs more of it than `mass`; without the members' own polar inertia.
  std::vector<MassPoint> mass_points;
  std::vector<RigidPart> rigid_parts;

  /// The coordinates that move, ascending.
  std::vector<Eigen::Index> moving(FrameBoundary boundary) const;
};

/// Throws std::invalid_argument with the first fault.
AssembledFrame assemble(const SpaceFrame& frame);

}  // namespace slew
