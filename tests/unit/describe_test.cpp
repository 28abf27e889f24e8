// Agrawal & Bang 1995, Fig. 1 (Eq. 3) for the flexible spacecraft simulator taken as rigid: 50 deg with 0.3 N
// m in 12.2989 s, switching at 6.14943 s, at 8.13084 deg/s.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "server/experiment/experiment.hpp"
#include "tests/unit/prepared.hpp"

namespace slew {
namespace {

using nlohmann::json;
using test::prepared;

class Ignore final : public SampleSink {
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

json metrics(const Prepared& p) {
  const auto run = make_run(p);
  Ignore ignore;
  while (run->advance(std::numeric_limits<double>::infinity(), 1 << 20, ignore) == RunStatus::running) {
  }
  return result_document({"", "", "completed", std::nullopt, {}}, p, run.get(), std::nullopt).at("metrics");
}

TEST(Describe, TheMinimumTimeSlew) {
  const json predictions =
      describe(prepared({{"preset", "agrawal-bang-1995/rigid-minimum-time"}})).at("predictions");
  EXPECT_NEAR(predictions.at("minimum_time_s").get<double>(), 12.2989, 1e-4);
  EXPECT_NEAR(predictions.at("minimum_time_switch_s").get<double>(), 6.14943, 1e-5);
  EXPECT_NEAR(predictions.at("minimum_time_peak_rate_deg_s").get<double>(), 8.13084, 1e-5);
}

// Every prediction against a flight, at random parameters, in both directions, with and without a band, on
// both sides of gamma_bar gamma = 1, with and without a disturbance.
TEST(Describe, PredictionsComeTrue) {
  std::mt19937 random(7);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int i = 0; i < 60; ++i) {
    const double inertia = between(0.5, 20), torque = between(0.1, 2), from_deg = between(-90, 90);
    const double slew_deg = between(10, 80) * (i % 2 ? 1 : -1);
    const double minimum_time_s = 2 * std::sqrt(std::abs(slew_deg) / 57.29577951308232 * inertia / torque);
    const bool has_band = i % 3 == 0;
    const double gamma = has_band ? between(1.02, 1.5) : between(0.8, 1.5);
    json request = {{"plant", {{"type", "rigid_axis"}, {"inertia_kg_m2", inertia}}},
                    {"maneuver",
                     {{"type", "single_axis"},
                      {"initial_angle_deg", from_deg},
                      {"final_angle_deg", from_deg + slew_deg}}},
                    {"controller",
                     {{"type", "switching_function"},
                      {"gamma", gamma},
                      {"evaluation", {{"type", "sampled"}, {"period_s", minimum_time_s * 5e-6}}}}},
                    {"actuator", {{"type", "on_off_pair"}, {"torque_N_m", torque}}},
                    {"simulation", {{"duration_s", minimum_time_s * 10}}},
                    {"telemetry", {{"sample_period_s", minimum_time_s}}},
                    {"stop", {{"when", "first_rest"}}}};
    if (has_band)
      request["controller"]["deadband"] = {{"type", i % 2 ? "single_sided" : "double_sided"},
                                           {"width_deg", between(0.05, 0.9) * std::abs(slew_deg)}};
    else if (i % 4 == 0)
      request["disturbances"] = {{{"type", "constant"}, {"torque_N_m", between(-0.2, 0.2) * torque}}};
    SCOPED_TRACE(request.dump());
    const Prepared p = prepared(request);
    const json predicted = describe(p).at("predictions");
    const json measured = metrics(p);
    const double slack_s = minimum_time_s * 1e-4, slack_deg = std::abs(slew_deg) * 1e-4;
    const auto expect = [&](const char* prediction, const json& measurement, double slack) {
      ASSERT_TRUE(predicted.contains(prediction)) << prediction;
      ASSERT_TRUE(measurement.is_number()) << prediction;
      EXPECT_NEAR(predicted.at(prediction).get<double>(), measurement.get<double>(), slack) << prediction;
    };
    ASSERT_TRUE(measured.at("coast_s").is_number());
    expect("accelerating_s", measured.at("switch_on_s").get<double>() - measured.at("coast_s").get<double>(),
           slack_s);
    expect("coast_s", measured.at("coast_s"), slack_s * 10);
    expect("peak_rate_deg_s", measured.at("peak_rate_deg_s"), slack_deg / minimum_time_s * 4);
    expect("overshoot_deg", measured.at("overshoot_deg"), slack_deg);
    if (predicted.contains("rest_error_deg")) {
      expect("slew_time_s", measured.at("first_rest_s"), slack_s * 10);
      expect("rest_error_deg", measured.at("rest_error_deg"), slack_deg);
      expect("thruster_on_time_s", measured.at("thruster_on_time_s").at("total"), slack_s * 10);
      if (!(has_band && i % 2 == 0))  // a double-sided band crosses theta_f, where braking ends, on the way
        expect("braking_duty", measured.at("braking_duty"), 1e-3);
    } else {
      expect("first_stop_s", measured.at("first_rest_s"), slack_s);
    }
  }
}

TEST(Describe, NothingIsPredictedWhereTheClosedFormsDoNotApply) {
  const auto predictions = [](json changes) {
    changes["preset"] = "agrawal-bang-1995/rigid-single-sided";
    return describe(prepared(changes)).at("predictions");
  };
  EXPECT_TRUE(predictions({{"maneuver", {{"initial_rate_deg_s", 1}}}}).is_null());
  EXPECT_TRUE(predictions({{"maneuver", {{"final_angle_deg", 0}}}}).is_null());
  const json too_strong = {{"disturbances", {{{"type", "constant"}, {"torque_N_m", 2}}}}};
  EXPECT_TRUE(predictions(too_strong).is_null());
  const json disturbed_in_a_band = {{"disturbances", {{{"type", "constant"}, {"torque_N_m", 0.1}}}}};
  EXPECT_FALSE(predictions(disturbed_in_a_band).contains("slew_time_s"));
  EXPECT_FALSE(predictions({{"controller", {{"deadband", {{"width_deg", 60}}}}}}).contains("slew_time_s"));
}

TEST(Describe, SaysTheRegimeAndWhatRegularises) {
  const json sampled = describe(prepared({{"preset", "agrawal-bang-1995/rigid-single-sided"}}));
  EXPECT_DOUBLE_EQ(sampled.at("law").at("error_factor"), 1.1);
  EXPECT_EQ(sampled.at("regularisation"), json({{"type", "sampled"}, {"period_s", 0.001}}));
  EXPECT_EQ(sampled.at("size").at("most_control_steps"), 5000);
  const json continuous =
      describe(prepared({{"preset", "agrawal-bang-1995/rigid-single-sided-minimum-on-time"}}));
  EXPECT_EQ(continuous.at("regularisation"),
            json({{"type", "minimum_on_time"}, {"minimum_on_time_s", 0.05}}));
  const json below = describe(prepared({{"preset", "agrawal-bang-1995/rigid-classical-gamma-0-9"}}));
  EXPECT_NE(below.at("law").at("regime"), sampled.at("law").at("regime"));
}

}  // namespace
}  // namespace slew
