#include "server/structure/reduction.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <stdexcept>
#include <string>

namespace slew {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of a vector once those before it have been taken out, over what it was: below, it is rounding.
constexpr double kDependent = 1e-9;
// Of a frequency: nearer to it K - s^2 M has no digits left.
constexpr double kOnFrequency = 1e-6;

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.6g", value);
  return buffer;
}

/// Gram and Schmidt's, twice, in the elastic block of M. They must not depend on each other.
MatrixXd orthonormal(const SlewingStructure& structure, const MatrixXd& vectors) {
  const Index n = structure.size() - 6;
  const auto mass = structure.mass.bottomRightCorner(n, n);
  MatrixXd out(n, vectors.cols());
  for (Index k = 0; k < vectors.cols(); ++k) {
    VectorXd v = vectors.col(k);
    const double before = std::sqrt(v.dot(mass * v));
    for (int pass = 0; pass < 2; ++pass)
      for (Index i = 0; i < k; ++i) v -= out.col(i).dot(mass * v) * out.col(i);
    const double after = std::sqrt(v.dot(mass * v));
    if (!(after > kDependent * before))
      throw std::domain_error("vector " + std::to_string(k + 1) + " of " + std::to_string(vectors.cols()) +
                              " depends on those before it");
    out.col(k) = v / after;
  }
  return out;
}

}  // namespace

MatrixXd clamped_basis(const AssembledFrame& frame, const SlewingStructure& structure) {
  const NormalModes modes = normal_modes(frame, FrameBoundary::kClamped);
  if (modes.size() > 0 && modes.frequency_rad_s[0] == 0)
    throw std::domain_error(
        "a part of the frame can move on its hub without being strained: it is not connected, or a "
        "mechanism");
  return modes.shapes(structure.elastic, Eigen::all);
}

MatrixXd clamped_basis(const AssembledFrame& frame, const SlewingStructure& structure, Index count) {
  const MatrixXd all = clamped_basis(frame, structure);
  if (count > all.cols())
    throw std::invalid_argument("the structure has only " + std::to_string(all.cols()) + " modes");
  return all.leftCols(count);
}

MatrixXd free_basis(const AssembledFrame& frame, const SlewingStructure& structure, Index count) {
  const MatrixXd all = clamped_basis(frame, structure);
  const FreeModes modes = free_modes(reduce(structure, all));
  if (count > modes.shapes.cols())
    throw std::invalid_argument("the structure has only " + std::to_string(modes.shapes.cols()) + " modes");
  return orthonormal(structure, all * modes.shapes.leftCols(count));
}

MatrixXd krylov_basis(const SlewingStructure& structure, const MatrixXd& loads,
                      const std::vector<double>& shifts_rad_s) {
  const Index n = structure.size(), each = loads.cols();
  const auto count = each * static_cast<Index>(shifts_rad_s.size());
  if (count > n - 6)
    throw std::domain_error(std::to_string(count) + " vectors are more than the " + std::to_string(n - 6) +
                            " degrees of freedom that can deform");
  MatrixXd vectors(n, count), right = loads;
  // r^T M^-1 r of the right-hand sides r.
  VectorXd size = (loads.transpose() * structure.mass.ldlt().solve(loads)).diagonal();
  for (std::size_t i = 0; i < shifts_rad_s.size(); ++i) {
    const double square = shifts_rad_s[i] * shifts_rad_s[i];
    const MatrixXd block = (structure.stiffness - square * structure.mass).partialPivLu().solve(right);
    right = structure.mass * block;
    const VectorXd mass = block.cwiseProduct(right).colwise().sum();
    // Some w^2 is no farther from s^2 than |r| / |v| in these norms.
    if (!block.allFinite() ||
        (size.array().abs() < mass.array() * std::pow(2 * kOnFrequency * square, 2)).any())
      throw std::domain_error("a shift of " + text(shifts_rad_s[i]) + " rad/s is on a natural frequency");
    // Any scale will do for what only spans a space; without it a chain of blocks would underflow.
    const double scale = block.cwiseAbs().maxCoeff();
    vectors.middleCols(each * static_cast<Index>(i), each) = block / scale;
    right /= scale;
    size = mass / (scale * scale);
  }
  return orthonormal(structure, vectors.bottomRows(n - 6));
}

