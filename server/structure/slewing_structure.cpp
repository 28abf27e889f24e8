#include "server/structure/slewing_structure.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "server/attitude/mrp.hpp"

namespace slew {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// A few of x's coordinates, and what moves by each: one column each.
struct Columns {
  std::vector<Index> at;
  MatrixXd of;  ///< 3 rows
};

void add(MatrixXd& whole, const Columns& rows, const MatrixXd& columns_of) {
  // columns_of: 3 x n, over the same coordinates.
  const MatrixXd product = rows.of.transpose() * columns_of;
  for (std::size_t i = 0; i < rows.at.size(); ++i)
    for (std::size_t j = 0; j < rows.at.size(); ++j)
      whole(rows.at[i], rows.at[j]) += product(static_cast<Index>(i), static_cast<Index>(j));
}

void add(VectorXd& whole, const Columns& rows, const Vector3d& load) {
  const VectorXd product = rows.of.transpose() * load;
  for (std::size_t i = 0; i < rows.at.size(); ++i) whole[rows.at[i]] += product[static_cast<Index>(i)];
}

class Assembly {
 public:
  Assembly(const AssembledFrame& frame, const Vector3d& axis, SlewingStructure& out)
      : out_(out), e1_(axis), e_(cross_matrix<double>(axis)), places_(frame.held_by_node.size(), -1) {
    for (std::size_t i = 0; i < out.elastic.size(); ++i)
      places_[static_cast<std::size_t>(out.elastic[i])] = static_cast<Index>(6 + i);
  }

  /// A point p of mass m moves by J x, J = [1, -p~, N]. Along the hub's axes, which turn by beta, its
  /// acceleration is of first order J x'' + theta' 2 e J x' + (theta'' e + theta'^2 e e) J x, and of what is
  /// of zero order, a0 = (theta'' e + theta'^2 e e) p, a0~ beta; the moment about the hub is taken at p + N
  /// q.
  void add_point(const Vector3d& p, double mass, const std::vector<PointMotion>& motions) {
    Columns j;
    j.of = MatrixXd::Zero(3, 6 + static_cast<Index>(motions.size()));
    j.of.leftCols<3>() = Matrix3d::Identity();
    const Matrix3d p_cross = cross_matrix<double>(p);
    j.of.middleCols<3>(3) = -p_cross;
    for (Index i = 0; i < 6; ++i) j.at.push_back(i);
    for (const PointMotion& motion : motions) {
      const Index place = places_[static_cast<std::size_t>(motion.coordinate)];
      if (place < 0) continue;
      j.of.col(static_cast<Index>(j.at.size())) = motion.displacement;
      j.at.push_back(place);
    }
    const auto n = static_cast<Index>(j.at.size());
    j.of.conservativeResize(3, n);
    const auto shapes = j.of.rightCols(n - 6);

    MatrixXd gyroscopic = 2 * e_ * j.of, tangential = e_ * j.of, centrifugal = e_ * e_ * j.of;
    tangential.middleCols<3>(3) = -p_cross * e_;
    centrifugal.middleCols<3>(3) = -cross_matrix<double>(e_ * p) * e_ - e_ * p_cross * e_;
    gyroscopic.middleCols<3>(3) = -p_cross * e_ - cross_matrix<double>(e_ * p) - e_ * p_cross;
    add(out_.gyroscopic, j, mass * gyroscopic);
    add(out_.tangential, j, mass * tangential);
    add(out_.centrifugal, j, mass * centrifugal);
    // The moment about the hub of a zero-order force that acts at p + u.
    const MatrixXd lever_a = -mass * cross_matrix<double>(e_ * p) * shapes;
    const MatrixXd lever_w = -mass * cross_matrix<double>(e_ * e_ * p) * shapes;
    for (Index i = 6; i < n; ++i) {
      const Index place = j.at[static_cast<std::size_t>(i)];
      out_.tangential.block<3, 1>(3, place) += lever_a.col(i - 6);
      out_.centrifugal.block<3, 1>(3, place) += lever_w.col(i - 6);
    }
    add(out_.tangential_load, j, mass * e_ * p);
    add(out_.centrifugal_load, j, mass * e_ * e_ * p);
  }

