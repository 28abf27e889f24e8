#include "server/structure/mass_properties.hpp"

#include <Eigen/Geometry>

namespace slew {

// R^T M R of the rigid motions R is [m 1, -S~; S~, I]: Hermite and linear shape functions hold every rigid
// motion, so that it is exact however coarse the mesh.
MassProperties mass_properties(const AssembledFrame& frame) {
  const Eigen::Matrix<double, 6, 6> rigid = frame.rigid_motion.transpose() * frame.mass * frame.rigid_motion;
  MassProperties out{};
  out.mass_kg = rigid(0, 0);
  out.first_moment_kg_m << rigid(5, 1), rigid(3, 2), rigid(4, 0);
  out.centre_m = out.first_moment_kg_m / out.mass_kg;
  out.inertia_about_origin_kg_m2 = rigid.bottomRightCorner<3, 3>();
  const Eigen::Vector3d& c = out.centre_m;
  out.inertia_about_centre_kg_m2 =
      out.inertia_about_origin_kg_m2 -
      out.mass_kg * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
  return out;
}

}  // namespace slew
