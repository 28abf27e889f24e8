// Vadali, Singh & Carter 1993: 167.14 N m about axis 1 for u1 = 1, and det B is not 0 once a sign is
// corrected.
#include "server/plant/astrex.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "maneuver_cases.hpp"
#include "random_attitude.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using Eigen::Matrix3d;
using Eigen::Vector3d;

TEST(Astrex, CorrectedTableGivesThePrintedInfluence) {
  Matrix3d eight, two_hundred;
  eight << 166.60547166661286, 166.60547166661286, 0, -83.30273583330643, 83.30273583330643, 0,
      -96.08158688962679, -96.08158688962679, 201.41547473899544;
  two_hundred << 3933.74030323947, 3933.74030323947, 0, -2082.568395832661, 2082.568395832661, 0,
      -2268.5930237828547, -2268.5930237828547, 201.41547473899544;
  EXPECT_LE((astrex_influence_from_table(AstrexThrusters::eight_lbf) - eight).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LE(
      (astrex_influence_from_table(AstrexThrusters::two_hundred_lbf) - two_hundred).cwiseAbs().maxCoeff(),
      1e-9);
  for (const auto thrusters : {AstrexThrusters::eight_lbf, AstrexThrusters::two_hundred_lbf}) {
    const Matrix3d table = astrex_influence_from_table(thrusters), printed = astrex_influence(thrusters);
    EXPECT_LE((table - printed).cwiseAbs().maxCoeff(), 0.006 * printed.cwiseAbs().maxCoeff());
    EXPECT_GT(std::abs(printed.determinant()), 1e6);
    EXPECT_LE(astrex_net_force(thrusters, {.3, -.7, 1}).norm(), 1e-9);
  }
}

TEST(Astrex, MomentsOfWeightAndSprings) {
  const RigidManeuverPlant plant = astrex_on_pedestal(AstrexThrusters::eight_lbf);
  const Vector3d moment = external_moment<double>(plant, euler_deg(20, -10, 5));
  EXPECT_LE((moment - Vector3d(-57.94882656685195, -656.7851909967568, -90.02107586196136)).norm(), 1e-9);
  // The attitude in which it rests is not one of equilibrium.
  const Vector3d resting = external_moment<double>(plant, euler_deg(0, -30, 0));
  EXPECT_LE((resting - Vector3d(6.24, 94.77, 10.81)).norm(), 0.02);
}

TEST(Astrex, SpringsAreOfNoEnergyUnlessRollHasNone) {
  // M_s . C1 = -k_r th3 sin(th2) about the vertical, about which an energy of the tilt alone gives nothing.
  RigidManeuverPlant plant = astrex_on_pedestal(AstrexThrusters::eight_lbf);
  plant.weight.reset();
  const Vector4<double> q = euler_deg(20, -10, 5);
  const Vector3d vertical = rotation_matrix_of<double>(q).col(0);
  EXPECT_NEAR(external_moment<double>(plant, q).dot(vertical), 15.154, 1e-3);
  plant.springs->roll_N_m_rad = 0;
  EXPECT_NEAR(external_moment<double>(plant, q).dot(vertical), 0, 1e-12);
}

TEST(Astrex, AirIsFourteenCubicFeetPerMinuteAndPound) {
  EXPECT_LE((astrex_air_ft3_s(AstrexThrusters::eight_lbf) - 14.0 / 60 * Vector3d(16, 16, 16)).norm(), 1e-12);
  EXPECT_LE((astrex_air_ft3_s(AstrexThrusters::two_hundred_lbf) - 14.0 / 60 * Vector3d(400, 400, 16)).norm(),
            1e-12);
}

TEST(Astrex, FloatsFreelyForAMinute) {
  const RigidManeuverPlant plant = astrex_floating(AstrexThrusters::eight_lbf);
  const Matrix3d inverse = plant.inertia_kg_m2.inverse();
  Eigen::Matrix<double, 7, 1> x;
  x << euler_deg(0, -30, 0), 0.1, -0.07, 0.15;
  const auto slope = [&](const Eigen::Matrix<double, 7, 1>& at) {
    const auto rate = rigid_rate<double>(plant, inverse, at.head<4>(), at.tail<3>(), Vector3d::Zero());
    Eigen::Matrix<double, 7, 1> dx;
    dx << rate.attitude_1_s, rate.acceleration_rad_s2;
    return dx;
  };
  const int steps = 12000;
  const double h = 60.0 / steps;
  for (int i = 0; i < steps; ++i) {
    const auto k1 = slope(x), k2 = slope(x + h / 2 * k1), k3 = slope(x + h / 2 * k2), k4 = slope(x + h * k3);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  Eigen::Matrix<double, 7, 1> expected;
  expected << 0.6316307477093078, -0.4525173513378445, -0.49880650719578146, -0.3840087416524361,
      0.18208182094079772, -0.053102552011270336, -0.03526250538327241;
  EXPECT_LE((x - expected).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_NEAR(0.5 * x.tail<3>().dot(plant.inertia_kg_m2 * x.tail<3>()), 403.13142958946514, 1e-6);
}

TEST(EulerAngles, ThereAndBack) {
  RandomAttitude random;
  for (int i = 0; i < 100; ++i) {
    Vector3d angles = random.vector(1).cwiseProduct(Vector3d(3, 1.5, 3));
    const Vector4<double> q = euler_parameters_of_angles(angles);
    EXPECT_LE((euler_angles_123<double>(q) - angles).norm(), 1e-12);
    EXPECT_NEAR(q.norm(), 1, 1e-14);
    // As a matrix: of roll, then pitch, then yaw, acting on components.
    const auto about = [](int axis, double angle) {
      return Matrix3d(Eigen::AngleAxisd(-angle, Vector3d::Unit(axis)));
    };
    const Matrix3d c = about(2, angles[2]) * about(1, angles[1]) * about(0, angles[0]);
    EXPECT_LE((rotation_matrix_of<double>(q) - c).norm(), 1e-13);
  }
}

}  // namespace
