// How the clamped modes of an elastic appendage pull at the hub (Agrawal & Bang 1995, Eq. 22 with the
// superscripts put right: D_i = int (x1 phi_i^2 - x2 phi_i^1) dm).
//
// The appendage moves by u = r theta + sum phi_i q_i, r being the rigid rotation of *all* its coordinates,
// the clamped root's included, and phi_i being zero there. Then
//   I theta'' + sum D_i q_i'' = torque,   q_i'' + w_i^2 q_i + D_i theta'' = 0,
//   D_i = phi_i^T M r = phi_f^T (M_ff r_f + M_fc r_c)    (f: moves, c: held to the hub),
// and M_fc r_c must not be left out: it is the part of the inertia forces on the first elements that the
// root's motion causes, and only with it do the hub-free frequencies come out exactly.
#pragma once

#include "server/structure/normal_modes.hpp"

namespace slew {

/// phi_i^T M R for unit accelerations of the hub along and about its axes, one row for each mode.
Eigen::Matrix<double, Eigen::Dynamic, 6> rigid_couplings(const AssembledFrame& frame,
                                                         const NormalModes& clamped);

struct HubCoupling {
  Eigen::VectorXd coupling_sqrt_kg_m;  ///< D_i, kg^1/2 m; the sign goes with the shape's
  /// r^T M r: of the whole appendage about the axis, undeformed. I of Eq. 21 is the hub's and this one.
  double inertia_kg_m2;
  double modal_inertia_kg_m2;  ///< sum of D_i^2 over the modes given
  /// inertia less modal inertia. With all modes given it is what turns with the hub in no mode:
  /// r_c^T (M_cc - M_cf M_ff^-1 M_fc) r_c, the root's share of the first elements' mass.
  double carried_by_hub_kg_m2;
};

/// About an axis through the origin; `axis` need not be of unit length. Throws std::invalid_argument when it
/// has none.
HubCoupling hub_coupling(const AssembledFrame& frame, const NormalModes& clamped,
                         const Eigen::Vector3d& axis);

}  // namespace slew
