// Maneuvers that nobody chose: inertia ratios to 10, any axis, any angle, bounds of any ratio to 10: 300 of
// them, and a thousand where SLEW_THOROUGH is set. Each ends in a plan that arrives, none is slower than
// turning about the eigenaxis, and of a hundred 98 are extremal: a third of them with singular arcs.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <random>
#include <thread>

#include "maneuver_cases.hpp"
#include "server/guidance/planner.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using Eigen::Vector3d;

const std::size_t kProblems = std::getenv("SLEW_THOROUGH") ? 1000 : 300;

// Of a body that can exist: no moment is larger than the two others together.
ManeuverProblem random_problem(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    return Vector3d(normal(random), normal(random), normal(random)).normalized();
  };
  Vector3d moments;
  do {
    for (double& moment : moments) moment = std::pow(10, unit(random));
    std::sort(moments.begin(), moments.end());
  } while (moments[2] > moments[0] + moments[1]);
  const Eigen::Matrix3d axes =
      Eigen::AngleAxisd(2 * std::numbers::pi * unit(random), direction()).toRotationMatrix();
  ManeuverProblem problem;
  problem.plant.inertia_kg_m2 = axes * moments.asDiagonal() * axes.transpose();
  problem.plant.inertia_kg_m2 =
      0.5 * (problem.plant.inertia_kg_m2 + problem.plant.inertia_kg_m2.transpose().eval());
  for (int i = 0; i < 3; ++i) problem.plant.influence_N_m(i, i) = std::pow(10, unit(random));
  problem.final.attitude = euler_parameters_about(direction(), kRadian * (1 + 179 * unit(random)));
  return problem;
}

TEST(RandomManeuvers, NoneIsSlowerThanTheEigenaxis) {
  std::vector<Plan> plans(kProblems);
  std::atomic<std::size_t> next{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 2; ++i)
    threads.emplace_back([&] {
      for (std::size_t k = next++; k < kProblems; k = next++) plans[k] = plan(random_problem(k + 1));
    });
  for (std::thread& thread : threads) thread.join();

  std::size_t extremal = 0, nearly = 0, throttled = 0, levels = 0;
  std::vector<double> gains;
  for (std::size_t k = 0; k < kProblems; ++k) {
    SCOPED_TRACE(k + 1);
    const Plan& found = plans[k];
    EXPECT_TRUE(found.certificate.meets_all) << found.why;
    EXPECT_LE(found.certificate.attitude_error_rad, 1e-6);
    EXPECT_LE(found.time_s, found.certificate.eigenaxis_s * (1 + 1e-9));
    EXPECT_GE(found.time_s, found.certificate.least_s * (1 - 1e-9));
    extremal += found.status == PlanStatus::extremal;
    nearly += found.status == PlanStatus::nearly_extremal;
    throttled += found.certificate.throttled_s > 0;
    for (const auto& values : found.on_off.controls)
      for (const double u : values) levels += std::abs(u) != 1;
    gains.push_back(1 - found.time_s / found.certificate.eigenaxis_s);
  }
  std::nth_element(gains.begin(), gains.begin() + kProblems / 2, gains.end());
  std::printf("extremal %zu, nearly %zu of %zu; throttled %zu, with %zu levels; median gain %.2f %%\n",
              extremal, nearly, kProblems, throttled, levels, 100 * gains[kProblems / 2]);
  RecordProperty("extremal", std::to_string(extremal));
  RecordProperty("median_gain_percent", std::to_string(100 * gains[kProblems / 2]));
  EXPECT_GE(extremal, kProblems * 98 / 100);
  EXPECT_GE(throttled, kProblems / 4);
}

}  // namespace