  /// A small body of inertia I turns by beta + r, r relative to the hub: H = I' (w + r'), with
  /// I' = I + r~ I - I r~ along the hub's axes and w = theta' (1 - beta~) e1 + beta'; the moment is H' + w x
  /// H.
  void add_inertia(const Matrix3d& inertia, Index first_rotation) {
    const Vector3d h = inertia * e1_;
    const Matrix3d h_cross = cross_matrix<double>(h);
    Columns turn;
    turn.of = MatrixXd::Zero(3, 6);
    for (Index i = 0; i < 3; ++i) {
      turn.at.push_back(3 + i);
      turn.of.col(i) = Vector3d::Unit(i);
    }
    for (Index i = 0; i < 3; ++i)
      if (const Index place = places_[static_cast<std::size_t>(first_rotation + i)]; place >= 0) {
        turn.of.col(static_cast<Index>(turn.at.size())) = Vector3d::Unit(i);
        turn.at.push_back(place);
      }
    turn.of.conservativeResize(3, static_cast<Index>(turn.at.size()));
    const Matrix3d gyroscopic = inertia * e_ - h_cross + e_ * inertia;
    const Matrix3d of_body = inertia * e_ - h_cross;  // what turns with r, not with the hub
    MatrixXd tangential = of_body * turn.of, centrifugal = e_ * of_body * turn.of;
    tangential.leftCols<3>() = inertia * e_;
    centrifugal.leftCols<3>() = e_ * inertia * e_ - h_cross * e_;
    add(out_.gyroscopic, turn, gyroscopic * turn.of);
    add(out_.tangential, turn, tangential);
    add(out_.centrifugal, turn, centrifugal);
    add(out_.tangential_load, turn, h);
    add(out_.centrifugal_load, turn, e_ * h);
  }

 private:
  SlewingStructure& out_;
  const Vector3d e1_;
  const Matrix3d e_;
  std::vector<Index> places_;  ///< in x, of the frame's coordinates; -1 where held
};

}  // namespace

VectorXd SlewingStructure::absolute(Index coordinate) const {
  VectorXd row = relative(coordinate);
  row.head<6>() = rigid_motion.row(coordinate);
  return row;
}

VectorXd SlewingStructure::relative(Index coordinate) const {
  VectorXd row = VectorXd::Zero(size());
  const auto place = std::find(elastic.begin(), elastic.end(), coordinate);
  if (place != elastic.end()) row[6 + static_cast<Index>(place - elastic.begin())] = 1;
  return row;
}

SlewingStructure slewing_structure(const AssembledFrame& frame, const Vector3d& axis) {
  const double length = axis.norm();
  if (!(length > 0 && std::isfinite(length))) throw std::invalid_argument("the axis has no direction");
  SlewingStructure out;
  out.axis = axis / length;
  out.rigid_motion = frame.rigid_motion;
  // A coordinate with neither stiffness nor mass of its own (a bar's end has no rotation) takes part in
  // nothing.
  for (const Index i : frame.moving(FrameBoundary::kClamped))
    if (frame.stiffness(i, i) > 0 || frame.mass(i, i) > 0) out.elastic.push_back(i);

  const Index n = 6 + static_cast<Index>(out.elastic.size());
  const MatrixXd held = frame.mass(Eigen::all, out.elastic);
  out.mass = MatrixXd(n, n);
  out.mass.topLeftCorner<6, 6>() = frame.rigid_motion.transpose() * frame.mass * frame.rigid_motion;
  out.mass.topRightCorner(6, n - 6) = frame.rigid_motion.transpose() * held;
  out.mass.bottomLeftCorner(n - 6, 6) = out.mass.topRightCorner(6, n - 6).transpose();
  out.mass.bottomRightCorner(n - 6, n - 6) = frame.mass(out.elastic, out.elastic);
  out.stiffness = MatrixXd::Zero(n, n);
  out.stiffness.bottomRightCorner(n - 6, n - 6) = frame.stiffness(out.elastic, out.elastic);
  out.gyroscopic = out.tangential = out.centrifugal = MatrixXd::Zero(n, n);
  out.tangential_load = out.centrifugal_load = VectorXd::Zero(n);

  Assembly assembly(frame, out.axis, out);
  for (const MassPoint& point : frame.mass_points)
    assembly.add_point(point.position_m, point.mass_kg, point.motions);
  for (const RigidPart& part : frame.rigid_parts) {
    std::vector<PointMotion> motions;
    const Matrix3d turned = -cross_matrix<double>(part.offset_m);
    for (Index i = 0; i < 3; ++i) motions.push_back({part.first_coordinate + i, Vector3d::Unit(i)});
    for (Index i = 0; i < 3; ++i) motions.push_back({part.first_coordinate + 3 + i, turned.col(i)});
    assembly.add_point(part.centre_m, part.mass_kg, motions);
    assembly.add_inertia(part.inertia_kg_m2, part.first_coordinate + 3);
  }
  // The hub's, from the mass matrix: it knows the members' polar inertia too.
  const Vector3d momentum = out.mass.block<3, 3>(3, 3) * out.axis;
  out.tangential_load.segment<3>(3) = momentum;
  out.centrifugal_load.segment<3>(3) = out.axis.cross(momentum);
  return out;
}

Eigen::Matrix<double, 6, 1> zero_order_loads(const SlewingStructure& structure, double acceleration_rad_s2,
                                             double rate_rad_s) {
  return structure.tangential_load.head<6>() * acceleration_rad_s2 +
         structure.centrifugal_load.head<6>() * (rate_rad_s * rate_rad_s);
}

}  // namespace slew
