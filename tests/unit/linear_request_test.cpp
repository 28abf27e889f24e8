// Requests for linear laws, and what describe says of them. Bryson 1994, Problem 3.2.2: D = K = 2, k_q =
// k_theta = 2 for omega_0 = 1, stable for 0 < k_0 < 3.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/experiment/experiment.hpp"
#include "server/experiment/schema.hpp"
#include "tests/unit/prepared.hpp"

namespace slew {
namespace {

using nlohmann::json;
using test::prepared;

constexpr const char* kSecond = "bryson-1994/problem-3-2-2";
constexpr const char* kLead = "bryson-1994/lead-compensation";

std::vector<Violation> violations(const json& request) {
  const auto outcome = prepare(request.dump());
  if (const auto* rejection = std::get_if<Rejection>(&outcome)) return rejection->violations;
  return {};
}

std::vector<std::string> pointers(const json& request) {
  std::vector<std::string> found;
  for (const Violation& violation : violations(request)) {
    found.push_back(violation.pointer);
    EXPECT_FALSE(violation.problem.empty());
    EXPECT_FALSE(violation.allowed.empty());
  }
  return found;
}

using Pointers = std::vector<std::string>;

json with(const char* preset, json changes) {
  changes["preset"] = preset;
  return changes;
}

LinearAxisSpecification linear(const json& request) {
  return std::get<LinearAxisSpecification>(prepared(request).system);
}

TEST(LinearRequest, BecomesASpecificationInSI) {
  const auto spec =
      linear(with(kSecond, {{"plant", {{"inertia_kg_m2", 3}}},
                            {"controller", {{"loop_gain", 1.5}}},
                            {"estimator", {{"initial_angle_deg", 180}, {"initial_rate_deg_s", 90}}},
                            {"maneuver", {{"final_angle_deg", 90}}},
                            {"actuator", {{"lever_arm_m", 2}, {"specific_impulse_s", 60}}}}));
  EXPECT_EQ(std::get<AttitudeRateFeedback>(spec.feedback.law).rate_gain_N_m_s_rad, 2);
  EXPECT_EQ(spec.feedback.loop_gain, 1.5);
  const auto& estimator = std::get<SecondOrderAngleEstimator>(spec.estimator);
  EXPECT_EQ(estimator.rate_gain_1_s2, 2);
  EXPECT_EQ(estimator.inertia_kg_m2, 3);
  EXPECT_DOUBLE_EQ(*spec.estimate.error_rad, std::acos(0.0));
  EXPECT_DOUBLE_EQ(spec.estimate.rate_rad_s, std::acos(0.0));
  EXPECT_EQ(spec.actuator.lever_arm_m, 2);
  const auto other = linear(with("bryson-1994/problem-3-2-4", {{"estimator", {{"inertia_kg_m2", 1.2}}}}));
  EXPECT_EQ(std::get<FirstOrderAngleEstimator>(other.estimator).inertia_kg_m2, 1.2);
  const auto lead = std::get<LeadCompensation>(linear(with(kLead, json::object())).feedback.law);
  EXPECT_EQ(lead.gain_N_m_rad, 4);
  EXPECT_EQ(lead.zero_rad_s, 0.5);
  EXPECT_EQ(lead.pole_rad_s, 3);
}

TEST(LinearRequest, WhatMakesNoSenseTogether) {
  EXPECT_EQ(pointers(with(kSecond, {{"actuator", {{"type", "on_off_pair"}, {"torque_N_m", 1}}}})),
            Pointers{"/actuator/type"});
  EXPECT_EQ(pointers(with("agrawal-bang-1995/rigid-single-sided",
                          {{"actuator", {{"type", "proportional"}, {"torque_N_m", nullptr}}}})),
            Pointers{"/actuator/type"});
  EXPECT_EQ(pointers(with(kLead, {{"estimator", {{"type", "first_order_angle"}, {"gain_1_s", 1}}}})),
            Pointers{"/estimator/type"});
  EXPECT_EQ(pointers(with("agrawal-bang-1995/rigid-single-sided",
                          {{"estimator", {{"type", "first_order_angle"}, {"gain_1_s", 1}}}})),
            Pointers{"/estimator/type"});
  EXPECT_EQ(pointers(with(kSecond, {{"stop", {{"when", "end_box"}}}})), Pointers{"/stop/when"});
  const json friction = {{"type", "friction"}, {"torque_N_m", 0.1}};
  const json fraction = {{"type", "fraction_of_thrust"}, {"fraction", 0.1}};
  EXPECT_EQ(pointers(with(kSecond, {{"disturbances", {friction, fraction}}})),
            (Pointers{"/disturbances/0/type", "/disturbances/1/type"}));
  EXPECT_EQ(pointers(with(kSecond, {{"actuator", {{"specific_impulse_s", 60}}}})),
            Pointers{"/actuator/lever_arm_m"});
}

TEST(LinearRequest, EstimatorPolesBelongInTheLeftHalfPlane) {
  for (const double gain : {0.0, -1.0}) {
    EXPECT_EQ(pointers(with(kSecond, {{"estimator", {{"rate_gain_1_s2", gain}}}})),
              Pointers{"/estimator/rate_gain_1_s2"});
    EXPECT_EQ(pointers(with(kSecond, {{"estimator", {{"attitude_gain_1_s", gain}}}})),
              Pointers{"/estimator/attitude_gain_1_s"});
    EXPECT_EQ(pointers(with("bryson-1994/problem-3-2-4", {{"estimator", {{"gain_1_s", gain}}}})),
              Pointers{"/estimator/gain_1_s"});
  }
  const auto found = violations(with(kSecond, {{"estimator", {{"rate_gain_1_s2", -1}}}}));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].problem.find("right half plane"), std::string::npos);
  EXPECT_EQ(found[0].allowed, "greater than 0");
}

