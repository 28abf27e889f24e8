// Kim & Crassidis 1998, Eqs. 28-40, with all poles at -10/s: to a step of disturbance the estimate answers
// with 1 - exp(-10 t) (1 - 20 t + 50 t^2): 1.1839397, 1.1353353, .9764172 at .1, .2, .5 s; K1 = 114 (30, 300,
// 1000).
#include "server/estimation/disturbance_observer.hpp"

#include <gtest/gtest.h>

#include "random_attitude.hpp"
#include "runge_kutta.hpp"
#include "server/estimation/sampled_disturbance_observer.hpp"

namespace {

using namespace slew;
using Eigen::Matrix3d;
using Eigen::Vector3d;

DisturbanceObserver published_observer() {
  DisturbanceObserver observer;
  observer.inertia_kg_m2 = 114 * Matrix3d::Identity();
  return observer;
}

using Columns = Matrix3d;  // Q, a column for each of 1, t, t^2
Columns columns(const ObserverState<double>& q) {
  Columns matrix;
  matrix << q[0], q[1], q[2];
  return matrix;
}
ObserverState<double> state(const Columns& q) {
  return {q.col(0), q.col(1), q.col(2)};
}

/// Q after a step of the observer as printed, s and input being functions of the time.
template <typename Surface, typename Input>
Columns stepped(const DisturbanceObserver& observer, const Columns& q, double t, double step,
                const Surface& surface, const Input& input) {
  return runge_kutta(
      [&](double at, const Columns& x) {
        const ObserverState<double> z = estimated_disturbance<double>(observer, state(x), surface(at));
        return columns(observer_slope<double>(observer, z, input(at)));
      },
      t, q, step);
}

TEST(DisturbanceObserver, GainsAndPolesAreThePublishedOnes) {
  const DisturbanceObserver observer = published_observer();
  const ObserverState<double> zero = state(Columns::Zero());
  const ObserverState<double> gain = estimated_disturbance<double>(observer, zero, Vector3d::UnitZ());
  EXPECT_EQ(gain[0], Vector3d(0, 0, 3420));
  EXPECT_EQ(gain[1], Vector3d(0, 0, 34200));
  EXPECT_EQ(gain[2], Vector3d(0, 0, 114000));

  Matrix3d m;  // D + K0 of one axis
  for (int i = 0; i < 3; ++i) {
    ObserverState<double> z = zero;
    z[i] = Vector3d::UnitX();
    const ObserverState<double> slope = observer_slope<double>(observer, z, Vector3d::Zero());
    m.col(i) << slope[0].x(), slope[1].x(), slope[2].x();
  }
  const double minors = (m.trace() * m.trace() - (m * m).trace()) / 2;
  EXPECT_EQ(-m.trace(), 30);
  EXPECT_EQ(minors, 300);
  EXPECT_DOUBLE_EQ(-m.determinant(), 1000);
}

TEST(DisturbanceObserver, AnswersToAStepAsPublished) {
  const DisturbanceObserver observer = published_observer();
  const Vector3d disturbance(0, 0, .05), torque(.3, -.2, .1);
  const auto surface = [&](double t) { return Vector3d((disturbance + torque) / 114 * t); };
  Columns q = columns(initial_observer_state<double>(observer, surface(0)));
  const double step = 1e-3;
  for (int i = 0; i <= 500; ++i) {
    const double t = i * step;
    const Vector3d estimate = estimated_disturbance<double>(observer, state(q), surface(t))[0];
    const double answer = 1 - std::exp(-10 * t) * (1 - 20 * t + 50 * t * t);
    EXPECT_LE((estimate - answer * disturbance).norm(), 1e-9) << t;
    const double published = i == 100   ? 1.1839397206
                             : i == 200 ? 1.1353352832
                             : i == 500 ? .9764171855
                                        : answer;
    EXPECT_NEAR(estimate.z() / .05, published, 1e-8);
    q = stepped(observer, q, t, step, surface, [&](double) { return torque; });
  }
}

TEST(SampledDisturbanceObserver, ExactWhereTheSurfaceFunctionIsStraight) {
  RandomAttitude random;
  for (int i = 0; i < 20; ++i) {
    DisturbanceObserver observer;
    observer.pole_rad_s = random.between(1, 20);
    observer.inertia_kg_m2 = random.inertia_kg_m2();
    const double period = random.between(.01, .3);
    const Vector3d began = random.vector(.1), ended = random.vector(.1), input = random.vector(2);
    Columns q;
    q << random.vector(10), random.vector(100), random.vector(1000);
    const ObserverState<double> next =
        SampledDisturbanceObserver(observer, period).step(state(q), began, ended, input);
    const double size = q.norm() + estimated_disturbance<double>(observer, state(q), began)[2].norm();
    const int steps = 1000;
    for (int k = 0; k < steps; ++k)
      q = stepped(
          observer, q, k * period / steps, period / steps,
          [&](double t) { return Vector3d(began + t / period * (ended - began)); },
          [&](double) { return input; });
    EXPECT_LE((columns(next) - q).norm(), 1e-10 * size);
  }
}

TEST(SampledDisturbanceObserver, AnswersToAStepAsPublishedWhateverThePeriod) {
  const DisturbanceObserver observer = published_observer();
  const Vector3d disturbance(0, 0, .05), torque(.3, -.2, .1), slope = (disturbance + torque) / 114;
  for (double period : {.1, .02}) {
    const SampledDisturbanceObserver sampled(observer, period);
    ObserverState<double> q = initial_observer_state<double>(observer, Vector3d::Zero());
    for (double t = 0; t < 2; t += period) {
      const double answer = 1 - std::exp(-10 * t) * (1 - 20 * t + 50 * t * t);
      EXPECT_LE((sampled.estimate(q, slope * t)[0] - answer * disturbance).norm(), 1e-12) << t;
      q = sampled.step(q, slope * t, slope * (t + period), torque);
    }
  }
}

TEST(SampledDisturbanceObserver, NothingIsEstimatedAtFirst) {
  RandomAttitude random;
  const DisturbanceObserver observer = published_observer();
  const Vector3d surface = random.vector(.1);
  const ObserverState<double> z = SampledDisturbanceObserver(observer, .01)
                                      .estimate(initial_observer_state<double>(observer, surface), surface);
  EXPECT_TRUE(columns(z).isZero(0));
}

}  // namespace
