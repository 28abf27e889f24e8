// From a request with guidance to a maneuver that is flown: Vadali, Singh & Carter 1993, 17.97 s and 5.826 s;
// Kim & Crassidis 1998, Table 1, 3.2431 s.
#include "server/experiment/planning.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "tests/unit/attitude_requests.hpp"

namespace slew {
namespace {

using nlohmann::json;
using test::prepared;
using test::refused_at;

using Pointers = std::vector<std::string>;

class Ignore final : public SampleSink {
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

RunReport flown(Run& run) {
  Ignore ignore;
  while (run.advance(std::numeric_limits<double>::infinity(), 1 << 20, ignore) == RunStatus::running) {
  }
  return run.report();
}

struct Flown {
  json plan;
  RunReport report;
  Verification second;
};

Flown planned_and_flown(const json& request) {
  Prepared made = prepared(request);
  if (!made.planning) {
    ADD_FAILURE() << "nothing to plan";
    return {};
  }
  const json plan = plan_maneuver(*made.planning);
  const auto failure = adopt_plan(made, plan);
  EXPECT_FALSE(failure) << failure->sentence;
  const auto run = make_run(made), other = make_verification(made);
  const RunReport report = flown(*run);
  return {plan, report, compare(report, flown(*other))};
}

double worst(const std::vector<double>& differences) {
  double most = 0;
  for (const double one : differences) most = std::max(most, std::abs(one));
  return most;
}

void expect_arrives(const Flown& flown, double error_rad) {
  EXPECT_FALSE(flown.report.failure);
  EXPECT_LE(flown.report.metrics.final_error_rad, error_rad);
  EXPECT_TRUE(flown.second.same_event_sequence);
  EXPECT_LE(worst(flown.second.final_state_difference), 1e-8);
}

json preset(const std::string& name, const json& changes = json::object()) {
  json request = changes;
  request["preset"] = name;
  return request;
}

// Unit sphere, 90 deg about z.
json sphere(const json& changes = json::object()) {
  return preset("kim-crassidis-1998/planned-90deg", changes);
}

TEST(Planning, PlansAreFlownOpenLoop) {
  const Flown slew = planned_and_flown(preset("kim-crassidis-1998/planned-180deg"));
  EXPECT_NEAR(slew.plan.at("time_s").get<double>(), 3.24308328, 2e-5);
  EXPECT_EQ(slew.plan.at("status"), "extremal");
  expect_arrives(slew, 1e-6);
  EXPECT_EQ(slew.report.metrics.residual_rate_rad_s < 1e-6, true);
  const Flown smooth = planned_and_flown(preset("vadali-singh-carter-1993/three-switch-200-lbf"));
  EXPECT_NEAR(smooth.plan.at("time_s").get<double>(), 17.971289, 1e-4);
  expect_arrives(smooth, 1e-6);
  // Air: of the flight as of the plan.
  EXPECT_NEAR(*smooth.report.metrics.gas_volume_m3, smooth.plan.at("consumption").at("value").get<double>(),
              1e-6);
  EXPECT_NEAR(*smooth.report.metrics.gas_volume_m3 / 0.028316846592, 361.974, 0.05);
}

TEST(Planning, ValvesFlyAnOnOffPlan) {
  const Flown slew = planned_and_flown(preset("vadali-singh-carter-1993/on-off-200-lbf"));
  EXPECT_NEAR(slew.plan.at("time_s").get<double>(), 5.826023627, 1e-6);
  expect_arrives(slew, 1e-6);
  EXPECT_NEAR(*slew.report.metrics.gas_volume_m3 / 0.028316846592, 1109.2749, 0.05);
  EXPECT_EQ(slew.report.metrics.firings.total, 8u);
  // Late valves shift the whole maneuver; what they leave is small against what it turned by, and not
  // nothing.
  const Flown late = planned_and_flown(preset(
      "vadali-singh-carter-1993/on-off-200-lbf",
      {{"actuator", {{"on_delay_s", 0.02}, {"off_delay_s", 0.02}, {"rise_s", 0.01}, {"fall_s", 0.01}}}}));
  EXPECT_LE(late.report.metrics.final_error_rad, 0.01);
  const Flown uneven =
      planned_and_flown(preset("vadali-singh-carter-1993/on-off-200-lbf",
                               {{"actuator", {{"on_delay_s", 0.02}, {"off_delay_s", 0.05}}}}));
  EXPECT_GT(uneven.report.metrics.final_error_rad, 1e-3);
}

// A body whose second control has a singular arc (tests/unit/maneuver_cases.hpp).
json with_singular_arc(const json& actuator) {
  return sphere({{"plant", {{"inertia_kg_m2", {{1.9, 0.2, 0}, {0.2, 2.4, 0.3}, {0, 0.3, 1.8}}}}},
                 {"maneuver", {{"final_attitude", {{"axis", {0.1, -0.8, 0.6}}, {"angle_deg", 109}}}}},
                 {"actuator", actuator}});
}

TEST(Planning, AnIdealTorqueIsThrottledAlongASingularArc) {
  const Flown slew = planned_and_flown(
      with_singular_arc({{"type", "ideal_torque"}, {"maximum_torque_N_m", {1.7, 4.9, 1.1}}}));
  EXPECT_EQ(slew.plan.at("status"), "extremal");
  EXPECT_NEAR(slew.plan.at("time_s").get<double>(), 2.06253954, 1e-7);
  EXPECT_GT(slew.plan.at("certificate").at("throttled_s").get<double>(), 0.7);
  EXPECT_GT(slew.plan.at("certificate").at("legendre_clebsch").get<double>(), 0);
  expect_arrives(slew, 1e-6);
  // A picture's controls are the levels.
  const Prepared made =
      prepared(with_singular_arc({{"type", "ideal_torque"}, {"maximum_torque_N_m", {1.7, 4.9, 1.1}}}));
  const json curves = plan_curves(*made.planning, slew.plan);
  int between = 0;
  for (const json& u : curves.at("controls")) between += std::abs(u[1].get<double>()) < 0.95;
  EXPECT_GT(between, 300);
}

TEST(Planning, ThrustersSwitchOftenAlongASingularArc) {
  const Flown slew = planned_and_flown(
      with_singular_arc({{"type", "thruster_couples"},
                         {"maximum_torque_N_m", nullptr},
                         {"influence_N_m", {{1.7, 0, 0}, {0, 4.9, 0}, {0, 0, 1.1}}},
                         {"modulator", {{"type", "schmitt_trigger"}, {"on", 0.5}, {"off", 0.25}}}}));
  EXPECT_EQ(slew.plan.at("status"), "nearly_extremal");
  EXPECT_EQ(slew.plan.at("certificate").at("throttled_s"), 0);
  EXPECT_TRUE(slew.plan.at("certificate").at("legendre_clebsch").is_null());
  EXPECT_GT(slew.plan.at("switches").get<int>(), 100);
  for (const json& values : slew.plan.at("controls").at("values"))
    for (const json& u : values) EXPECT_EQ(std::abs(u.get<double>()), 1);
  EXPECT_LE(slew.report.metrics.final_error_rad, 1e-6);
}

// The paper's digits, flown.
TEST(Planning, GivenControlsAreFlownAsTheyAre) {
  const Prepared made = prepared(preset("vadali-singh-carter-1993/three-switch-200-lbf-as-printed"));
  EXPECT_FALSE(made.awaits_plan());
  const RunReport report = flown(*make_run(made));
  const json plan = json::parse(made.plan);
  EXPECT_EQ(plan.at("status"), "given");
  EXPECT_NEAR(plan.at("certificate").at("attitude_error_rad").get<double>(), report.metrics.final_error_rad,
              1e-6);
  EXPECT_NEAR(report.metrics.final_error_rad * 180 / M_PI, 0.02214, 1e-4);
  const Flown on_off =
      planned_and_flown(sphere({{"guidance",
                                 {{"type", "given_controls"},
                                  {"family", nullptr},
                                  {"time_s", 2},
                                  {"controls",
                                   {{"type", "on_off"},
                                    {"sequences", {{0}, {0}, {1, 0, -1}}},
                                    {"switch_times_s", {json::array(), json::array(), {0.5, 1.5}}}}}}}}));
  // 0.5 s at 1 rad/s^2, 1 s at 0.5 rad/s, and back.
  EXPECT_NEAR(M_PI / 2 - on_off.report.metrics.final_error_rad, 0.75, 1e-9);
  EXPECT_LE(on_off.report.metrics.residual_rate_rad_s, 1e-12);
}

TEST(Planning, ADocumentHoldsItsControlsToTheBit) {
  for (const char* name :
       {"vadali-singh-carter-1993/on-off-200-lbf", "vadali-singh-carter-1993/four-switch-200-lbf",
        "vadali-singh-carter-1993/ground-impulses-200-lbf"}) {
    SCOPED_TRACE(name);
    Prepared made = prepared(preset(name));
    const json plan = plan_maneuver(*made.planning);
    const ControlHistory once = controls_of(plan), again = controls_of(json::parse(plan.dump()));
    EXPECT_EQ(once.time_s, again.time_s);
    EXPECT_EQ(once.parameters, again.parameters);
    EXPECT_EQ(once.on_off.switch_times_s, again.on_off.switch_times_s);
    for (double t = 0; t < once.time_s; t += once.time_s / 37)
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_EQ(control_of(once, i, -1, 1, t), control_of(again, i, -1, 1, t));
    // And flown from either, the same bits.
    Prepared other = made;
    ASSERT_FALSE(adopt_plan(made, plan) || adopt_plan(other, json::parse(plan.dump())));
    EXPECT_EQ(flown(*make_run(made)).digest, flown(*make_run(other)).digest);
  }
}

TEST(Planning, TheLongWayRoundIsNotTaken) {
  const Flown slew = planned_and_flown(
      sphere({{"maneuver",
               {{"initial_attitude",
                 {{"type", "rotation"}, {"value", nullptr}, {"axis", {0, 0, 1}}, {"angle_deg", 200}}},
                {"final_attitude",
                 {{"type", "mrp"}, {"value", {0, 0, 0}}, {"axis", nullptr}, {"angle_deg", nullptr}}}}}}));
  EXPECT_LT(slew.plan.at("time_s").get<double>(), 3.2431);
  expect_arrives(slew, 1e-6);
}

TEST(Planning, FromRateToRate) {
  const Flown slew = planned_and_flown(
      sphere({{"maneuver", {{"initial_rate_deg_s", {5, -3, 8}}, {"final_rate_deg_s", {0, 10, -5}}}},
              {"simulation", {{"duration_s", 4}}},
              {"outputs", {{"at_s", json::array()}}}}));
  Prepared made =
      prepared(sphere({{"maneuver", {{"initial_rate_deg_s", {5, -3, 8}}, {"final_rate_deg_s", {0, 10, -5}}}},
                       {"simulation", {{"duration_s", slew.plan.at("time_s")}}}}));
  ASSERT_FALSE(adopt_plan(made, slew.plan));
  const RunReport report = flown(*make_run(made));
  EXPECT_LE(report.metrics.final_error_rad, 1e-6);
  EXPECT_NEAR(report.metrics.residual_rate_rad_s * 180 / M_PI, std::sqrt(125.0), 1e-4);
}

TEST(Planning, SingleThrustersArePlannedAndAllocated) {
  const json changes = {{"actuator",
                         {{"type", "thruster_set"},
                          {"maximum_torque_N_m", nullptr},
                          {"thrusters", test::twelve_thrusters()},
                          {"thrust_N", 1},
                          {"modulator", {{"type", "schmitt_trigger"}, {"on", 0.5}, {"off", 0.25}}},
                          {"allocation", {{"type", "linear_programme"}}}}}};
  const Flown slew = planned_and_flown(sphere(changes));
  // Two newtons at a metre about each axis: sqrt 2 faster than one newton metre.
  EXPECT_NEAR(slew.plan.at("time_s").get<double>(), 2.42111655 / std::sqrt(2.0), 2e-5);
  EXPECT_LE(slew.report.metrics.final_error_rad, 1e-5);
}

// ---- feedback around a plan

json follows(const json& changes = json::object()) {
  json request = {{"preset", "vadali-singh-carter-1993/on-off-200-lbf"},
                  {"maneuver", {{"reference", {{"type", "planned"}}}}},
                  {"guidance", {{"authority", 0.75}}},
                  {"controller",
                   {{"type", "sliding_mode"},
                    {"lambda_1_s", {-2, -2, -2}},
                    {"gain_rad_s2", {0.15, 0.15, 0.15}},
                    {"boundary_layer_rad_s", 0.01},
                    {"evaluation", {{"type", "continuous"}}}}},
                  {"actuator", {{"type", "ideal_torque"}, {"modulator", nullptr}}},
                  {"simulation", {{"duration_s", 15}}}};
  request.merge_patch(changes);
  return request;
}

TEST(Planning, ALawFollowsAPlanExactlyWhereNothingDisturbs) {
  const Flown slew = planned_and_flown(follows({{"simulation", {{"duration_s", 6}}}}));
  // On the reference there is nothing to correct: the flight is the plan.
  EXPECT_LE(slew.second.final_state_difference.empty() ? 1 : worst(slew.second.final_state_difference), 1e-7);
  const double left = slew.report.metrics.final_error_rad;
  Prepared alone = prepared(preset("vadali-singh-carter-1993/on-off-200-lbf",
                                   {{"guidance", {{"authority", 0.75}}},
                                    {"actuator", {{"type", "ideal_torque"}, {"modulator", nullptr}}},
                                    {"simulation", {{"duration_s", 6}}}}));
  ASSERT_FALSE(adopt_plan(alone, slew.plan));
  EXPECT_NEAR(left, flown(*make_run(alone)).metrics.final_error_rad, 1e-6);
}

TEST(Planning, FeedbackSurvivesAWrongInertiaAndDisturbances) {
  json plant;
  const json* preset_of = nullptr;
  const Prepared sound = prepared(follows());
  const json resolved = json::parse(sound.resolved);
  preset_of = &resolved.at("plant").at("inertia_kg_m2");
  json heavier = *preset_of;
  for (json& row : heavier)
    for (json& entry : row) entry = 1.1 * entry.get<double>();
  const json wrong = {{"plant", {{"inertia_kg_m2", heavier}}},
                      {"guidance", {{"inertia_kg_m2", *preset_of}}},
                      {"disturbances", {{{"type", "body_constant"}, {"torque_N_m", {40, -30, 1}}}}}};
  json closed = follows(wrong);
  closed["controller"]["inertia_kg_m2"] = *preset_of;
  const Flown followed = planned_and_flown(closed);
  EXPECT_LE(followed.report.metrics.final_error_rad * 180 / M_PI, 0.2);
  json open = wrong;
  open["preset"] = "vadali-singh-carter-1993/on-off-200-lbf";
  open["guidance"]["authority"] = 0.75;
  open["actuator"] = {{"type", "ideal_torque"}, {"modulator", nullptr}};
  const Flown alone = planned_and_flown(open);
  EXPECT_GT(alone.report.metrics.final_error_rad * 180 / M_PI, 10);
}

// ---- searches that are cut short

TEST(Planning, ATimeBudgetThatIsTooSmallSaysSo) {
  Prepared made = prepared(sphere({{"guidance", {{"search", {{"time_budget_s", 0.5}}}}}}));
  double clock = 0;
  PlanningWatch watch;
  watch.elapsed_s = [&] { return clock += 0.002; };
  double heard = 0;
  watch.report = [&](double progress) { heard = std::max(heard, progress); };
  const json plan = plan_maneuver(*made.planning, watch);
  EXPECT_EQ(plan.at("search").at("ended_by"), "time_budget");
  EXPECT_EQ(plan.at("status"), "best_found");
  EXPECT_GT(heard, 0);
  EXPECT_LE(heard, 0.99);
  ASSERT_FALSE(adopt_plan(made, plan));
  ASSERT_FALSE(made.warnings.empty());
  EXPECT_NE(made.warnings.back().find("best that was found"), std::string::npos);
}

TEST(Planning, WithoutAPlanThereIsNothingToFly) {
  Prepared made = prepared(sphere());
  PlanningWatch watch;
  watch.is_called_off = [] { return true; };
  const json plan = plan_maneuver(*made.planning, watch);
  EXPECT_EQ(plan.at("status"), "none");
  EXPECT_EQ(plan.at("search").at("ended_by"), "cancelled");
  const auto failure = adopt_plan(made, plan);
  ASSERT_TRUE(failure);
  EXPECT_EQ(failure->code, "no_plan");
  EXPECT_FALSE(failure->sentence.empty());
}

TEST(Planning, TheSameProblemHasTheSameName) {
  const auto name = [](const json& changes) { return prepared(sphere(changes)).planning->problem_text; };
  EXPECT_EQ(name(json::object()),
            name({{"label", "x"}, {"simulation", {{"seed", 5}}}, {"timing", {{"mode", "real_time"}}}}));
  EXPECT_NE(name(json::object()), name({{"guidance", {{"authority", 0.9}}}}));
  EXPECT_NE(name(json::object()), name({{"plant", {{"inertia_kg_m2", {1, 1, 1.1}}}}}));
  EXPECT_NE(name(json::object()), name({{"guidance", {{"search", {{"seed", 2}}}}}}));
}

// ---- what is refused, where

Pointers refused(const json& changes) {
  return refused_at(sphere(changes));
}

std::string sentence(const json& changes) {
  const auto outcome = prepare(sphere(changes).dump());
  const auto* rejection = std::get_if<Rejection>(&outcome);
  if (!rejection) return "";
  const Violation& first = rejection->violations.front();
  return first.problem + "; " + first.given + "; " + first.allowed;
}

TEST(PlanningViolations, OfWhatCannotBe) {
  EXPECT_EQ(refused(json::object()), Pointers{});
  // No control about an axis.
  const json flat = {
      {"actuator", {{"maximum_torque_N_m", nullptr}, {"influence_N_m", {{1, 0, 0}, {0, 1, 0}, {0, 0, 0}}}}}};
  EXPECT_EQ(refused(flat), Pointers{"/actuator/influence_N_m"});
  EXPECT_NE(sentence(flat).find("(0, 0, 1)"), std::string::npos) << sentence(flat);
  // Less gas than any plan needs, with that least.
  const json spinning = {{"maneuver", {{"initial_rate_deg_s", {0, 0, 100}}}},
                         {"actuator", {{"gas_flow_m3_s", {1, 1, 1}}}},
                         {"guidance", {{"gas_limit_m3", 1}}}};
  EXPECT_EQ(refused(spinning), Pointers{"/guidance/gas_limit_m3"});
  EXPECT_NE(sentence(spinning).find("more than 1.745"), std::string::npos) << sentence(spinning);
  EXPECT_EQ(refused({{"guidance", {{"longest_s", 1.5}}}}), Pointers{"/guidance/longest_s"});
  EXPECT_EQ(refused({{"maneuver", {{"initial_rate_deg_s", {0, 0, 5}}}},
                     {"guidance", {{"rate_limit_deg_s", {4, 4, 4}}}}}),
            Pointers{"/maneuver/initial_rate_deg_s"});
  EXPECT_EQ(refused({{"actuator", {{"maximum_torque_N_m", nullptr}}}}),
            Pointers{"/actuator/maximum_torque_N_m"});
  EXPECT_EQ(refused({{"guidance", {{"gas_limit_m3", 1}}}}), Pointers{"/guidance/gas_limit_m3"});
  EXPECT_EQ(
      refused({{"guidance", {{"family", {{"type", "smooth_switches"}, {"smoothness", {0.0, 0.01, 0.01}}}}}}}),
      Pointers{"/guidance/family/smoothness/0"});
  EXPECT_EQ(refused({{"guidance", {{"family", {{"type", "smooth_switches"}, {"rise_fraction", 0.7}}}}}}),
            Pointers{"/guidance/family/rise_fraction"});
  EXPECT_EQ(refused({{"guidance", {{"family", {{"type", "impulses"}, {"widths", {0.1, 0.1, 0.3}}}}}}}),
            Pointers{"/guidance/family/widths"});
  EXPECT_EQ(refused({{"guidance", {{"family", {{"type", "on_off"}, {"sequences", {{1, 1}, {1}, {1}}}}}}}}),
            Pointers{"/guidance/family/sequences/0/1"});
  EXPECT_EQ(refused({{"guidance", {{"family", {{"type", "on_off"}, {"sequences", {{1, -1}, {1, -1}}}}}}}}),
            Pointers{"/guidance/family/sequences"});
}

TEST(PlanningViolations, OfCouplesAndOfPartsOfThem) {
  const auto couples = [](const json& changes) {
    return refused_at(preset("vadali-singh-carter-1993/on-off-200-lbf", changes));
  };
  EXPECT_EQ(couples(json::object()), Pointers{});
  EXPECT_EQ(couples({{"guidance", {{"authority", 0.5}}}}), Pointers{"/guidance/authority"});
  EXPECT_EQ(couples({{"actuator", {{"influence_N_m", nullptr}}}}), Pointers{"/actuator/influence_N_m"});
  json thrusters = json::array();
  for (int couple = 1; couple <= 3; ++couple)
    thrusters.push_back({{"position_m", {int{couple == 2}, 0, int{couple == 1}}},
                         {"direction", {0, int{couple != 2}, int{couple == 2}}},
                         {"thrust_N", 1},
                         {"couple", couple},
                         {"sign", 1}});
  // The third pushes through the centre.
  EXPECT_EQ(couples({{"actuator", {{"influence_N_m", nullptr}, {"thrusters", thrusters}}}}),
            Pointers{"/actuator/thrusters"});
  thrusters[2]["position_m"] = {1, 0, 0};
  EXPECT_EQ(couples({{"actuator", {{"influence_N_m", nullptr}, {"thrusters", thrusters}}}}), Pointers{});
  EXPECT_EQ(couples({{"actuator", {{"thrusters", thrusters}}}}), Pointers{"/actuator/thrusters"});
}

TEST(PlanningViolations, OfPlansThatNobodyFlies) {
  EXPECT_EQ(refused({{"controller",
                      {{"type", "rate_damping"},
                       {"damping_N_m_s", {1, 1, 1}},
                       {"evaluation", {{"type", "continuous"}}}}}}),
            Pointers{"/guidance/type"});
  EXPECT_EQ(refused({{"guidance", {{"type", "none"}}}}), Pointers{"/controller/type"});
  json request = test::attitude_request({{"maneuver", {{"reference", {{"type", "planned"}}}}}});
  EXPECT_EQ(refused_at(request), Pointers{"/maneuver/reference/type"});
  request = test::attitude_request({{"maneuver", {{"final_rate_deg_s", {0, 0, 1}}}}});
  EXPECT_EQ(refused_at(request), Pointers{"/maneuver/final_rate_deg_s"});
  // One axis.
  EXPECT_EQ(
      refused_at(preset("agrawal-bang-1995/rigid-single-sided", {{"guidance", {{"type", "time_optimal"}}}})),
      Pointers{"/guidance/type"});
}

TEST(PlanningViolations, OfGivenControls) {
  const auto given = [](json controls) {
    return json{{"guidance", {{"type", "given_controls"}, {"time_s", 2}, {"controls", std::move(controls)}}}};
  };
  EXPECT_EQ(refused(given({{"type", "on_off"},
                           {"sequences", {{1, -1}, {0}, {0}}},
                           {"switch_times_s", {{1}, json::array(), json::array()}}})),
            Pointers{});
  EXPECT_EQ(refused(given({{"type", "on_off"},
                           {"sequences", {{1, -1}, {0}, {0}}},
                           {"switch_times_s", {{3}, json::array(), json::array()}}})),
            Pointers{"/guidance/controls/switch_times_s/0/0"});
  EXPECT_EQ(refused(given({{"type", "on_off"},
                           {"sequences", {{1, -1}, {0}, {0}}},
                           {"switch_times_s", {{0.5, 1}, json::array(), json::array()}}})),
            Pointers{"/guidance/controls/switch_times_s/0"});
  EXPECT_EQ(refused(given({{"type", "impulses"},
                           {"first_peaks", {1, 1}},
                           {"last_peaks", {1, 1, 1}},
                           {"widths", {0.1, 0.1, 0.1}}})),
            Pointers{"/guidance/controls/first_peaks"});
}

}  // namespace
}  // namespace slew