TEST(LinearRequest, EverythingAtOnce) {
  EXPECT_EQ(pointers(with(kSecond, {{"actuator", {{"type", "on_off_pair"}}},
                                    {"estimator", {{"rate_gain_1_s2", -1}}},
                                    {"controller", {{"loop_gain", 0}}},
                                    {"stop", {{"when", "end_box"}}},
                                    {"disturbances", {{{"type", "friction"}, {"torque_N_m", 1}}}}})),
            (Pointers{"/actuator/torque_N_m", "/actuator/type", "/controller/loop_gain",
                      "/disturbances/0/type", "/estimator/rate_gain_1_s2", "/stop/when"}));
}

TEST(LinearRequest, NumbersOutOfBounds) {
  const auto one = [](const char* pointer, const json& value) {
    json request = with(kLead, json::object());
    request[json::json_pointer(pointer)] = value;
    EXPECT_EQ(pointers(request), Pointers{pointer}) << value;
  };
  one("/controller/gain_N_m_rad", -1);
  one("/controller/gain_N_m_rad", 1e13);
  one("/controller/zero_rad_s", -0.1);
  one("/controller/pole_rad_s", "3");
  one("/controller/loop_gain", 0);
  one("/controller/rate_gain_N_m_s_rad", 1);
}

// Each legal, and together more steps than a run may take.
TEST(LinearRequest, ALoopThatIsTooFastForItsDuration) {
  const json fast = with(kLead, {{"controller", {{"gain_N_m_rad", 1e12}, {"pole_rad_s", 1e6}}},
                                 {"simulation", {{"duration_s", 1e5}}},
                                 {"telemetry", {{"sample_period_s", 1}}}});
  EXPECT_EQ(pointers(fast), Pointers{"/simulation/duration_s"});
}

TEST(LinearRequest, AnUnstableLoopIsLegalAndWarnedOf) {
  EXPECT_TRUE(prepared(with(kSecond, json::object())).warnings.empty());
  EXPECT_TRUE(prepared(with(kSecond, {{"controller", {{"loop_gain", 2.999}}}})).warnings.empty());
  const auto beyond = prepared(with(kSecond, {{"controller", {{"loop_gain", 4}}}})).warnings;
  ASSERT_EQ(beyond.size(), 1u);
  EXPECT_NE(beyond[0].find("not stable"), std::string::npos);
  const auto lag = prepared(with(kLead, {{"controller", {{"pole_rad_s", 0.4}}}})).warnings;
  ASSERT_EQ(lag.size(), 1u);
  EXPECT_NE(lag[0].find("b > a"), std::string::npos);
  // K = 4, a = 1/2, b = 0.4: s^3 + 0.4 s^2 + 4 s + 2 has its pair at 0.0471 +- 2.01i.
  EXPECT_NE(lag[0].find("0.0471 +- 2.01i"), std::string::npos) << lag[0];
}

