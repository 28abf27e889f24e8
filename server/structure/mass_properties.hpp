// Mass, centre and inertia of a space frame that does not deform.
#pragma once

#include "server/structure/space_frame.hpp"

namespace slew {

struct MassProperties {
  double mass_kg;
  Eigen::Vector3d first_moment_kg_m;           ///< of mass about the origin
  Eigen::Vector3d centre_m;                    ///< of mass
  Eigen::Matrix3d inertia_about_origin_kg_m2;  ///< matrix: products of inertia with their minus
  Eigen::Matrix3d inertia_about_centre_kg_m2;
};

/// Of everything in the frame, the ends that are held included.
MassProperties mass_properties(const AssembledFrame& frame);

}  // namespace slew
