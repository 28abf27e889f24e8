// What a plan makes of a body, between the knots of its table: p_d, p_d' and p_d'' as SUNDIALS flies them.
#include "server/guidance/planned_motion.hpp"

#include <gtest/gtest.h>

#include "maneuver_cases.hpp"
#include "server/guidance/modal_surrogate.hpp"
#include "server/guidance/plan_certificate.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using Eigen::Vector3d;

void expect_table_follows(const ManeuverProblem& problem, const ControlHistory& history, double tolerance) {
  const MrpTable table = planned_motion(problem, history);
  EXPECT_LT(table.at(history.time_s - 1e-9, history.time_s - 1e-9).mrp.norm(), 1e-5);
  std::vector<double> middles_s;
  for (std::size_t k = 1; k < table.knots.size(); ++k)
    middles_s.push_back(0.5 * (table.knots[k - 1].t_s + table.knots[k].t_s));
  const auto states = fly_controls(problem, history, middles_s);
  double attitude = 0, rate = 0;
  for (std::size_t k = 0; k < middles_s.size(); ++k) {
    const MrpReference<double> there = table.at(middles_s[k], middles_s[k]);
    const auto q = euler_parameter_product<double>(euler_parameter_conjugate(problem.final.attitude),
                                                   states[k].attitude.normalized());
    const Vector3d p = mrp<double>(q), shadow = mrp<double>(Vector4<double>(-q));
    attitude = std::max(attitude, std::min((there.mrp - p).norm(), (there.mrp - shadow).norm()));
    const Vector3d w = rate_of_mrp_rate<double>(there.mrp, there.rate_1_s);
    rate = std::max(rate, (w - states[k].rate_rad_s).norm());
  }
  EXPECT_LE(attitude, tolerance);
  EXPECT_LE(rate, 100 * tolerance);
}

TEST(PlannedMotion, FollowsWhatIsFlown) {
  for (const auto& problem : {sphere(90), reorientation(), floating(AstrexThrusters::two_hundred_lbf),
                              on_pedestal(AstrexThrusters::two_hundred_lbf), with_singular_arc()})
    expect_table_follows(problem, plan(problem), 1e-9);
  const auto four = smooth(floating(AstrexThrusters::two_hundred_lbf), {1, 2, 1});
  expect_table_follows(four, plan(four), 1e-9);
}

// p_d'' jumps at a switch: a step that ends there sees what was before, one that begins there what is after.
TEST(PlannedMotion, HasTwoSidesWhereATorqueJumps) {
  const auto problem = sphere(90);
  const Plan found = plan(problem);
  const MrpTable table = planned_motion(problem, found);
  ASSERT_EQ(table.jumps_s.size(), found.on_off.switches() + 2);
  const double at_s = table.jumps_s[1];
  const Vector3d before = table.at(at_s, 0.5 * at_s).acceleration_1_s2;
  const Vector3d after = table.at(at_s, at_s).acceleration_1_s2;
  EXPECT_GT((after - before).norm(), 0.1);
  EXPECT_LE((table.at(at_s + 1e-15, 0.5 * at_s).acceleration_1_s2 - before).norm(), 1e-9);
  EXPECT_LE((table.at(at_s - 1e-9, 0.5 * at_s).acceleration_1_s2 - before).norm(), 1e-6);
  EXPECT_EQ(table.next_jump_s(at_s), table.jumps_s[2]);
}

TEST(PlannedMotion, RestsBeforeAndAfter) {
  const MrpTable table = planned_motion(sphere(90), plan(sphere(90)));
  EXPECT_EQ(table.at(9, 9).rate_1_s, Vector3d::Zero());
  EXPECT_EQ(table.at(9, 9).mrp, table.knots.back().before.mrp);
}

// A step of acceleration a makes an undamped mode swing between 0 and -2 a / W^2, one of a whole number of
// its periods leaves nothing, one of half a period more leaves 2 a / W^2.
TEST(ModalSurrogate, ClosedForms) {
  ManeuverProblem problem;
  problem.final.attitude = euler_deg(0, 0, 10);
  ControlHistory history;
  history.on_off.controls = {{0.0}, {0.0}, {1.0}};
  history.on_off.switch_times_s = {{}, {}, {}};
  const double W = 20;
  const SurrogateMode mode{W, 0, Vector3d::UnitZ()};
  for (const double periods : {5.0, 5.5}) {
    history.time_s = history.on_off.end_s = periods * 2 * std::numbers::pi / W;
    const auto response = surrogate_responses(problem, history, {mode}).front();
    EXPECT_NEAR(response.peak_rad, 2 / (W * W), 1e-4 / (W * W));
    EXPECT_NEAR(response.residual_rad, periods == 5 ? 0 : 2 / (W * W), 1e-9);
  }
  const auto rows = surrogate_histories(problem, history, {mode}, {0, std::numbers::pi / W});
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_NEAR(rows[1][0], -2 / (W * W), 1e-9);
  // About an axis that does not turn nothing is driven.
  EXPECT_EQ(surrogate_responses(problem, history, {{W, 0, Vector3d::UnitX()}}).front().peak_rad, 0);
}

}  // namespace
