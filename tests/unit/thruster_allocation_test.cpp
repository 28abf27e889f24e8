// Allocation against what defines it: the conditions of Karush, Kuhn & Tucker over all sets of thrusters, and
// the cheapest of all bases.
#include "server/actuator/thruster_allocation.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "server/actuator/thruster_matrix.hpp"
#include "server/actuator/torque_authority.hpp"

namespace {

using namespace slew;
using Eigen::Vector3d;

constexpr auto kLeastForce = AllocationMethod::non_negative_least_squares;
constexpr auto kLeastThrust = AllocationMethod::linear_programme;

Thruster mounted(const Vector3d& position, const Vector3d& direction) {
  Thruster thruster;
  thruster.position_m = position;
  thruster.direction = direction.normalized();
  return thruster;
}

Thruster couple(const Vector3d& torque_N_m, double thrust_N) {
  Thruster thruster;
  thruster.couple_N_m = torque_N_m;
  thruster.thrust_N = thrust_N;
  return thruster;
}

// Twelve thrusters on a box: about each axis and each way round two that push against each other.
std::vector<Thruster> symmetric_twelve() {
  std::vector<Thruster> thrusters;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d arm = (1 + 0.2 * axis) * Vector3d::Unit((axis + 1) % 3),
                   push = Vector3d::Unit((axis + 2) % 3);
    for (const int sign : {1, -1}) {
      thrusters.push_back(mounted(arm, sign * push));
      thrusters.push_back(mounted(-arm, -sign * push));
    }
  }
  return thrusters;
}

// Eight at the corners of a box, canted: every one turns about every axis.
std::vector<Thruster> canted_eight() {
  std::vector<Thruster> thrusters;
  for (const int x : {1, -1})
    for (const int y : {1, -1})
      for (const int z : {1, -1})
        thrusters.push_back(
            mounted(Vector3d(1.0 * x, 0.7 * y, 0.5 * z), Vector3d(0.4 * y * z, -0.8 * x * z, 0.3 * x * y)));
  return thrusters;
}

std::vector<Thruster> random_set(std::mt19937& random, std::size_t count) {
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  for (;;) {
    std::vector<Thruster> thrusters;
    for (std::size_t i = 0; i < count; ++i) {
      thrusters.push_back(mounted(vector(), vector()));
      thrusters.back().thrust_N = 0.5 + std::abs(normal(random));
      if (count > 6 && i % 5 == 4) thrusters.back().couple_N_m = vector();
    }
    if (torques_that_cannot_be_made(thrusters).empty()) return thrusters;
  }
}

// Random directions, and the axes, which lie on the edges of cones.
std::vector<Vector3d> torques(std::mt19937& random, int count) {
  std::normal_distribution<double> normal;
  std::vector<Vector3d> all;
  for (int axis = 0; axis < 3; ++axis)
    for (const double size : {2.0, -1e-3}) all.push_back(size * Vector3d::Unit(axis));
  for (int i = 0; i < count; ++i)
    all.push_back(std::pow(10, 3 * normal(random)) *
                  Vector3d(normal(random), normal(random), normal(random)));
  return all;
}

Eigen::VectorXd allocated(const ThrusterAllocation& allocation, std::size_t count, const Vector3d& torque) {
  Eigen::VectorXd thrust(count);
  allocation.allocate(torque, {thrust.data(), count});
  return thrust;
}

// The one set of thrusters whose minimum is feasible and whose multipliers have the right sign.
std::optional<Eigen::VectorXd> by_conditions(const Eigen::MatrixXd& torque_m, const Eigen::MatrixXd& force,
                                             const Vector3d& torque) {
  const int count = static_cast<int>(torque_m.cols());
  Eigen::MatrixXd hessian = force.transpose() * force;
  hessian.diagonal().array() += LeastForce::kOfThrust;
  std::optional<Eigen::VectorXd> best;
  double least = std::numeric_limits<double>::infinity();
  for (unsigned set = 0; set < 1u << count; ++set) {
    std::vector<int> free;
    for (int i = 0; i < count; ++i)
      if (set >> i & 1) free.push_back(i);
    const int n = static_cast<int>(free.size());
    if (n < 3) continue;
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 3, n + 3);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n + 3);
    system.topLeftCorner(n, n) = hessian(free, free);
    system.topRightCorner(n, 3) = torque_m(Eigen::all, free).transpose();
    system.bottomLeftCorner(3, n) = torque_m(Eigen::all, free);
    right.tail(3) = torque;
    const Eigen::VectorXd solution = system.fullPivLu().solve(right);
    if ((system * solution - right).norm() > 1e-9 * torque.norm()) continue;
    Eigen::VectorXd thrust = Eigen::VectorXd::Zero(count);
    for (int i = 0; i < n; ++i) thrust[free[i]] = solution[i];
    const double size = thrust.cwiseAbs().maxCoeff();
    const Eigen::VectorXd multipliers = hessian * thrust + torque_m.transpose() * solution.tail(3);
    if (thrust.minCoeff() < -1e-11 * size || multipliers.minCoeff() < -1e-10 * size) continue;
    const double value = thrust.dot(hessian * thrust);
    if (value < least) least = value, best = thrust;
  }
  return best;
}

