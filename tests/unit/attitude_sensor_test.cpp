// Readings of attitude and rate, each error by itself.
#include "server/sensor/attitude_sensor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "server/attitude/euler_parameters.hpp"
#include "server/attitude/small_rotation.hpp"

namespace {

using namespace slew;
using Eigen::Vector3d;

// The rotation from one attitude to the other, in the axes of the first.
Vector3d between(const Vector3d& from, const Vector3d& to) {
  return rotation_vector(turned_further(Vector3d(-from), to));
}

TEST(SmallRotation, FollowsTheKinematics) {
  const Vector3d p(0.4, -0.9, 0.7), rate(0.3, 0.5, -0.2);
  const double dt = 1e-5;
  const Vector3d ahead = turned_further(p, mrp_of_rotation_vector(Vector3d(rate * dt)));
  const Vector3d behind = turned_further(p, mrp_of_rotation_vector(Vector3d(-rate * dt)));
  EXPECT_LT(((ahead - behind) / (2 * dt) - mrp_rate(p, rate)).norm(), 1e-9);
}

TEST(SmallRotation, IsTheProductOfEulerParameters) {
  const Vector3d p(0.4, -0.9, 0.7), s(-0.2, 0.1, 0.3);
  const Vector4<double> a = euler_parameters(p), b = euler_parameters(s);
  const Vector3d u = a.tail<3>(), v = b.tail<3>();
  Vector4<double> product;
  product[0] = a[0] * b[0] - u.dot(v);
  product.tail<3>() = a[0] * v + b[0] * u + u.cross(v);
  EXPECT_LT((turned_further(p, s) - mrp(product)).norm(), 1e-14);
}

TEST(SmallRotation, VectorsAndParametersAreInverse) {
  for (const double size : {0.0, 1e-200, 1e-9, 0.5, 1.0, 3.0, 40.0}) {
    const Vector3d p = size * Vector3d(2, -1, 2) / 3;
    EXPECT_LT((mrp_of_rotation_vector(rotation_vector(p)) - p).norm(), 1e-13 * size + 1e-300);
  }
  EXPECT_NEAR(rotation_vector(Vector3d(0, 0, 1)).norm(), std::numbers::pi, 1e-15);
}

TEST(AttitudeSensor, AnIdealOneGivesTheTruth) {
  AttitudeSensor sensor({}, 1);
  for (const Vector3d& p : {Vector3d(0, 0, 1), Vector3d(0.1, 1e-300, -2.7), Vector3d(-0.3, 0.2, 1.1)}) {
    const auto reading = sensor.read(p, 0.1 * p);
    EXPECT_EQ(reading.mrp, p);
    EXPECT_EQ(reading.rate_rad_s, 0.1 * p);
  }
}

TEST(AttitudeSensor, BiasIsARotationInBodyAxes) {
  AttitudeSensorParameters parameters;
  parameters.angle_bias_rad = {0.01, -0.02, 0.005};
  parameters.rate_bias_rad_s = {1e-3, 0, -2e-3};
  AttitudeSensor sensor(parameters, 1);
  const Vector3d p(0.3, -0.5, 0.2), rate(0.1, 0.2, 0.3);
  const auto reading = sensor.read(p, rate);
  EXPECT_LT((between(p, reading.mrp) - parameters.angle_bias_rad).norm(), 1e-15);
  EXPECT_EQ(reading.rate_rad_s, rate + parameters.rate_bias_rad_s);
}

// Through 180 degrees the parameters go on: the law would otherwise turn round.
TEST(AttitudeSensor, DoesNotJumpWherePIsOne) {
  AttitudeSensorParameters parameters;
  parameters.angle_bias_rad = {0, 0, 0.002};
  parameters.angle_noise_rad = 0.001;
  parameters.angle_quantum_rad = 0.0005;
  AttitudeSensor sensor(parameters, 5);
  for (double size = 0.98; size < 1.02; size += 1e-4) {
    const Vector3d p(0, 0, size);
    EXPECT_LT((sensor.read(p, Vector3d::Zero()).mrp - p).norm(), 0.01) << size;
  }
}

TEST(AttitudeSensor, RoundsToItsQuanta) {
  AttitudeSensorParameters parameters;
  parameters.angle_quantum_rad = 0.01;
  parameters.rate_quantum_rad_s = 0.25;
  AttitudeSensor sensor(parameters, 1);
  const auto reading = sensor.read(mrp_of_rotation_vector(Vector3d(0.014, -0.016, 3.999)), {0.1, -0.2, 0.3});
  EXPECT_LT((rotation_vector(reading.mrp) - Vector3d(0.01, -0.02, 4)).norm(), 1e-14);
  EXPECT_EQ(reading.rate_rad_s, Vector3d(0, -0.25, 0.25));
  // At the end of a turn it stays on its side of it.
  const Vector3d nearly = mrp_of_rotation_vector(Vector3d(0, 0, 6.2831));
  EXPECT_GT(sensor.read(nearly, Vector3d::Zero()).mrp.z(), 1);
}

TEST(AttitudeSensor, NoiseHasItsStandardDeviation) {
  AttitudeSensorParameters parameters;
  parameters.angle_noise_rad = 1e-3;
  parameters.rate_noise_rad_s = 2e-4;
  AttitudeSensor sensor(parameters, 8);
  const Vector3d p(0.6, 0.7, -0.5);
  constexpr int kCount = 20000;
  Vector3d angle_square = Vector3d::Zero(), rate_square = angle_square, mean = angle_square;
  for (int i = 0; i < kCount; ++i) {
    const auto reading = sensor.read(p, Vector3d::Zero());
    const Vector3d angle = between(p, reading.mrp);
    mean += angle / kCount;
    angle_square += angle.cwiseAbs2() / kCount;
    rate_square += reading.rate_rad_s.cwiseAbs2() / kCount;
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(mean[i], 0, 5e-3 / std::sqrt(double{kCount}));
    EXPECT_NEAR(std::sqrt(angle_square[i]), 1e-3, 5e-3 / std::sqrt(2.0 * kCount));
    EXPECT_NEAR(std::sqrt(rate_square[i]), 2e-4, 1e-3 / std::sqrt(2.0 * kCount));
  }
}

TEST(AttitudeSensor, HoldsAndDelays) {
  for (const int hold : {1, 3})
    for (const int delay : {0, 1, 2, 5, kMaxSensorDelaySamples}) {
      AttitudeSensorParameters parameters;
      parameters.laws_samples_per_reading = hold;
      parameters.delay_samples = delay;
      AttitudeSensor sensor(parameters, 1);
      for (int i = 0; i < 200; ++i) {
        const auto reading = sensor.read(Vector3d(0, 0, 1e-3 * i), Vector3d(i, 0, 0));
        const int of = std::max(0, i - delay) / hold * hold;
        EXPECT_EQ(reading.rate_rad_s.x(), of) << hold << ' ' << delay << ' ' << i;
        EXPECT_EQ(reading.mrp.z(), 1e-3 * of);
      }
    }
}

TEST(AttitudeSensor, ACopyGoesOnWithTheSameBits) {
  AttitudeSensorParameters parameters;
  parameters.angle_noise_rad = parameters.rate_noise_rad_s = 0.01;
  parameters.laws_samples_per_reading = 2;
  parameters.delay_samples = 3;
  AttitudeSensor sensor(parameters, 77);
  const Vector3d p(0.1, 0.2, 0.3);
  for (int i = 0; i < 11; ++i) sensor.read(p, p);
  AttitudeSensor copy = sensor, other(parameters, 78);
  for (int i = 0; i < 50; ++i) {
    const auto a = sensor.read(p, p), b = copy.read(p, p);
    EXPECT_EQ(a.mrp, b.mrp);
    EXPECT_EQ(a.rate_rad_s, b.rate_rad_s);
    EXPECT_NE(a.mrp, other.read(p, p).mrp);
  }
}

}  // namespace
