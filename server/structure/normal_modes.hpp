// Undamped normal modes of a space frame, clamped to the hub or free: K phi = w^2 M phi.
//
// Coordinates without mass (a rotation at a point mass, torsion without polar inertia) need no condensing
// beforehand: the modes are those of the statically condensed frame, and the shapes hold the rest of the
// coordinates where statics puts them.
#pragma once

#include "server/structure/space_frame.hpp"

namespace slew {

struct NormalModes {
  Eigen::VectorXd frequency_rad_s;  ///< ascending; exactly 0 for a motion that strains nothing
  /// One column for each mode, one row for each of the frame's coordinates (0 where it is held);
  /// phi_i^T M phi_k is 1 for i = k and else 0. The entry farthest from 0 is positive.
  Eigen::MatrixXd shapes;

  Eigen::Index size() const { return frequency_rad_s.size(); }
};

/// All modes of finite frequency: as many as the moving coordinates' mass has rank. Throws std::domain_error
/// when the frame can move in a way that has neither stiffness nor mass.
NormalModes normal_modes(const AssembledFrame& frame, FrameBoundary boundary);

}  // namespace slew
