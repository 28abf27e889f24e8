// SCOLE's full 84 degrees of freedom: |G1| 591.36437, |Ka| 317.50181, |Kw| 295.70771, |fa| 3.0836142,
// |fw| 3.0837645 (S14); 206.3190 kg, S0 (0.66665, 1.15468, 9.72631) kg m, I11 103.6971 kg m^2 (S01);
// free-free 5.63879 6.48082 16.9690 24.9081 42.1173 77.8758 95.1652 197.046 209.410 278.534 rad/s (S02).
#include "server/structure/slewing_structure.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "server/attitude/mrp.hpp"
#include "server/structure/mass_properties.hpp"
#include "server/structure/reduction.hpp"
#include "tests/unit/frame_cases.hpp"
#include "tests/unit/structure_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

void expect_relative(double value, double expected, double tolerance) {
  EXPECT_NEAR(value, expected, tolerance * std::abs(expected));
}

TEST(SlewingStructure, HasTheReferencesNorms) {
  const SlewingStructure structure = slewing_structure(assemble(scole()), Vector3d::UnitX());
  ASSERT_EQ(structure.size(), 84);
  expect_relative(structure.gyroscopic.norm(), 591.36437, 1e-5);
  expect_relative(structure.tangential.norm(), 317.50181, 1e-5);
  expect_relative(structure.centrifugal.norm(), 295.70771, 1e-5);
  expect_relative(structure.tangential_load.tail(78).norm(), 3.0836142, 1e-5);
  expect_relative(structure.centrifugal_load.tail(78).norm(), 3.0837645, 1e-5);
}

