// The common slew: J = diag(100, 80, 60) kg m^2, 120 deg about (1, 2, 3), s = w + 0.4 p, K = 2 N m, torques
// up to 4 N m held for 10 ms, ends at p(60 s) = (.000424092791966689, .000829196319565271,
// .0013556991800147).
#include "server/control/attitude_law.hpp"

#include <gtest/gtest.h>

#include "random_attitude.hpp"
#include "runge_kutta.hpp"
#include "server/plant/rigid_body.hpp"

namespace {

using namespace slew;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using State = Eigen::Matrix<double, 6, 1>;

State with_torque(const Matrix3d& inertia, const Matrix3d& inverse, const State& x, const Vector3d& torque) {
  const Vector3d p = x.head<3>(), w = x.tail<3>();
  State slope;
  slope << mrp_rate(p, w), angular_acceleration(inertia, inverse, w, torque);
  return slope;
}

/// The body under a law that is evaluated all the time.
State flown(const AttitudeLaw& law, const Matrix3d& inertia, State x, double duration_s, double step_s) {
  const Matrix3d inverse = inertia.inverse();
  const auto slope = [&](double t, const State& at) {
    const AttitudeSight<double> sight{at.head<3>(), at.tail<3>(), {}, t};
    return with_torque(inertia, inverse, at, command(law, sight).torque_N_m);
  };
  const int steps = static_cast<int>(duration_s / step_s + .5);
  for (int i = 0; i < steps; ++i) x = runge_kutta(slope, i * step_s, x, step_s);
  return x;
}

TEST(LinearSurface, CommonSlew) {
  LinearSurface parameters;
  parameters.inertia_kg_m2 = Vector3d(100, 80, 60).asDiagonal();
  const AttitudeLaw law = parameters;
  const Matrix3d inertia = parameters.inertia_kg_m2, inverse = inertia.inverse();
  State x = State::Zero();
  x.head<3>() = std::tan(M_PI / 6) * Vector3d(1, 2, 3) / std::sqrt(14.);
  const double period = .01;
  for (int i = 0; i < 6000; ++i) {
    const AttitudeSight<double> sight{x.head<3>(), x.tail<3>(), {}, i * period};
    const Vector3d torque = command(law, sight).torque_N_m.cwiseMax(-4.).cwiseMin(4.);
    x = runge_kutta([&](double, const State& at) { return with_torque(inertia, inverse, at, torque); },
                    i * period, x, period);
  }
  EXPECT_NEAR(x[0], .000424092791966689, 1e-14);
  EXPECT_NEAR(x[1], .000829196319565271, 1e-14);
  EXPECT_NEAR(x[2], .0013556991800147, 1e-14);
}

// On the surface p' = -F(p) L p, of which p.p decays; off it s' = -J^-1 K sat(s / phi).
TEST(LinearSurface, EquivalentControlKeepsTheSurface) {
  RandomAttitude random;
  for (int i = 0; i < 100; ++i) {
    LinearSurface law;
    law.slope_1_s = Vector3d(random.between(.1, 1), random.between(.1, 1), random.between(.1, 1));
    law.inertia_kg_m2 = random.inertia_kg_m2();
    const Vector3d p = random.vector(1), w = random.vector(1);
    const AttitudeCommand<double> command = law.command<double>({p, w, {}, 0});
    const Vector3d acceleration =
        angular_acceleration(law.inertia_kg_m2, law.inertia_kg_m2.inverse(), w, command.equivalent_N_m);
    EXPECT_LE((acceleration + law.slope_1_s.cwiseProduct(mrp_rate(p, w))).norm(), 1e-13);
    EXPECT_EQ(command.surface_rad_s, w + law.slope_1_s.cwiseProduct(p));
  }
}

TEST(QuaternionFeedback, StableForAnyBodyAndAttitude) {
  RandomAttitude random;
  for (int i = 0; i < 30; ++i) {
    QuaternionFeedback law;
    law.inertia_kg_m2 = random.inertia_kg_m2();
    law.gyroscopic_compensation = i % 3 / 2.;
    State x;
    x << random.vector(.9), random.vector(.05);
    EXPECT_LE(flown(law, law.inertia_kg_m2, x, 150, .05).norm(), 1e-6) << x.transpose();
  }
}

// Wie, Weiss & Arapostathis 1989: with mu = 1, D = d J and K = k J from rest, a rotation about the eigenaxis.
TEST(QuaternionFeedback, TurnsAboutTheEigenaxis) {
  RandomAttitude random;
  QuaternionFeedback law;
  law.inertia_kg_m2 = random.inertia_kg_m2();
  const Vector3d axis = Vector3d(2, -1, 3).normalized();
  State x = State::Zero();
  x.head<3>() = std::tan(2.5 / 4) * axis;
  x = flown(law, law.inertia_kg_m2, x, 8, .01);
  EXPECT_GT(x.head<3>().norm(), .05);
  EXPECT_LE(x.head<3>().cross(axis).norm(), 1e-14);
  EXPECT_LE(x.tail<3>().cross(axis).norm(), 1e-14);
}

TEST(QuaternionFeedback, TorqueIsThatOfTheVectorPart) {
  QuaternionFeedback law;
  law.attitude_gain_1_s2 = 2;
  law.rate_gain_1_s = 3;
  law.inertia_kg_m2 = Vector3d(10, 20, 30).asDiagonal();
  const Vector3d turned(0, 0, std::tan(M_PI / 8));  // 90 deg: qv = sin(45 deg)
  const Vector3d torque = law.command<double>({turned, Vector3d::Zero(), {}, 0}).torque_N_m;
  EXPECT_LE((torque - Vector3d(0, 0, -60 * std::sqrt(.5))).norm(), 1e-13);
  const Vector3d w(.1, .2, .3), gyroscopic = w.cross(law.inertia_kg_m2 * w);
  for (double mu : {0., .5, 1.}) {
    law.gyroscopic_compensation = mu;
    const Vector3d damping = law.command<double>({Vector3d::Zero(), w, {}, 0}).torque_N_m;
    EXPECT_LE((damping - (mu * gyroscopic - 3 * law.inertia_kg_m2 * w)).norm(), 1e-13);
  }
}

TEST(RateDamping, StopsATumblingBody) {
  RandomAttitude random;
  for (int i = 0; i < 10; ++i) {
    const Matrix3d inertia = random.inertia_kg_m2();
    RateDamping law;
    law.damping_N_m_s = Vector3d(20, 30, 40);
    State x;
    x << random.vector(.1), random.vector(.1);
    const Vector3d torque = command<double>(law, {x.head<3>(), x.tail<3>(), {}, 0}).torque_N_m;
    EXPECT_EQ(torque, -law.damping_N_m_s.cwiseProduct(x.tail<3>()));
    EXPECT_LE(flown(law, inertia, x, 200, .05).tail<3>().norm(), 1e-6);
  }
}

TEST(TorqueProgram, ChangesSignAtItsSwitchTimes) {
  TorqueProgram program;
  program.initial_torque_N_m = Vector3d(1, -2, 3);
  program.switch_times_s = {{{.5, 2}, {1}, {}}};
  program.end_s = 3;
  const AttitudeLaw law = program;
  const auto torque = [&](double began_s) {
    AttitudeSight<double> sight{Vector3d::Ones(), Vector3d::Ones(), {}, began_s};
    return Vector3d(command(law, sight).torque_N_m);
  };
  const auto before = [](double t) { return std::nextafter(t, 0.); };

  EXPECT_EQ(torque(0), Vector3d(1, -2, 3));
  EXPECT_EQ(torque(before(.5)), Vector3d(1, -2, 3));
  EXPECT_EQ(torque(.5), Vector3d(-1, -2, 3));
  EXPECT_EQ(torque(.75), Vector3d(-1, -2, 3));
  EXPECT_EQ(torque(1), Vector3d(-1, 2, 3));
  EXPECT_EQ(torque(before(2)), Vector3d(-1, 2, 3));
  EXPECT_EQ(torque(2), Vector3d(1, 2, 3));
  EXPECT_EQ(torque(before(3)), Vector3d(1, 2, 3));
  EXPECT_EQ(torque(3), Vector3d::Zero());
  EXPECT_EQ(torque(100), Vector3d::Zero());

  std::vector<double> changes;
  for (double t = 0; (t = next_change_s(law, t)) < 1e9;) changes.push_back(t);
  EXPECT_EQ(changes, (std::vector<double>{.5, 1, 2, 3}));
  EXPECT_EQ(next_change_s(law, before(2)), 2);
  EXPECT_EQ(next_change_s(law, 3), std::numeric_limits<double>::infinity());
}

TEST(TorqueProgram, NothingHappensAfterItsEnd) {
  TorqueProgram program;
  program.initial_torque_N_m = Vector3d::Ones();
  program.switch_times_s[0] = {1, 5};
  program.end_s = 2;
  EXPECT_EQ(program.next_change_s(1), 2);
  EXPECT_EQ(program.next_change_s(2), std::numeric_limits<double>::infinity());
  EXPECT_EQ(TorqueProgram{}.next_change_s(0), std::numeric_limits<double>::infinity());
}

TEST(AttitudeLaw, TellsWhatItIs) {
  const AttitudeLaw sliding = SlidingMode{}, linear = LinearSurface{}, quaternion = QuaternionFeedback{},
                    damping = RateDamping{}, program = TorqueProgram{};
  EXPECT_STREQ(type_name(sliding), "sliding_mode");
  EXPECT_STREQ(type_name(linear), "linear_surface");
  EXPECT_STREQ(type_name(quaternion), "quaternion_feedback");
  EXPECT_STREQ(type_name(damping), "rate_damping");
  EXPECT_STREQ(type_name(program), "torque_program");
  EXPECT_TRUE(has_surface(sliding) && has_surface(linear));
  EXPECT_FALSE(has_surface(quaternion) || has_surface(damping) || has_surface(program));
  EXPECT_TRUE(tracks(sliding));
  EXPECT_FALSE(tracks(linear) || tracks(quaternion) || tracks(damping) || tracks(program));
  EXPECT_TRUE(is_program(program));
  EXPECT_FALSE(is_program(sliding) || is_program(linear) || is_program(quaternion) || is_program(damping));
  for (const AttitudeLaw& law : {sliding, linear, quaternion, damping})
    EXPECT_EQ(next_change_s(law, 0), std::numeric_limits<double>::infinity());
}

}  // namespace
