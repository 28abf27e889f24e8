#include "server/structure/normal_modes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace slew {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The shift s over the greatest of K_ii / M_ii, which estimates the greatest w^2. Rounding of size e
// leaves w^2 an error of e s at the low end and of e w^4 / s at the high end: so both ends keep eight digits
// and more.
constexpr double kShift = 1e-8;
// 1/(w^2 + s) over 1/s: at least 1e-10 for a mode (the estimate is low by a factor that stays far below 100),
// rounding for a motion without mass.
constexpr double kMassless = 1e-12;
// Strain energy over the sum of its terms' magnitudes: what rounding leaves of a motion that strains nothing
// is 1e-16 to 1e-15, and of a beam's first mode in a hundred elements 1e-11.
constexpr double kUnstrained = 1e-13;
// Of a pivot over its diagonal: rounding where neither stiffness nor mass is.
constexpr double kSingularPivot = 1e-14;

/// Moving coordinates with neither stiffness nor mass of their own (a bar's end has no rotation) take part in
/// nothing; what is left.
std::vector<Index> taking_part(const AssembledFrame& frame, FrameBoundary boundary) {
  std::vector<Index> kept;
  for (const Index i : frame.moving(boundary))
    if (frame.stiffness(i, i) > 0 || frame.mass(i, i) > 0) kept.push_back(i);
  return kept;
}

}  // namespace

// With K + s M = L L^T the modes are the eigenvectors of A = L^-1 M L^-T, whose eigenvalues are
// nu = 1/(w^2 + s). A solver is exact to rounding of the greatest eigenvalue, which here belongs to the
// lowest mode; of w^2 itself the greatest is the axial mode of the lightest element, 1e10 times the lowest.
// Motions without mass have nu = 0.
NormalModes normal_modes(const AssembledFrame& frame, FrameBoundary boundary) {
  const std::vector<Index> kept = taking_part(frame, boundary);
  const Index coordinates = frame.mass.rows();
  const MatrixXd stiffness = frame.stiffness(kept, kept), mass = frame.mass(kept, kept);
  double greatest = 0;
  for (Index i = 0; i < mass.rows(); ++i)
    if (mass(i, i) > 0) greatest = std::max(greatest, stiffness(i, i) / mass(i, i));
  if (mass.isZero(0)) return {VectorXd(0), MatrixXd(coordinates, 0)};
  // Nothing but masses that fly freely: any shift will do.
  const double shift = greatest > 0 ? kShift * greatest : 1;

  const MatrixXd shifted = stiffness + shift * mass;
  if (!shifted.allFinite()) throw std::domain_error("a part of the frame has next to no mass, or no size");
  const Eigen::LLT<MatrixXd> factored(shifted);
  const MatrixXd lower = factored.matrixL();
  if (factored.info() != Eigen::Success ||
      !((lower.diagonal().array().square() / shifted.diagonal().array()).minCoeff() > kSingularPivot))
    throw std::domain_error("the frame can move in a way that has neither stiffness nor mass");
  const auto triangle = lower.triangularView<Eigen::Lower>();
  MatrixXd inverse = triangle.solve(mass);
  inverse = triangle.solve(inverse.transpose()).eval();
  if (!inverse.allFinite()) throw std::domain_error("the parts of the frame are too far apart in size");
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(inverse);
  if (solver.info() != Eigen::Success) throw std::domain_error("the modes of the frame do not converge");

  const MatrixXd magnitude = stiffness.cwiseAbs();
  const VectorXd& nu = solver.eigenvalues();  // ascending
  const auto finite = (nu.array() * shift > kMassless).count();
  NormalModes modes{VectorXd(finite), MatrixXd::Zero(coordinates, finite)};
  for (Index mode = 0; mode < finite; ++mode) {
    const Index column = nu.size() - 1 - mode;
    // x = L^-T v has x^T (K + s M) x = 1 and x^T M x = nu.
    VectorXd shape = triangle.transpose().solve(solver.eigenvectors().col(column)) / std::sqrt(nu(column));
    const double strain = shape.dot(stiffness * shape);
    const double terms = shape.cwiseAbs().dot(magnitude * shape.cwiseAbs());
    modes.frequency_rad_s(mode) =
        strain > kUnstrained * terms ? std::sqrt(std::max(1 / nu(column) - shift, 0.0)) : 0;
    Index farthest = 0;
    shape.cwiseAbs().maxCoeff(&farthest);
    if (shape(farthest) < 0) shape = -shape;
    for (std::size_t i = 0; i < kept.size(); ++i) modes.shapes(kept[i], mode) = shape(static_cast<Index>(i));
  }
  return modes;
}

}  // namespace slew