TEST(SlewingStructure, HasTheReferencesMassProperties) {
  const AssembledFrame frame = assemble(scole());
  EXPECT_EQ(frame.mass.rows(), 84);
  const MassProperties mass = mass_properties(frame);
  expect_relative(mass.mass_kg, 206.319, 1e-6);
  EXPECT_LT((mass.first_moment_kg_m - Vector3d(0.66665499, 1.1546803, 9.726309)).norm(), 1e-6);
  Matrix3d inertia;
  inertia << 103.6971, -0.35194656, -2.0319644, -0.35194656, 58.66658, -3.5194656, -2.0319644, -3.5194656,
      109.28676;
  EXPECT_LT((mass.inertia_about_origin_kg_m2 - inertia).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(SlewingStructure, HasTheReferencesFreeFrequencies) {
  const AssembledFrame frame = assemble(scole());
  const SlewingStructure structure = slewing_structure(frame, Vector3d::UnitX());
  const FreeModes modes = free_modes(reduce(structure, clamped_basis(frame, structure)));
  ASSERT_EQ(modes.frequency_rad_s.size(), 78);
  const double expected[] = {5.63879,  6.480817, 16.96904, 24.90807, 42.11732,
                             77.87582, 95.16522, 197.0459, 209.4099, 278.5341};
  for (Index i = 0; i < 10; ++i) expect_relative(modes.frequency_rad_s[i], expected[i], 1e-4);
}

// The forces and moments that Eqs. 18 to 20 print for a slew about x, for any axis.
TEST(SlewingStructure, ZeroOrderLoadsAreThoseOfTheRigidBody) {
  const AssembledFrame frame = assemble(one_of_everything());
  const MassProperties mass = mass_properties(frame);
  const Vector3d axis = Vector3d(1, -2, 0.5).normalized();
  const SlewingStructure structure = slewing_structure(frame, axis);
  const Vector3d alpha = 0.7 * axis, omega = 1.3 * axis;
  const auto loads = zero_order_loads(structure, 0.7, 1.3);
  const Vector3d force =
      alpha.cross(mass.first_moment_kg_m) + omega.cross(omega.cross(mass.first_moment_kg_m));
  const Vector3d moment =
      mass.inertia_about_origin_kg_m2 * alpha + omega.cross(mass.inertia_about_origin_kg_m2 * omega);
  EXPECT_LT((loads.head<3>() - force).norm(), 1e-12 * force.norm());
  EXPECT_LT((loads.tail<3>() - moment).norm(), 1e-12 * moment.norm());
}

/// Of the whole frame as it moves in inertial space: displacement of every mass point and inertia,
/// differenced twice; virtual work of the inertia forces on each coordinate.
class Exact {
 public:
  Exact(const AssembledFrame& frame, const SlewingStructure& structure)
      : frame_(frame), structure_(structure) {}

  /// Generalized inertia forces at theta = 0, for hub displacement, hub rotation (a small vector about the
  /// hub's axes) and q that move as x + v t + a t^2/2 while the axes turn by rate t + acceleration t^2/2.
  VectorXd forces(const VectorXd& x, const VectorXd& v, const VectorXd& a, double rate,
                  double acceleration) const {
    const double h = 1e-3;
    VectorXd out = VectorXd::Zero(x.size());
    for (const MassPoint& point : frame_.mass_points) {
      MatrixXd j = MatrixXd::Zero(3, x.size());
      j.leftCols<3>().setIdentity();
      j.middleCols<3>(3) = -cross_matrix<double>(point.position_m);
      for (const PointMotion& motion : point.motions)
        j += motion.displacement * structure_.relative(motion.coordinate).transpose();
      const auto place = [&](double t) {
        const VectorXd z = x + v * t + 0.5 * a * t * t;
        const Vector3d u = j.rightCols(x.size() - 6) * z.tail(x.size() - 6);
        const Eigen::AngleAxisd slew(rate * t + 0.5 * acceleration * t * t, structure_.axis);
        const Vector3d beta = z.segment<3>(3);
        const Matrix3d hub =
            slew.toRotationMatrix() *
            Eigen::AngleAxisd(beta.norm(), beta.norm() > 0 ? Vector3d(beta.normalized()) : Vector3d::UnitX())
                .toRotationMatrix();
        return Vector3d(slew.toRotationMatrix() * z.head<3>() + hub * (point.position_m + u));
      };
      const Vector3d second =
          (-place(-2 * h) + 16 * place(-h) - 30 * place(0) + 16 * place(h) - place(2 * h)) / (12 * h * h);
      const Vector3d beta = x.segment<3>(3);
      const Vector3d u = j.rightCols(x.size() - 6) * x.tail(x.size() - 6);
      // Along the hub's axes as they are turned; moments about the hub.
      const Vector3d seen = second - beta.cross(second);
      MatrixXd arm = j;
      arm.middleCols<3>(3) = -cross_matrix<double>(point.position_m + u);
      out += point.mass_kg * arm.transpose() * seen;
    }
    return out;
  }

 private:
  const AssembledFrame& frame_;
  const SlewingStructure& structure_;
};

// Inertia forces of a frame that is displaced a little, from its motion in inertial space, against G1, Ka and
// Kw.
TEST(SlewingStructure, TermsAreThoseOfTheMotionInInertialSpace) {
  SpaceFrame given = scole();
  given.plates.clear();
  given.point_masses.push_back({9, 3, Matrix3d::Zero()});
  given.plates.push_back({12, 2, Vector3d::Zero(), {0.2, -0.1, 0.3}});
  for (FrameBeam& beam : given.beams) beam.section.polar_inertia_per_length_kg_m = 0;
  AssembledFrame frame = assemble(given);
  const SlewingStructure structure = slewing_structure(frame, Vector3d(1, -0.4, 0.3));
  // Bodies without inertia of their own are points.
  for (const RigidPart& part : frame.rigid_parts) {
    MassPoint point{part.centre_m, part.mass_kg, {}};
    const Matrix3d turned = -cross_matrix<double>(part.offset_m);
    for (Index i = 0; i < 3; ++i) {
      point.motions.push_back({part.first_coordinate + i, Vector3d::Unit(i)});
      point.motions.push_back({part.first_coordinate + 3 + i, turned.col(i)});
    }
    frame.mass_points.push_back(point);
  }
  const Exact exact(frame, structure);
  const Index n = structure.size();
  const double size = 1e-5, rate = 0.3, acceleration = 0.2;
  VectorXd x(n), v(n), a(n);
  for (Index i = 0; i < n; ++i) {
    x[i] = size * std::sin(1.0 + 3.0 * static_cast<double>(i));
    v[i] = size * std::cos(2.0 + 5.0 * static_cast<double>(i));
    a[i] = size * std::sin(4.0 + 7.0 * static_cast<double>(i));
  }
  // Odd in the displacement: the zero order and what is of second order go.
  const VectorXd first =
      0.5 * (exact.forces(x, v, a, rate, acceleration) - exact.forces(-x, -v, -a, rate, acceleration));
  const VectorXd expected = structure.mass * a + rate * structure.gyroscopic * v +
                            (acceleration * structure.tangential + rate * rate * structure.centrifugal) * x;
  EXPECT_LT((first - expected).norm(), 2e-4 * expected.norm());
  const VectorXd zero = exact.forces(0 * x, 0 * x, 0 * x, rate, acceleration);
  const VectorXd loads = acceleration * structure.tangential_load + rate * rate * structure.centrifugal_load;
  EXPECT_LT((zero - loads).norm(), 1e-6 * loads.norm());
}

TEST(SlewingStructure, PointsCarryTheConsistentMass) {
  for (SpaceFrame given : {scole(), one_of_everything()}) {
    for (FrameBeam& beam : given.beams) beam.section.polar_inertia_per_length_kg_m = 0;
    given.elements_per_member = 2;
    const AssembledFrame frame = assemble(given);
    MatrixXd mass = MatrixXd::Zero(frame.mass.rows(), frame.mass.rows());
    for (const MassPoint& point : frame.mass_points)
      for (const PointMotion& a : point.motions)
        for (const PointMotion& b : point.motions)
          mass(a.coordinate, b.coordinate) += point.mass_kg * a.displacement.dot(b.displacement);
    for (const RigidPart& part : frame.rigid_parts) {
      MatrixXd centre = MatrixXd::Zero(6, frame.mass.rows());
      centre.block<6, 6>(0, part.first_coordinate).setIdentity();
      centre.block<3, 3>(0, part.first_coordinate + 3) = -cross_matrix<double>(part.offset_m);
      mass += part.mass_kg * centre.topRows(3).transpose() * centre.topRows(3) +
              centre.bottomRows(3).transpose() * part.inertia_kg_m2 * centre.bottomRows(3);
    }
    EXPECT_LT((mass - frame.mass).norm(), 1e-13 * frame.mass.norm());
  }
}

TEST(SlewingStructure, RefusesAnAxisWithoutDirection) {
  EXPECT_THROW(slewing_structure(assemble(scole()), Vector3d::Zero()), std::invalid_argument);
}

}  // namespace
