// Fewer coordinates for a structure that slews: x = Q z, Q = blkdiag(1, Qe). The six of the hub stay as they
// are; the columns of Qe, orthonormal in the elastic block of M, say how the structure may deform.
//
// Whatever Qe is made of, the result has one form: frequency-dependent Krylov vectors (Sung & Park 1999, as
// read from Sung, Lee & Kim 2001, section 4), modes with the hub clamped, modes with it free.
#pragma once

#include "server/structure/normal_modes.hpp"
#include "server/structure/slewing_structure.hpp"

namespace slew {

struct ReducedStructure {
  Eigen::Vector3d axis;
  Eigen::MatrixXd basis;  ///< Q: x = Q z
  Eigen::MatrixXd mass, stiffness, gyroscopic, tangential, centrifugal;
  Eigen::VectorXd tangential_load, centrifugal_load;

  Eigen::Index size() const { return mass.rows(); }
  Eigen::Index elastic() const { return mass.rows() - 6; }
};

/// Every mode with the hub clamped: the whole structure in other coordinates, whose stiffness is diagonal.
/// Throws std::domain_error when the structure can move on the hub without being strained.
Eigen::MatrixXd clamped_basis(const AssembledFrame& frame, const SlewingStructure& structure);

/// The first columns of it, `count` of them. Throws std::invalid_argument when there are not so many.
Eigen::MatrixXd clamped_basis(const AssembledFrame& frame, const SlewingStructure& structure,
                              Eigen::Index count);

/// The elastic part of the first `count` modes with the hub free.
Eigen::MatrixXd free_basis(const AssembledFrame& frame, const SlewingStructure& structure,
                           Eigen::Index count);

/// Krylov vectors for `loads` (one column each, over x): (K - s1^2 M)^-1 P, then (K - s2^2 M)^-1 M times the
/// vectors before, as many blocks as there are shifts. The reduced structure answers these loads as the whole
/// one does at every shift, and so do as many derivatives as the shift is repeated. Throws std::domain_error
/// with a sentence for a shift on a natural frequency and for vectors that depend on each other.
Eigen::MatrixXd krylov_basis(const SlewingStructure& structure, const Eigen::MatrixXd& loads,
                             const std::vector<double>& shifts_rad_s);

ReducedStructure reduce(const SlewingStructure& structure, const Eigen::MatrixXd& elastic_basis);

/// The six motions of the whole, which strain nothing, left out: frequencies ascending; z_f = shapes x_d
/// uncouples the elastic rows of M^-1 K, and z_r = rigid x_d goes with it where momentum is zero.
struct FreeModes {
  Eigen::VectorXd frequency_rad_s;
  Eigen::MatrixXd shapes;  ///< T of Sung, Lee & Kim 2001, Eq. 16
  Eigen::MatrixXd rigid;   ///< -M_rr^-1 M_rf T, 6 rows
};
FreeModes free_modes(const ReducedStructure& structure);

/// zeta of C = alpha M + beta K at a frequency.
inline double damping_ratio(double alpha_1_s, double beta_s, double frequency_rad_s) {
  return 0.5 * (alpha_1_s / frequency_rad_s + beta_s * frequency_rad_s);
}

/// Displacements for unit loads of e^(i w t): outputs^T (K - w^2 M + i w (alpha M + beta K))^-1 inputs.
Eigen::MatrixXcd receptance(const Eigen::MatrixXd& mass, const Eigen::MatrixXd& stiffness, double alpha_1_s,
                            double beta_s, const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs,
                            double frequency_rad_s);

}  // namespace slew
