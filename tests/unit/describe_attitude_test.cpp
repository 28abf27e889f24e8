// Kim & Crassidis 1998: K0 = -(30, 300, 1000) (Eq. 46); |s| <= epsilon |w|max / (J^ K) (Eq. 20). PWPF pulses
// of 37.66 and 65.21 ms under 0.1 and 0.5 N m, dead band 0.06032, saturation 1.0335.
#include "server/experiment/description.hpp"
#include "tests/unit/attitude_requests.hpp"

namespace slew {
namespace {

using nlohmann::json;
using test::attitude_request;
using test::instead_of_sliding_mode;
using test::instead_of_thrusters;
using test::thruster_set;
using test::twelve_thrusters;

json described(const json& changes = json::object()) {
  return describe(test::prepared(attitude_request(changes)));
}

json design(const json& changes) {
  return design_curves(test::prepared(attitude_request(changes)));
}

TEST(DescribeAttitude, ThePlantAlongItsPrincipalAxes) {
  // 10, 12 and 9 about axes of which the first two are turned by 30 deg about z.
  const double c = 0.75, s = 0.25, m = 0.4330127018922193;
  const json inertia = {{10 * c + 12 * s, -2 * m, 0}, {-2 * m, 10 * s + 12 * c, 0}, {0, 0, 9}};
  const json plant = described({{"plant", {{"inertia_kg_m2", inertia}}}}).at("plant");
  const auto moments = plant.at("principal_moments_kg_m2").get<std::vector<double>>();
  EXPECT_NEAR(moments[0], 9, 1e-12);
  EXPECT_NEAR(moments[1], 10, 1e-12);
  EXPECT_NEAR(moments[2], 12, 1e-12);
  Eigen::Matrix3d axes;
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j) axes(i, j) = plant.at("principal_axes")[i][j];
  EXPECT_NEAR(axes.determinant(), 1, 1e-12);
  EXPECT_NEAR(axes(0, 2), 1, 1e-12);
  EXPECT_NEAR(axes(1, 0), std::sqrt(0.75), 1e-12);
  EXPECT_NEAR(axes(1, 1), 0.5, 1e-12);
  // The same is what the plant is made of.
  EXPECT_EQ(model(test::prepared(attitude_request({{"plant", {{"inertia_kg_m2", inertia}}}}))).at("plant"),
            plant);
}

TEST(DescribeAttitude, TheLawAtTheInitialState) {
  const json point = described().at("at_initial_state");
  // p = (0, 0, 1): m = 2 lambda, s = -m.
  EXPECT_DOUBLE_EQ(point.at("manifold_rad_s")[2], -2 * 0.3854);
  EXPECT_DOUBLE_EQ(point.at("surface_rad_s")[2], 2 * 0.3854);
  EXPECT_DOUBLE_EQ(point.at("correction_N_m")[2], -114 * 0.0421);
  EXPECT_EQ(point.at("torque_N_m"), point.at("correction_N_m"));
  const json damping = instead_of_sliding_mode(
      {{"type", "rate_damping"}, {"damping_N_m_s", 2}, {"evaluation", {{"type", "continuous"}}}});
  const json other = described({{"controller", damping}, {"maneuver", {{"initial_rate_deg_s", {1, 0, 0}}}}});
  EXPECT_FALSE(other.at("at_initial_state").contains("surface_rad_s"));
  EXPECT_NEAR(other.at("at_initial_state").at("torque_N_m")[0].get<double>(), -0.0349065850398866, 1e-15);
  EXPECT_EQ(other.at("law"), json({{"type", "rate_damping"}, {"damping_N_m_s", {2.0, 2.0, 2.0}}}));
  EXPECT_TRUE(other.at("surface_bound_rad_s").is_null());
}

TEST(DescribeAttitude, TheBoundOfTheSurfaceUnderDisturbances) {
  const json bound =
      described({{"disturbances",
                  {{{"type", "body_constant"}, {"torque_N_m", {0.002, 0, 0}}},
                   {{"type", "body_step"}, {"from_s", 1}, {"torque_N_m", {-0.003, 0, 0}}},
                   {{"type", "body_sinusoid"}, {"amplitude_N_m", {0, -0.001, 0}}, {"frequency_hz", 1}}}}})
          .at("surface_bound_rad_s");
  EXPECT_NEAR(bound[0].get<double>(), 0.01 * 0.002 / (114 * 0.0421), 1e-18);
  EXPECT_NEAR(bound[1].get<double>(), 0.01 * 0.001 / (114 * 0.0421), 1e-18);
  EXPECT_EQ(bound[2], 0);
}

TEST(DescribeAttitude, TheObserver) {
  EXPECT_TRUE(described().at("observer").is_null());
  const json observer = described({{"estimator", {{"type", "disturbance_observer"}}}}).at("observer");
  EXPECT_EQ(observer.at("K0"), json({-30, -300, -1000}));
  EXPECT_EQ(observer.at("K1")[1][2][2], 114 * 300);
  EXPECT_EQ(observer.at("characteristic_polynomial"), json({1, 30, 300, 1000}));
  EXPECT_EQ(observer.at("feeding"), "applied_minus_equivalent");
}

TEST(DescribeAttitude, AModulatorForEachLevelThatThereIs) {
  const json levels =
      described({{"actuator", {{"torque_N_m", {1, 1, 2}}}}}).at("/actuator/modulator/levels"_json_pointer);
  ASSERT_EQ(levels.size(), 2u);
  EXPECT_NEAR(levels[0].at("dead_band").get<double>(), 0.06032171582, 1e-11);
  EXPECT_NEAR(levels[0].at("saturation").get<double>(), 1.033512064, 1e-9);
  EXPECT_NEAR(levels[1].at("saturation").get<double>(), 2.033512064, 1e-9);
  EXPECT_NEAR(levels[0].at("curve")[2].at("on_time_s").get<double>(), 0.03765823485, 1e-11);
  EXPECT_NEAR(levels[0].at("curve")[10].at("off_time_s").get<double>(), 0.07872119895, 1e-11);
  EXPECT_TRUE(levels[0].at("curve")[0].at("off_time_s").is_null());
  EXPECT_TRUE(levels[0].at("curve").back().at("on_time_s").is_null());
  const json width =
      described({{"actuator", {{"modulator", {{"type", "pulse_width"}, {"minimum_on_time_s", 0.02}}}}},
                 {"controller", {{"evaluation", {{"type", "sampled"}, {"period_s", 0.2}}}}}});
  EXPECT_DOUBLE_EQ(width.at("/actuator/modulator/levels/0/least_duty_cycle"_json_pointer), 0.1);
  EXPECT_EQ(width.at("/size/most_control_steps"_json_pointer), 600);
  const json schmitt =
      described({{"actuator", {{"modulator", {{"type", "schmitt_trigger"}, {"on", 0.5}, {"off", 0.2}}}}}});
  EXPECT_DOUBLE_EQ(schmitt.at("/actuator/modulator/levels/0/dead_band"_json_pointer), 0.5);
}

TEST(DescribeAttitude, ASetOfThrusters) {
  for (const char* method : {"non_negative_least_squares", "linear_programme"}) {
    const json actuator =
        described({{"actuator", thruster_set(twelve_thrusters(), {{"allocation", {{"type", method}}}})}})
            .at("actuator");
    EXPECT_EQ(actuator.at("torques_N_m")[0], json({1, 0, 0}));
    EXPECT_EQ(actuator.at("/allocation/type"_json_pointer), method);
    for (const char* direction : {"+x", "-x", "+y", "-y", "+z", "-z"})
      EXPECT_NEAR(actuator.at("/allocation/total_thrust_N_of_1_N_m"_json_pointer).at(direction).get<double>(),
                  1, 1e-12);
  }
  const json shared = described({{"actuator", thruster_set(twelve_thrusters())}}).at("actuator");
  EXPECT_NEAR(shared.at("/most_torque_N_m/-y"_json_pointer).get<double>(), 2, 1e-12);
  EXPECT_NEAR(shared.at("/allocation/thrust_N_of_1_N_m/+z/8"_json_pointer).get<double>(), 0.5, 1e-12);
}

TEST(DescribeAttitude, WhatAPictureIsDrawnFrom) {
  const json modulator = design(json::object());
  EXPECT_EQ(modulator.at("type"), "modulator");
  EXPECT_EQ(modulator.at("unit"), "N m");
  EXPECT_NEAR(modulator.at("curve").back().at("demand").get<double>(), 1.2, 1e-12);
  EXPECT_EQ(design({{"actuator", thruster_set(twelve_thrusters())}}).at("unit"), "N");
  EXPECT_EQ(design({{"actuator", instead_of_thrusters({{"type", "ideal_torque"}})}}).at("type"), "none");
}

}  // namespace
}  // namespace slew
