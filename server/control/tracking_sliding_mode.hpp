// Stochastic optimal sliding mode with a tracking model (Sung, Lee & Kim 2001, Eq. 24). In the form that
// keeps the surface invariant while what is tracked moves,
//   u = -G [A z^ + nu z_e + chi z_re + L (y - C z^_f) + D - z_d'],   z_e = z^ - z_d, G B = 1.
// As printed the first term is A z_e and the filter's innovation is that of z_e: the same when nothing is
// tracked.
#pragma once

#include "server/control/optimal_surface.hpp"
#include "server/plant/structure_dynamics.hpp"

namespace slew {

enum class LawForm { consistent, as_printed };

struct TrackingGains {
  double surface_rad_s = 10;  ///< lambda of Q = diag(K + lambda^2 M, M), which no basis changes
  double reaching_1_s = 20;   ///< nu
  double rigid_1_s = 1000;    ///< chi
  LawForm form = LawForm::consistent;
  bool knows_loads = true;  ///< D: the elastic part of fa theta'' + fw theta'^2
};

/// The law with its terms sorted by what they act on, z^ = [z_r, z_f^, z_r', z_f^'], z_d = [S x_d; S x_d']:
///   u = -(estimate z^ + elastic L (y - C z^_f + C' x_d...) - tracked [x_d; x_d'; x_d''] + loads)
struct TrackingLaw {
  Eigen::MatrixXd surface;  ///< G
  Eigen::VectorXcd sliding_eigenvalues;
  Eigen::MatrixXd estimate;                           ///< on z^
  Eigen::MatrixXd elastic;                            ///< G's columns of [z_f, z_f'], on what the filter adds
  Eigen::MatrixXd tracked;                            ///< on [x_d; x_d'; x_d'']
  Eigen::MatrixXd innovation_of_tracked;              ///< C times [S_f x_d; S_f x_d'], as printed; else 0
  Eigen::VectorXd tangential_load, centrifugal_load;  ///< G D of theta'' and theta'^2

  Eigen::Index inputs() const { return surface.rows(); }
};

/// `design` carries the whole zero-order loads; `shapes` are the tracking model's S, `output` the filter's C.
/// Throws std::domain_error where the surface does not exist.
TrackingLaw tracking_law(const ReducedStructure& structure, const StructureDynamics& design,
                         const Eigen::MatrixXd& shapes, const Eigen::MatrixXd& output,
                         const TrackingGains& gains);

}  // namespace slew
