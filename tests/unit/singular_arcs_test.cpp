// A body with a singular arc: where its control may be throttled the plan is an extremal, and 0.8 us shorter
// than with 157 switches along the arc; thrusters are left with these.
#include "server/guidance/singular_arcs.hpp"

#include <gtest/gtest.h>

#include "maneuver_cases.hpp"
#include "server/guidance/planner.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using Eigen::Vector3d;

TEST(SingularArcs, AreFlownThrottled) {
  const ManeuverProblem problem = with_singular_arc();
  const Plan found = plan(problem);
  EXPECT_EQ(found.status, PlanStatus::extremal) << found.why;
  EXPECT_NE(found.why.find("throttled"), std::string::npos);
  EXPECT_TRUE(found.certificate.meets_all);
  EXPECT_NEAR(found.time_s, 2.06253954, 1e-8);
  EXPECT_NEAR(found.certificate.throttled_s / found.time_s, 0.371, 1e-3);
  EXPECT_LE(found.certificate.worst_sign, 1e-5);
  EXPECT_LE(found.certificate.saving_s, 1e-7);
  EXPECT_LE(found.certificate.residual, 1e-8);
  for (const std::size_t bang : {0u, 2u})
    for (const double u : found.on_off.controls[bang]) EXPECT_EQ(std::abs(u), 1);
  EXPECT_FALSE(torque_program(found, problem.plant).has_value());
  const Plan again = plan(problem);
  EXPECT_EQ(found.on_off.switch_times_s, again.on_off.switch_times_s);
  EXPECT_EQ(found.on_off.controls, again.on_off.controls);
}

TEST(SingularArcs, OnOffThrustersSwitchOftenAlongThem) {
  ManeuverProblem problem = with_singular_arc();
  const double throttled_s = plan(problem).time_s;
  problem.plant.is_on_off = true;
  const Plan found = plan(problem);
  EXPECT_EQ(found.status, PlanStatus::nearly_extremal);
  EXPECT_NE(found.why.find("singular arc"), std::string::npos);
  EXPECT_GT(found.on_off.switches(), 100u);
  EXPECT_EQ(found.certificate.throttled_s, 0);
  for (const auto& values : found.on_off.controls)
    for (const double u : values) EXPECT_EQ(std::abs(u), 1);
  EXPECT_GT(found.time_s, throttled_s);
  EXPECT_LT(found.time_s, throttled_s * (1 + 5e-6));
}

// -d(S'')/du: S'' jumps at a switch from one level to the next, where nothing else does.
TEST(SingularArcs, LegendreClebschIsWhatTheSwitchingFunctionDoes) {
  const ManeuverProblem problem = with_singular_arc();
  const Plan found = plan(problem);
  const ManeuverBody body(problem.plant);
  const SwitchTimeProgram program(problem, body, found.on_off);
  const SignTest test = test_signs(problem, body, program, found.on_off, false, 40000);
  EXPECT_NEAR(test.legendre_clebsch, found.certificate.legendre_clebsch, 0.01);
  double least = std::numeric_limits<double>::infinity();
  const auto& times = found.on_off.switch_times_s[1];
  const auto& values = found.on_off.controls[1];
  for (std::size_t k = 2; k + 2 < times.size(); ++k) {
    if (std::abs(values[k + 1] - values[k]) > 0.5) continue;  // there another control switches
    const auto at = std::lower_bound(test.times_s.begin(), test.times_s.end(), times[k] - 1e-12);
    const auto p = at - test.times_s.begin();
    const auto second = [&](std::ptrdiff_t step) {
      const auto t = [&](std::ptrdiff_t i) { return test.times_s[static_cast<std::size_t>(p + i * step)]; };
      const auto s = [&](std::ptrdiff_t i) {
        return test.switching[static_cast<std::size_t>(p + i * step)][1];
      };
      return 2 * ((s(2) - s(1)) / (t(2) - t(1)) - (s(1) - s(0)) / (t(1) - t(0))) / (t(2) - t(0));
    };
    least = std::min(least, -(second(12) - second(-12)) / (values[k + 1] - values[k]));
  }
  EXPECT_NEAR(least * found.time_s * found.time_s / test.legendre_clebsch, 1, 0.15);
}

TEST(SingularArcs, ArePutInWithTheControlsMeans) {
  const RigidManeuverPlant plant;
  OnOffProgram program{{{1, -1, 1, -1, 1}, {1}, {1}}, {{1, 2, 4, 5}, {}, {}}, 10};
  throttle(plant, {0, 1, 5}, 4, ArcEnds::alike, program);
  ASSERT_EQ(program.controls[0].size(), 6u);
  EXPECT_EQ(program.switch_times_s[0], (std::vector<double>{1, 2, 3, 4, 5}));
  EXPECT_NEAR(program.controls[0][1], program.controls[0][4], 1e-12);  // as the control, the same both ways
  EXPECT_LT(program.controls[0][1], program.controls[0][2]);
  // Levels keep their means, whatever the pieces.
  const OnOffProgram before = program;
  throttle(plant, {0, 1, 5}, 3, ArcEnds::free, program);
  EXPECT_EQ(program.switch_times_s[0], (std::vector<double>{1, 2, 4, 5}));
  EXPECT_NEAR(program.controls[0][2], 0.5 * (before.controls[0][2] + before.controls[0][3]), 1e-12);
}

TEST(SingularArcs, EndWhereLevelsReachABound) {
  const RigidManeuverPlant plant;
  const OnOffProgram program{{{1, 0.9999, 0.5, -1}, {1}, {1}}, {{1, 2, 4}, {}, {}}, 5};
  const OnOffProgram saturated = with_saturated_levels(plant, program, 1e-3);
  EXPECT_EQ(saturated.controls[0], (std::vector<double>{1, 1, 0.5, -1}));
  const OnOffProgram switching = without_lone_levels(plant, saturated);
  EXPECT_EQ(switching.controls[0], (std::vector<double>{1, 1, 1, -1, -1}));
  EXPECT_NEAR(switching.switch_times_s[0][2], 3.5, 1e-12);
}

}  // namespace