// Several minima within rounding may pass as one, so that values are compared, and thrusts where eps lets
// them be told apart.
void expect_least_force(const std::vector<Thruster>& thrusters, const std::vector<Vector3d>& all) {
  const ThrusterAllocation allocation(thrusters, kLeastForce);
  const Eigen::MatrixXd torque_m = torque_matrix_m(thrusters), force = force_matrix(thrusters);
  for (const Vector3d& torque : all) {
    const auto thrust = allocated(allocation, thrusters.size(), torque);
    EXPECT_GE(thrust.minCoeff(), 0);
    EXPECT_LT((torque_m * thrust - torque).norm(), 1e-12 * torque.norm());
    const auto expected = by_conditions(torque_m, force, torque);
    ASSERT_TRUE(expected);
    EXPECT_LT((thrust - *expected).norm(), 1e-7 * expected->norm()) << torque.transpose() << "\n"
                                                                    << thrust.transpose() << "\n"
                                                                    << expected->transpose();
  }
}

TEST(LeastForce, MeetsTheConditionsOfAMinimum) {
  std::mt19937 random(1);
  for (int i = 0; i < 120; ++i) expect_least_force(random_set(random, 4 + i % 6), torques(random, 10));
  expect_least_force(canted_eight(), torques(random, 40));
}

TEST(LeastForce, MeetsThemWhereThrustersAreAlike) {
  std::mt19937 random(2);
  auto doubled = random_set(random, 4);
  doubled.insert(doubled.end(), doubled.begin(), doubled.begin() + 4);
  expect_least_force(doubled, torques(random, 20));
  auto thrusters = symmetric_twelve();
  thrusters.erase(thrusters.begin() + 9, thrusters.end());
  thrusters.push_back(couple({0, 0, -1}, 2));
  expect_least_force(thrusters, torques(random, 20));
}

TEST(LeastForce, OfASymmetricSetIsAPureCouple) {
  std::mt19937 random(3);
  // Exactly where the point reflection of every thruster is another; else to what eps leaves.
  for (const auto& [thrusters, tolerance] : {std::pair{symmetric_twelve(), 1e-14}, {canted_eight(), 1e-5}}) {
    const ThrusterAllocation allocation(thrusters, kLeastForce);
    for (const Vector3d& torque : torques(random, 100)) {
      const auto thrust = allocated(allocation, thrusters.size(), torque);
      EXPECT_LT((torque_matrix_m(thrusters) * thrust - torque).norm(), 1e-14 * torque.norm());
      EXPECT_LT((force_matrix(thrusters) * thrust).norm(), tolerance * torque.norm());
    }
  }
  // The linear programme needs not give one: one thruster costs as much as the two together.
  const auto thrusters = symmetric_twelve();
  const ThrusterAllocation cheapest(thrusters, kLeastThrust);
  EXPECT_NEAR((force_matrix(thrusters) * allocated(cheapest, 12, Vector3d::UnitX())).norm(), 1, 1e-12);
}

TEST(LeastThrust, IsTheCheapestOfAllBases) {
  std::mt19937 random(4);
  for (int i = 0; i < 40; ++i) {
    const auto thrusters = i == 0   ? symmetric_twelve()
                           : i == 1 ? canted_eight()
                                    : random_set(random, 4 + i / 2);
    const int count = static_cast<int>(thrusters.size());
    const ThrusterAllocation allocation(thrusters, kLeastThrust);
    const ThrusterMatrix torque_m = torque_matrix_m(thrusters);
    EXPECT_LE(LeastThrust(torque_m).bases(), 2 * thrusters.size() - 4);
    for (const Vector3d& torque : torques(random, 10)) {
      const auto thrust = allocated(allocation, thrusters.size(), torque);
      EXPECT_GE(thrust.minCoeff(), 0);
      EXPECT_LE((thrust.array() > 0).count(), 3);
      EXPECT_LT((torque_m * thrust - torque).norm(), 1e-12 * torque.norm());
      double least = std::numeric_limits<double>::infinity();
      for (int a = 0; a < count; ++a)
        for (int b = a + 1; b < count; ++b)
          for (int c = b + 1; c < count; ++c) {
            Eigen::Matrix3d basis;
            basis << torque_m.col(a), torque_m.col(b), torque_m.col(c);
            const Vector3d candidate = basis.fullPivLu().solve(torque);
            if ((basis * candidate - torque).norm() > 1e-9 * torque.norm()) continue;
            if (candidate.minCoeff() >= -1e-12 * candidate.norm()) least = std::min(least, candidate.sum());
          }
      EXPECT_NEAR(thrust.sum(), least, 1e-9 * least);
    }
  }
}

