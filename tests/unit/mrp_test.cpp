// Kim & Crassidis 1998, Eqs. 1-3: p = n tan(theta/4), p' = F(p) w.
#include "server/attitude/mrp.hpp"

#include <gtest/gtest.h>

#include "random_attitude.hpp"
#include "runge_kutta.hpp"
#include "server/attitude/euler_parameters.hpp"

namespace {

using namespace slew;
using Eigen::Matrix3d;
using Eigen::Vector3d;

Eigen::Quaterniond quaternion(const Vector3d& p) {
  const Vector4<double> q = euler_parameters<double>(p);
  return {q[0], q[1], q[2], q[3]};
}

TEST(Mrp, RateIsThePublishedOne) {
  const Vector3d rate = mrp_rate<double>({.3, -.2, .4}, {.02, -.01, .03});
  EXPECT_LE((rate - Vector3d(.00555, -.004275, .009825)).norm(), 1e-16);
}

TEST(Mrp, RateAndItsInverseUndoEachOther) {
  RandomAttitude random;
  for (int i = 0; i < 100; ++i) {
    const Vector3d p = random.vector(2), w = random.vector(1);
    EXPECT_LE((rate_of_mrp_rate(p, mrp_rate(p, w)) - w).norm(), 1e-14);
    EXPECT_LE((mrp_rate(p, rate_of_mrp_rate(p, w)) - w).norm(), 1e-14);
  }
}

TEST(Mrp, EulerParametersMoveAlike) {
  const auto rate = [](double t) { return Vector3d(.4 * std::sin(t), .3, -.2 * std::cos(2 * t)); };
  Vector3d p(.1, -.3, .2);
  Vector4<double> q = euler_parameters<double>(p);
  const double step = 1e-3;
  for (int i = 0; i < 5000; ++i) {
    p = runge_kutta([&](double t, const Vector3d& x) { return mrp_rate<double>(x, rate(t)); }, i * step, p,
                    step);
    q = runge_kutta(
        [&](double t, const Vector4<double>& x) { return euler_parameter_rate<double>(x, rate(t)); },
        i * step, q, step);
  }
  EXPECT_NEAR(q.norm(), 1, 1e-12);
  EXPECT_LE((mrp<double>(q) - p).norm(), 1e-11);
  EXPECT_LE((euler_parameters<double>(p) - q).norm(), 1e-11);
}

TEST(Mrp, EulerParametersThereAndBack) {
  RandomAttitude random;
  for (int i = 0; i < 100; ++i) {
    const Vector3d p = random.vector(2);
    const Vector4<double> q = euler_parameters<double>(p);
    EXPECT_NEAR(q.norm(), 1, 1e-15);
    EXPECT_LE((mrp<double>(q) - p).norm(), 1e-14 * (1 + p.squaredNorm()));
    EXPECT_LE((mrp<double>(3 * q) - p).norm(), 1e-14 * (1 + p.squaredNorm()));
    EXPECT_EQ(q[0]<0, p.norm()> 1);
  }
}

TEST(Mrp, ShadowIsTheSameAttitude) {
  RandomAttitude random;
  for (int i = 0; i < 100; ++i) {
    const Vector3d p = random.vector(1), w = random.vector(1);
    const Vector3d shadow = mrp_shadow(p);
    EXPECT_LE((rotation_matrix(shadow) - rotation_matrix(p)).norm(), 1e-14);
    EXPECT_LE((euler_parameters(shadow) + euler_parameters(p)).norm(), 1e-14);
    EXPECT_LE((mrp_shadow(shadow) - p).norm(), 1e-15);
    EXPECT_NEAR(rotation_angle_rad(shadow), rotation_angle_rad(p), 1e-14);
    // Both move with the same rate: the shadow of p + p' dt.
    const double dt = 1e-6;
    const Vector3d moved =
        (mrp_shadow<double>(p + dt * mrp_rate(p, w)) - mrp_shadow<double>(p - dt * mrp_rate(p, w))) /
        (2 * dt);
    EXPECT_LE((moved - mrp_rate(shadow, w)).norm(), 1e-8 * (1 + moved.norm()) * (1 + shadow.squaredNorm()));
  }
}

// Eigen's quaternions turn vectors, and the matrix here takes components into the turned axes.
TEST(Mrp, RotationMatrixIsThatOfTheQuaternion) {
  RandomAttitude random;
  for (int i = 0; i < 100; ++i) {
    const Vector3d p = random.vector(2);
    EXPECT_LE((rotation_matrix(p) - quaternion(p).toRotationMatrix().transpose()).norm(), 1e-14);
  }
  const Matrix3d quarter_turn = rotation_matrix<double>({0, 0, std::tan(M_PI / 8)});
  EXPECT_LE((quarter_turn * Vector3d::UnitX() + Vector3d::UnitY()).norm(), 1e-15);
}

TEST(Mrp, RotationMatrixMovesWithTheRate) {
  RandomAttitude random;
  for (int i = 0; i < 20; ++i) {
    const Vector3d p = random.vector(1), w = random.vector(1), v = mrp_rate(p, w);
    const double dt = 1e-5;
    const Matrix3d slope =
        (rotation_matrix<double>(p + dt * v) - rotation_matrix<double>(p - dt * v)) / (2 * dt);
    EXPECT_LE((slope + cross_matrix(w) * rotation_matrix(p)).norm(), 1e-9);
  }
}

TEST(Mrp, ProductIsOneRotationAfterAnother) {
  RandomAttitude random;
  for (int i = 0; i < 100; ++i) {
    const Vector3d first = random.vector(1), second = random.vector(.3);
    const Vector3d both = mrp_product(first, second);
    EXPECT_LE((rotation_matrix(both) - rotation_matrix(second) * rotation_matrix(first)).norm(), 1e-13);
    const Eigen::Quaterniond product = quaternion(first) * quaternion(second);
    EXPECT_LE((quaternion(both).coeffs() - product.coeffs()).norm(), 1e-13);
    EXPECT_LE((mrp_product<double>(both, -second) - first).norm(), 1e-13);
  }
}

TEST(Mrp, AngleIsTheShorterOne) {
  const Vector3d axis = Vector3d(1, 2, 3).normalized();
  for (double deg : {0., 1e-9, 30., 120., 179.999, 180.})
    EXPECT_NEAR(rotation_angle_rad(std::tan(deg * M_PI / 720) * axis), deg * M_PI / 180, 1e-15 + 1e-15 * deg);
  for (double deg : {181., 270., 350.})
    EXPECT_NEAR(rotation_angle_rad(std::tan(deg * M_PI / 720) * axis), (360 - deg) * M_PI / 180, 2e-14);
}

}  // namespace
