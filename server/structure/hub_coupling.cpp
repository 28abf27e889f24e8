#include "server/structure/hub_coupling.hpp"

#include <cmath>
#include <stdexcept>

namespace slew {

Eigen::Matrix<double, Eigen::Dynamic, 6> rigid_couplings(const AssembledFrame& frame,
                                                         const NormalModes& clamped) {
  // Rows of the shapes are zero where held, so M over all coordinates gives M_ff r_f + M_fc r_c.
  return clamped.shapes.transpose() * (frame.mass * frame.rigid_motion);
}

HubCoupling hub_coupling(const AssembledFrame& frame, const NormalModes& clamped,
                         const Eigen::Vector3d& axis) {
  const double length = axis.norm();
  if (!(length > 0 && std::isfinite(length))) throw std::invalid_argument("the axis has no direction");
  const Eigen::VectorXd rotation = frame.rigid_motion.rightCols<3>() * (axis / length);
  HubCoupling out;
  out.coupling_sqrt_kg_m = rigid_couplings(frame, clamped).rightCols<3>() * (axis / length);
  out.inertia_kg_m2 = rotation.dot(frame.mass * rotation);
  out.modal_inertia_kg_m2 = out.coupling_sqrt_kg_m.squaredNorm();
  out.carried_by_hub_kg_m2 = out.inertia_kg_m2 - out.modal_inertia_kg_m2;
  return out;
}

}  // namespace slew
