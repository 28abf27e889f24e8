// Kim & Crassidis 1998, Eqs. 7-13, at p = (.3, -.2, .4), w = (.02, -.01, .03): m = (-.3585116279,
// .2390077519,
// -.4780155039), u_eq = (-.3889775442, .2910166372, -.9091803116).
#include "server/control/sliding_mode.hpp"

#include <gtest/gtest.h>

#include <unsupported/Eigen/AutoDiff>

#include "random_attitude.hpp"
#include "runge_kutta.hpp"
#include "server/control/mrp_trajectory.hpp"
#include "server/plant/rigid_body.hpp"

namespace {

using namespace slew;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using State = Eigen::Matrix<double, 6, 1>;

const Vector3d kMrp(.3, -.2, .4), kRate(.02, -.01, .03);

SlidingMode published_law() {
  SlidingMode law;
  law.inertia_kg_m2 = Vector3d(125.4, 108.3, 131.1).asDiagonal();
  return law;
}

SlidingMode random_law(RandomAttitude& random) {
  SlidingMode law;
  law.lambda_1_s = Vector3d(-random.between(.1, 2), -random.between(.1, 2), -random.between(.1, 2));
  law.gain_rad_s2 = Vector3d(random.between(.1, 2), random.between(.1, 2), random.between(.1, 2));
  law.boundary_layer_rad_s = random.between(.1, 1);
  law.inertia_kg_m2 = random.inertia_kg_m2();
  return law;
}

void expect_near(const Eigen::MatrixXd& value, const Eigen::MatrixXd& expected, double tolerance) {
  EXPECT_LE((value - expected).cwiseAbs().maxCoeff(), tolerance) << value << "\nnot\n" << expected;
}

TEST(SlidingMode, TorquesAreThePublishedOnes) {
  const AttitudeCommand<double> command = published_law().command<double>({kMrp, kRate, {}, 0});
  expect_near(command.surface_rad_s, Vector3d(.37851162790698, -.24900775193798, .50801550387597), 1e-10);
  expect_near(command.equivalent_N_m, Vector3d(-.38897754418605, .2910166372093, -.90918031162791), 1e-10);
  expect_near(command.torque_N_m - command.equivalent_N_m, Vector3d(-5.27934, 4.55943, -5.51931), 1e-10);
}

TEST(SlidingMode, ManifoldAndItsGradientAreThePublishedOnes) {
  SlidingMode law = published_law();
  expect_near(law.manifold<double>(kMrp, {}), Vector3d(-.35851162790698, .23900775193798, -.47801550387597),
              1e-10);
  Matrix3d gradient;
  gradient << -1.0282891653146, -.11116639625023, .22233279250045,  //
      -.11116639625023, -1.1209278288564, -.14822186166697,         //
      .22233279250045, -.14822186166697, -.89859503635599;
  expect_near(manifold_gradient(law, kMrp), gradient, 1e-10);

  law.lambda_1_s = Vector3d(-.3, -.4, -.5);
  expect_near(law.manifold<double>(kMrp, {}), Vector3d(-.36944895138513, .1394146986359, -.60669430923622),
              1e-10);
  gradient << -.88942552926856, .10740260932068, -.041738696196794,  //
      -.4565915230385, -1.2644216279116, -.23060629648729,           //
      .4105298904499, -.11664474919283, -1.0767279284517;
  expect_near(manifold_gradient(law, kMrp), gradient, 1e-10);
}

TEST(SlidingMode, GradientIsThatOfTheManifold) {
  using Dual = Eigen::AutoDiffScalar<Vector3d>;
  RandomAttitude random;
  for (int i = 0; i < 100; ++i) {
    const SlidingMode law = random_law(random);
    const Vector3d p = random.vector(1.5), w = random.vector(1);
    const Matrix3d gradient = manifold_gradient(law, p);

    Vector3<Dual> dual;
    for (int axis = 0; axis < 3; ++axis) dual[axis] = Dual(p[axis], 3, axis);
    const Vector3<Dual> m = law.manifold<Dual>(dual, MrpReference<Dual>{});
    for (int axis = 0; axis < 3; ++axis)
      expect_near(m[axis].derivatives(), gradient.row(axis).transpose(), 1e-13 * (1 + gradient.norm()));

    const Vector3d rate = law.manifold_rate<double>(p, w, {}, law.manifold<double>(p, {}));
    expect_near(rate, gradient * mrp_rate(p, w), 1e-13 * (1 + rate.norm()));
    const double dt = 1e-6;
    const Vector3d step = dt * mrp_rate(p, w);
    expect_near(rate, (law.manifold<double>(p + step, {}) - law.manifold<double>(p - step, {})) / (2 * dt),
                1e-8 * (1 + rate.norm()));
  }
}

TEST(SlidingMode, CommandIsItsParts) {
  RandomAttitude random;
  for (int i = 0; i < 100; ++i) {
    const SlidingMode law = random_law(random);
    const Vector3d p = random.vector(1), w = random.vector(1);
    const AttitudeCommand<double> command = law.command<double>({p, w, {}, 0});
    const Vector3d equivalent =
        w.cross(law.inertia_kg_m2 * w) + law.inertia_kg_m2 * manifold_gradient(law, p) * mrp_rate(p, w);
    expect_near(command.equivalent_N_m, equivalent, 1e-12 * (1 + equivalent.norm()));
    Vector3d saturated;
    for (int axis = 0; axis < 3; ++axis)
      saturated[axis] = std::min(1., std::max(-1., command.surface_rad_s[axis] / law.boundary_layer_rad_s));
    const Vector3d torque = equivalent - law.inertia_kg_m2 * law.gain_rad_s2.asDiagonal() * saturated;
    expect_near(command.torque_N_m, torque, 1e-12 * (1 + torque.norm()));
  }
}

MrpTrajectory sinusoids() {
  return {MrpSinusoids{{.3, -.2, .1}, {.5, .8, 1.1}, {.1, 1.2, -.7}}};
}

State closed_loop_slope(const SlidingMode& law, const MrpTrajectory& reference, double t, const State& x) {
  const AttitudeSight<double> sight{x.head<3>(), x.tail<3>(), reference.at(t), t};
  State slope;
  slope << mrp_rate(sight.mrp, sight.rate_rad_s),
      angular_acceleration(law.inertia_kg_m2, law.inertia_kg_m2.inverse(), sight.rate_rad_s,
                           law.command(sight).torque_N_m);
  return slope;
}

Vector3d surface(const SlidingMode& law, const MrpTrajectory& reference, double t, const State& x) {
  return law.command<double>({x.head<3>(), x.tail<3>(), reference.at(t), t}).surface_rad_s;
}

// With the body's own inertia Eq. 18 is s' = -K sat(s, eps), whatever the reference does.
TEST(SlidingMode, SurfaceIsApproachedAsItsCorrectionSays) {
  RandomAttitude random;
  const MrpTrajectory references[] = {
      {}, sinusoids(), {EigenaxisRotation{Vector3d(1, 2, 2) / 3, 2.1, 0, 0, 5}}};
  for (const MrpTrajectory& reference : references)
    for (int i = 0; i < 20; ++i) {
      const SlidingMode law = random_law(random);
      State x;
      x << random.vector(.6), random.vector(.5);
      const double t = random.between(.5, 4.5), dt = 1e-4;
      const auto slope = [&](double at, const State& state) {
        return closed_loop_slope(law, reference, at, state);
      };
      const Vector3d s = surface(law, reference, t, x);
      const Vector3d rate = (surface(law, reference, t + dt, runge_kutta(slope, t, x, dt)) -
                             surface(law, reference, t - dt, runge_kutta(slope, t, x, -dt))) /
                            (2 * dt);
      for (int axis = 0; axis < 3; ++axis) {
        const double ratio = s[axis] / law.boundary_layer_rad_s;
        if (std::abs(std::abs(ratio) - 1) < 1e-2) continue;  // the corner lies within the difference
        EXPECT_NEAR(rate[axis], -law.gain_rad_s2[axis] * std::clamp(ratio, -1., 1.), 1e-6);
      }
    }
}

TEST(SlidingMode, ErrorDecaysWithLambdaOnTheSurface) {
  RandomAttitude random;
  SlidingMode law = random_law(random);
  law.lambda_1_s = Vector3d(-.3, -.6, -.9);
  for (const MrpTrajectory& reference : {MrpTrajectory{}, sinusoids()}) {
    const MrpReference<double> began = reference.at(0);
    const Vector3d error(.4, -.2, .3);
    State x;
    x.head<3>() = began.mrp + error;
    x.tail<3>() = law.manifold<double>(x.head<3>(), began);
    const double step = 2e-3;
    for (int i = 0; i < 4000; ++i) {
      x = runge_kutta([&](double t, const State& at) { return closed_loop_slope(law, reference, t, at); },
                      i * step, x, step);
      if (i % 500 != 499) continue;
      const double t = (i + 1) * step;
      expect_near(x.head<3>() - reference.at(t).mrp,
                  (law.lambda_1_s * t).array().exp().matrix().cwiseProduct(error), 1e-10);
    }
  }
}

}  // namespace