// Along great circles, which cross many sets of thrusters; of alike thrusters, and with ties of costs.
TEST(ThrusterAllocation, IsContinuousInTheTorque) {
  std::mt19937 random(5);
  auto alike = symmetric_twelve();
  alike.insert(alike.end(), alike.begin(), alike.begin() + 5);
  for (const auto& thrusters : {symmetric_twelve(), canted_eight(), alike, random_set(random, 16)})
    for (const auto method : {kLeastForce, kLeastThrust}) {
      const ThrusterAllocation allocation(thrusters, method);
      std::normal_distribution<double> normal;
      for (int circle = 0; circle < 6; ++circle) {
        Vector3d a = circle < 3 ? Vector3d(Vector3d::Unit(circle))
                                : Vector3d(normal(random), normal(random), normal(random)).normalized();
        const Vector3d b =
            circle < 3 ? Vector3d(Vector3d::Unit((circle + 1) % 3)) : Vector3d(a.unitOrthogonal());
        const auto at = [&](double angle) {
          return allocated(allocation, thrusters.size(), std::cos(angle) * a + std::sin(angle) * b);
        };
        // Bisection into the steepest part: where there is a jump it stays.
        const int kParts = 500;
        double from = 0, to = 0, largest = 0;
        for (int i = 0; i < kParts; ++i) {
          const double step = 6.5 / kParts;
          const double change = (at((i + 1) * step) - at(i * step)).norm();
          if (change > largest) largest = change, from = i * step, to = (i + 1) * step;
        }
        while (to - from > 1e-10) {
          const double middle = 0.5 * (from + to);
          ((at(middle) - at(from)).norm() > (at(to) - at(middle)).norm() ? to : from) = middle;
        }
        EXPECT_LT((at(to) - at(from)).norm(), 1e-6) << circle << " at " << from;
      }
    }
}

TEST(ThrusterAllocation, TwiceTheTorqueIsTwiceTheThrust) {
  std::mt19937 random(6);
  const auto thrusters = random_set(random, kMaxThrusters);
  for (const auto method : {kLeastForce, kLeastThrust}) {
    const ThrusterAllocation allocation(thrusters, method);
    for (const Vector3d& torque : torques(random, 50)) {
      const auto thrust = allocated(allocation, kMaxThrusters, torque);
      EXPECT_EQ(allocated(allocation, kMaxThrusters, 2 * torque), 2 * thrust);
      EXPECT_LT((torque_matrix_m(thrusters) * thrust - torque).norm(), 1e-12 * torque.norm());
    }
    EXPECT_EQ(allocated(allocation, kMaxThrusters, Vector3d::Zero()).norm(), 0);
  }
}

TEST(ThrusterAllocation, PairsWithoutPosition) {
  std::vector<Thruster> pairs;
  for (int axis = 0; axis < 3; ++axis)
    for (const int sign : {1, -1}) pairs.push_back(couple(sign * 3 * Vector3d::Unit(axis), 0.5));
  for (const auto method : {kLeastForce, kLeastThrust}) {
    const auto thrust = allocated(ThrusterAllocation(pairs, method), 6, {1.5, 0, -6});
    const Eigen::VectorXd expected = Eigen::Vector<double, 6>(0.25, 0, 0, 0, 0, 1);
    EXPECT_LT((thrust - expected).norm(), 1e-15);
  }
}

// Validation refuses such a set; whoever asks all the same gets nothing.
TEST(ThrusterAllocation, WithoutTorqueAboutAnAxis) {
  auto thrusters = symmetric_twelve();
  thrusters.resize(2);
  for (const auto method : {kLeastForce, kLeastThrust})
    EXPECT_EQ(allocated(ThrusterAllocation(thrusters, method), 2, {1, 2, 3}).norm(), 0);
}

TEST(TorqueAuthority, NamesWhatCannotBeMade) {
  EXPECT_TRUE(torques_that_cannot_be_made(symmetric_twelve()).empty());
  EXPECT_TRUE(torques_that_cannot_be_made(canted_eight()).empty());
  EXPECT_EQ(torques_that_cannot_be_made({}).size(), 6u);

  // Without those that turn to -y.
  auto thrusters = symmetric_twelve();
  thrusters.erase(thrusters.begin() + 6, thrusters.begin() + 8);
  EXPECT_EQ(torques_that_cannot_be_made(thrusters), (std::vector<AxisDirection>{{1, -1}}));

  // Two that turn about lines in the x-y plane only: nothing but their own.
  const std::vector<Thruster> two = {couple({1, 1, 0}, 1), couple({-1, 1, 0}, 1)};
  EXPECT_EQ(torques_that_cannot_be_made(two),
            (std::vector<AxisDirection>{{0, 1}, {0, -1}, {1, -1}, {2, 1}, {2, -1}}));

  // A thruster through the centre of mass turns nothing.
  const std::vector<Thruster> through = {mounted({1, 0, 0}, {-1, 0, 0})};
  EXPECT_EQ(torques_that_cannot_be_made(through).size(), 6u);

  // Four directions can be enough.
  const std::vector<Thruster> four = {couple({1, 1, 1}, 1), couple({1, -1, -1}, 1), couple({-1, 1, -1}, 1),
                                      couple({-1, -1, 1}, 1)};
  EXPECT_TRUE(torques_that_cannot_be_made(four).empty());
}

}  // namespace