TEST(LinearRequest, FliesAndAnswersInTheSchemasWords) {
  class Ignore final : public SampleSink {
    void sample(double, std::span<const double>, std::span<const double>) override {}
    void event(const SwitchEvent&) override {}
  } ignore;
  for (const char* preset : {kSecond, kLead}) {
    const Prepared p = prepared(
        with(preset,
             {{"plant",
               {{"type", "flexible_axis"}, {"modes", {{{"frequency_hz", 1}, {"coupling_sqrt_kg_m", 0.3}}}}}},
              {"outputs", {{"at_s", {1, 2}}}}}));
    const auto run = make_run(p), other = make_verification(p);
    for (const auto& one : {run.get(), other.get()})
      while (one->advance(std::numeric_limits<double>::infinity(), 1 << 20, ignore) == RunStatus::running) {
      }
    const json result = result_document({"e", "r", "completed", std::nullopt, {}}, p, run.get(),
                                        compare(run->report(), other->report()));
    EXPECT_TRUE(schema_violations("result", result).empty());
    for (const auto& [name, difference] : result.at("verification").at("final_state_difference").items())
      EXPECT_NEAR(difference.get<double>(), 0, 1e-8) << name;
  }
}

TEST(LinearDescription, OfProblem322) {
  const json found = describe(prepared(with(kSecond, {{"plant", {{"inertia_kg_m2", 1}}}})));
  EXPECT_EQ(found.at("compensator").at("numerator_per_inertia"), json({-8.0, -4.0}));
  EXPECT_EQ(found.at("compensator").at("denominator"), json({1.0, 4.0, 8.0}));
  EXPECT_EQ(found.at("closed_loop").at("characteristic_polynomial"), json({1.0, 4.0, 8.0, 8.0, 4.0}));
  ASSERT_EQ(found.at("loop_gain_stability_range").size(), 1u);
  EXPECT_NEAR(found.at("loop_gain_stability_range").at(0).at("to").get<double>(), 3, 1e-12);
  EXPECT_NEAR(found.at("margins").at("phase_crossovers").at(0).at("gain_margin_dB").get<double>(),
              20 * std::log10(3), 1e-12);
  EXPECT_FALSE(found.contains("design"));
}

// Half the loop gain: the margin is twice as large, the range the same.
TEST(LinearDescription, MarginsAreOfTheGainInForceAndTheRangeIsNot) {
  const json found = describe(prepared(with(kSecond, {{"controller", {{"loop_gain", 0.5}}}})));
  EXPECT_NEAR(found.at("margins").at("phase_crossovers").at(0).at("gain_margin").get<double>(), 6, 1e-12);
  EXPECT_NEAR(found.at("loop_gain_stability_range").at(0).at("to").get<double>(), 3, 1e-12);
  EXPECT_EQ(found.at("compensator").at("numerator_per_inertia"), json({-4.0, -2.0}));
}

TEST(LinearDescription, NoUpperBoundIsNull) {
  const json found = describe(prepared(with(kLead, json::object())));
  EXPECT_TRUE(found.at("loop_gain_stability_range").at(0).at("to").is_null());
  EXPECT_TRUE(found.at("margins").at("phase_crossovers").empty());
}

// Two modes that are alike and critically damped have no basis, and are flown nevertheless.
TEST(LinearDescription, OfModesWithoutABasis) {
  const json mode = {{"frequency_hz", 1}, {"damping_ratio", 1}, {"coupling_sqrt_kg_m", 0.3}};
  const json found =
      describe(prepared(with(kSecond, {{"plant", {{"type", "flexible_axis"}, {"modes", {mode, mode}}}}})));
  EXPECT_EQ(found.at("closed_loop").at("poles_rad_s").size(), 8u);
}

TEST(LinearDescription, CurvesForPictures) {
  const json design = design_curves(prepared(with(kSecond, json::object())));
  EXPECT_EQ(design.at("type"), "linear");
  const json& locus = design.at("root_locus");
  ASSERT_EQ(locus.at("branches_rad_s").size(), 4u);
  for (const json& branch : locus.at("branches_rad_s"))
    EXPECT_EQ(branch.size(), locus.at("loop_gains").size());
  EXPECT_EQ(locus.at("poles_rad_s").size(), 4u);
  EXPECT_EQ(locus.at("zeros_rad_s").size(), 1u);
  EXPECT_EQ(design.at("bode").at("phase_deg").size(), design.at("bode").at("frequency_rad_s").size());
  EXPECT_EQ(design_curves(prepared({{"preset", "agrawal-bang-1995/rigid-single-sided"}})).at("type"),
            "phase_plane");
}

}  // namespace
}  // namespace slew
