#include "server/control/tracking_sliding_mode.hpp"

#include <numeric>
#include <vector>

namespace slew {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// Places in [z; z'] of the hub's states and of the elastic ones.
std::vector<Index> rigid_places(Index n) {
  std::vector<Index> places(12);
  std::iota(places.begin(), places.begin() + 6, 0);
  std::iota(places.begin() + 6, places.end(), n);
  return places;
}
std::vector<Index> elastic_places(Index n) {
  std::vector<Index> places(static_cast<std::size_t>(2 * (n - 6)));
  const auto middle = places.begin() + (n - 6);
  std::iota(places.begin(), middle, 6);
  std::iota(middle, places.end(), n + 6);
  return places;
}

}  // namespace

TrackingLaw tracking_law(const ReducedStructure& structure, const StructureDynamics& design,
                         const MatrixXd& shapes, const MatrixXd& output, const TrackingGains& gains) {
  const Index n = structure.size(), modes = shapes.cols();
  MatrixXd weight = MatrixXd::Zero(2 * n, 2 * n);
  weight.topLeftCorner(n, n) =
      structure.stiffness + gains.surface_rad_s * gains.surface_rad_s * structure.mass;
  weight.bottomRightCorner(n, n) = structure.mass;
  const MatrixXd a = design.state_matrix();
  const OptimalSurface optimal = optimal_surface(a, design.input_matrix(), weight);

  TrackingLaw out;
  const MatrixXd& g = out.surface = optimal.gain;
  out.sliding_eigenvalues = optimal.sliding_eigenvalues;
  const std::vector<Index> rigid = rigid_places(n), elastic = elastic_places(n);
  MatrixXd reaching = gains.reaching_1_s * g;
  reaching(Eigen::all, rigid) += gains.rigid_1_s * g(Eigen::all, rigid);
  out.estimate = g * a + reaching;
  out.elastic = g(Eigen::all, elastic);

  // z_d = [S x_d; S x_d'], z_d' = [S x_d'; S x_d''].
  MatrixXd of_desired = reaching;
  if (gains.form == LawForm::as_printed) of_desired += g * a;
  out.tracked = MatrixXd::Zero(g.rows(), 3 * modes);
  out.tracked.leftCols(2 * modes) << of_desired.leftCols(n) * shapes, of_desired.rightCols(n) * shapes;
  out.tracked.middleCols(modes, modes) += g.leftCols(n) * shapes;
  out.tracked.rightCols(modes) += g.rightCols(n) * shapes;
  out.innovation_of_tracked = MatrixXd::Zero(output.rows(), 2 * modes);
  if (gains.form == LawForm::as_printed)
    out.innovation_of_tracked << output.leftCols(n - 6) * shapes.bottomRows(n - 6),
        output.rightCols(n - 6) * shapes.bottomRows(n - 6);

  const double known = gains.knows_loads ? -1 : 0;
  out.tangential_load = known * g.rightCols(n) * design.tangential_load;
  out.centrifugal_load = known * g.rightCols(n) * design.centrifugal_load;
  return out;
}

}  // namespace slew
