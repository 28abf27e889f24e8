// A flexible structure that slews about a fixed axis through the origin of its hub, to first order in what
// departs from that rotation (Meirovitch & Quinn 1987; Sung, Lee & Kim 2001, Eq. 4):
//
//   M x'' + theta' G1 x' + (K + theta'' Ka + theta'^2 Kw) x = loads - (fa theta'' + fw theta'^2)
//
// x = [R1, beta, q]: displacement and rotation of the hub, then the frame's own coordinates relative to it,
// all along the hub's axes. Left out, as small of the same order: what tension and zero-order moments add to
// the stiffness, and the members' polar inertia in G1, Ka and Kw.
#pragma once

#include "server/structure/space_frame.hpp"

namespace slew {

struct SlewingStructure {
  Eigen::Vector3d axis;                                 ///< e1, of unit length
  Eigen::MatrixXd mass;                                 ///< M
  Eigen::MatrixXd stiffness;                            ///< K, which knows no hub motion
  Eigen::MatrixXd gyroscopic, tangential, centrifugal;  ///< G1, Ka, Kw
  /// fa and fw: what holds every coordinate on a rigid slew. Their first six rows are the forces and moments
  /// on the hub that make the slew (Sung, Lee & Kim 2001, Eqs. 18 to 20), the others bend the structure.
  Eigen::VectorXd tangential_load, centrifugal_load;
  Eigen::Matrix<double, Eigen::Dynamic, 6> rigid_motion;  ///< of the frame's coordinates, as in the frame
  std::vector<Eigen::Index> elastic;  ///< the frame's coordinates that are x's from the seventh on

  Eigen::Index size() const { return mass.rows(); }
  /// How the frame's coordinate moves for each of x's: the generalized load of a unit load on it, and the row
  /// by which a sensor that stands still would see it.
  Eigen::VectorXd absolute(Eigen::Index coordinate) const;
  /// The same as seen from the hub; zero where it is held.
  Eigen::VectorXd relative(Eigen::Index coordinate) const;
};

/// `axis` need not be of unit length. Throws std::invalid_argument when it has none.
SlewingStructure slewing_structure(const AssembledFrame& frame, const Eigen::Vector3d& axis);

/// Forces and moments on the hub that slew the undeformed structure: the first six rows of
/// fa theta'' + fw theta'^2.
Eigen::Matrix<double, 6, 1> zero_order_loads(const SlewingStructure& structure, double acceleration_rad_s2,
                                             double rate_rad_s);

}  // namespace slew