ReducedStructure reduce(const SlewingStructure& structure, const MatrixXd& elastic_basis) {
  ReducedStructure out;
  const Index n = structure.size(), kept = 6 + elastic_basis.cols();
  out.axis = structure.axis;
  MatrixXd& q = out.basis = MatrixXd::Zero(n, kept);
  q.topLeftCorner<6, 6>().setIdentity();
  q.bottomRightCorner(n - 6, kept - 6) = elastic_basis;
  const auto project = [&](const MatrixXd& whole) -> MatrixXd { return q.transpose() * whole * q; };
  out.mass = project(structure.mass);
  out.mass = 0.5 * (out.mass + out.mass.transpose()).eval();
  out.stiffness = project(structure.stiffness);
  out.stiffness = 0.5 * (out.stiffness + out.stiffness.transpose()).eval();
  out.gyroscopic = project(structure.gyroscopic);
  out.tangential = project(structure.tangential);
  out.centrifugal = project(structure.centrifugal);
  out.tangential_load = q.transpose() * structure.tangential_load;
  out.centrifugal_load = q.transpose() * structure.centrifugal_load;
  return out;
}

// Without the hub, K_ff T = S T w^2 with S = M_ff - M_fr M_rr^-1 M_rf. A = L^-1 S L^-T, K_ff = L L^T, has the
// lowest mode as its greatest eigenvalue 1/w^2, so that it is known best.
FreeModes free_modes(const ReducedStructure& structure) {
  const Index n = structure.elastic();
  FreeModes out{VectorXd(n), MatrixXd(n, n), MatrixXd(6, n)};
  if (n == 0) return out;
  const MatrixXd rigid =
      structure.mass.topLeftCorner<6, 6>().ldlt().solve(structure.mass.topRightCorner(6, n));
  MatrixXd reduced = structure.mass.bottomRightCorner(n, n) - structure.mass.bottomLeftCorner(n, 6) * rigid;
  const Eigen::LLT<MatrixXd> factored(structure.stiffness.bottomRightCorner(n, n));
  if (factored.info() != Eigen::Success)
    throw std::domain_error("the structure can move on its hub without being strained");
  const auto lower = factored.matrixL();
  MatrixXd inverse = lower.solve(reduced);
  inverse = lower.solve(inverse.transpose()).eval();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(0.5 * (inverse + inverse.transpose()));
  if (solver.info() != Eigen::Success) throw std::domain_error("the modes of the structure do not converge");
  for (Index mode = 0; mode < n; ++mode) {
    const Index column = n - 1 - mode;
    const double nu = solver.eigenvalues()[column];
    if (!(nu > 0)) throw std::domain_error("the structure with its hub free has a motion without mass");
    out.frequency_rad_s[mode] = 1 / std::sqrt(nu);
    VectorXd shape = factored.matrixU().solve(solver.eigenvectors().col(column)) / std::sqrt(nu);
    Index farthest = 0;
    shape.cwiseAbs().maxCoeff(&farthest);
    out.shapes.col(mode) = shape[farthest] < 0 ? VectorXd(-shape) : shape;
  }
  out.rigid = -rigid * out.shapes;
  return out;
}

Eigen::MatrixXcd receptance(const MatrixXd& mass, const MatrixXd& stiffness, double alpha_1_s, double beta_s,
                            const MatrixXd& inputs, const MatrixXd& outputs, double frequency_rad_s) {
  const std::complex<double> i(0, 1);
  const double w = frequency_rad_s;
  const Eigen::MatrixXcd dynamic =
      (1.0 + i * w * beta_s) * stiffness - (w * w - i * w * alpha_1_s) * mass.cast<std::complex<double>>();
  return outputs.transpose() * dynamic.partialPivLu().solve(inputs.cast<std::complex<double>>());
}

}  // namespace slew
