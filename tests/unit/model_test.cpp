// The reference's derivation for Agrawal & Bang 1995: sum of D^2 over all modes 6.8519 (elbow-heavy)
// and 4.5828 (tip-heavy), of the arm's 6.8531 and 4.5839; of the six that are published 6.852 and 4.582,
// which leave 6.148 and 8.418 of 13 kg m^2; hub-free .18820 .44494 2.4885 4.3006 6.8747 12.8201 Hz.
#include <gtest/gtest.h>

#include "tests/unit/frame_requests.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

json model_of(const std::string& preset, const json& plant = json::object()) {
  return model(prepared({{"preset", preset}, {"plant", plant}}));
}

TEST(Model, OfAFrame) {
  for (const auto& [preset, modal, whole] :
       {std::tuple{kElbowHeavyPreset, 6.8519, 6.8531}, std::tuple{kTipHeavyPreset, 4.5828, 4.5839}}) {
    const json document = model_of(preset);
    const json& plant = document.at("plant");
    const json& frame = document.at("frame");
    EXPECT_EQ(plant.at("type"), "flexible_axis_frame");
    EXPECT_EQ(plant.at("inertia_kg_m2"), 13);
    EXPECT_NEAR(frame.at("modal_inertia_kg_m2").get<double>(), modal, 1.2e-4);
    EXPECT_NEAR(frame.at("inertia_kg_m2").get<double>(), whole, 1.2e-4);
    EXPECT_NEAR(plant.at("hub_inertia_kg_m2").get<double>() + frame.at("inertia_kg_m2").get<double>(), 13,
                1e-12);
    EXPECT_NEAR(
        plant.at("residual_inertia_kg_m2").get<double>() + plant.at("modal_inertia_kg_m2").get<double>(), 13,
        1e-12);
    EXPECT_LT(plant.at("modal_inertia_kg_m2"), frame.at("modal_inertia_kg_m2"));
    EXPECT_EQ(frame.at("coordinates"), 42);
    EXPECT_EQ(frame.at("moving_coordinates"), 18);
    EXPECT_EQ(frame.at("modes"), 18);
    EXPECT_EQ(frame.at("first_left_out_hz"), frame.at("clamped_frequencies_hz").at(6));
    EXPECT_EQ(frame.at("couplings_sqrt_kg_m").at(2), plant.at("couplings_sqrt_kg_m").at(2));
    EXPECT_NEAR(frame.at("inertia_about_origin_kg_m2").at(2).at(2).get<double>(), frame.at("inertia_kg_m2"),
                1e-12);
  }
}

// By hand: 7.8 kg of masses and strips, each half of it on its own beam.
TEST(Model, OfAFrameHasMassAndCentre) {
  const json frame = model_of(kElbowHeavyPreset).at("frame");
  const double strips_kg = 0.1129 * 0.61, mass_kg = 2 * 0.8077 + 5.001 + 2 * 0.1641 + 0.5153 + 2 * strips_kg;
  EXPECT_NEAR(frame.at("mass_kg").get<double>(), mass_kg, 1e-12);
  const double y = (0.1641 * 0.61 + 0.5153 * 0.61 + strips_kg * 0.305) / mass_kg;
  EXPECT_NEAR(frame.at("centre_m").at(1).get<double>(), y, 1e-12);
  EXPECT_EQ(frame.at("axis"), json({0, 0, 1}));
}

TEST(Model, OfAFrameWithAllItsModes) {
  const json document = model_of(kElbowHeavyPreset, {{"modes_kept", 18}});
  EXPECT_TRUE(document.at("frame").at("first_left_out_hz").is_null());
  EXPECT_NEAR(document.at("plant").at("modal_inertia_kg_m2").get<double>(),
              document.at("frame").at("modal_inertia_kg_m2").get<double>(), 1e-12);
}

TEST(Model, OfModesAsTheyWereGiven) {
  const json document = model_of("agrawal-bang-1995/flexible-classical");
  EXPECT_TRUE(document.at("frame").is_null());
  const json& plant = document.at("plant");
  EXPECT_FALSE(plant.contains("hub_inertia_kg_m2"));
  EXPECT_EQ(plant.at("couplings_sqrt_kg_m"), json({2.447, 0.833, 0.358, 0.126, 0.162, 0.007}));
  EXPECT_NEAR(plant.at("modal_inertia_kg_m2").get<double>(), 6.852, 5e-4);
  EXPECT_NEAR(plant.at("residual_inertia_kg_m2").get<double>(), 6.148, 5e-4);
  const double free_hz[] = {0.18820, 0.44494, 2.4885, 4.3006, 6.8747, 12.8201};
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(plant.at("free_frequencies_hz").at(i).get<double>(), free_hz[i], 6e-5);
}

TEST(Model, OfARigidAxis) {
  const json plant = model_of("agrawal-bang-1995/rigid-minimum-time").at("plant");
  EXPECT_EQ(plant.at("type"), "rigid_axis");
  EXPECT_EQ(plant.at("inertia_kg_m2"), 13);
  EXPECT_EQ(plant.at("residual_inertia_kg_m2"), 13);
  EXPECT_TRUE(plant.at("free_frequencies_hz").empty());
}

}  // namespace
