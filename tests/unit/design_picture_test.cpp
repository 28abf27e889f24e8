// Root locus and Bode's curves of Bryson 1994, Problem 3.2.2(e), as files; what cannot be drawn is said.
#include "client/slewctl/design_picture.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "client/slewctl/connection.hpp"
#include "server/experiment/experiment.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

json description_of(const json& request) {
  auto outcome = prepare(request.dump());
  const auto& prepared = std::get<Prepared>(outcome);
  json description = describe(prepared);
  description["design"] = design_curves(prepared);
  return description;
}

std::string drawn(const json& request, const std::string& ending) {
  const auto file =
      std::filesystem::temp_directory_path() / ("slew-design-" + std::to_string(::getpid()) + ending);
  draw_design(description_of(request), "it's a title", file);
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  std::filesystem::remove(file);
  return text.str();
}

TEST(DesignPicture, OfEveryKindOfLinearLaw) {
  EXPECT_EQ(drawn({{"preset", "bryson-1994/problem-3-2-2"}}, ".png").substr(1, 3), "PNG");
  const std::string svg = drawn({{"preset", "bryson-1994/problem-3-2-2"}}, ".svg");
  for (const char* text :
       {"stable for 0 &lt; k0 &lt; 3", "Im s, rad/s", "gain margin 9.542 dB at 2.449 rad/s", "phase, deg",
        "closed-loop poles at k0 = 1", "it's a title", "k0 = 3"})
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  // Without a crossing, without a zero, stable for no gain, with modes without damping.
  EXPECT_NE(drawn({{"preset", "bryson-1994/lead-compensation"}}, ".svg").find("gain margin unlimited"),
            std::string::npos);
  const json undamped = {{"preset", "bryson-1994/proportional-attitude-rate"},
                         {"controller", {{"rate_gain_N_m_s_rad", 0}}}};
  EXPECT_NE(drawn(undamped, ".svg").find("stable for no k0"), std::string::npos);
  const json mode = {{"frequency_hz", 1}, {"coupling_sqrt_kg_m", 0.3}};
  const json flexible = {{"preset", "bryson-1994/problem-3-2-2"},
                         {"plant", {{"type", "flexible_axis"}, {"modes", {mode}}}}};
  EXPECT_FALSE(drawn(flexible, ".svg").empty());
}

TEST(DesignPicture, OfAModulator) {
  const std::string svg = drawn({{"preset", "kim-crassidis-1998/case-c-sliding-mode"}}, ".svg");
  for (const char* text : {"dead band 0.06032 N m, saturation 1.034 N m, shortest pulse 36.14 ms",
                           "duty cycle", "demand, N m", "pulse, ms"})
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  EXPECT_NE(drawn({{"preset", "benchmark/twelve-thrusters"}}, ".svg").find("demand, N"), std::string::npos);
  // A Schmitt trigger makes no pulses of a demand that does not change.
  const json schmitt = {{"preset", "kim-crassidis-1998/case-c-sliding-mode"},
                        {"actuator", {{"modulator", json::parse(R"({"type": "schmitt_trigger", "gain": null,
                          "time_constant_s": null, "input": null, "on": 0.5, "off": 0.2})")}}}};
  EXPECT_EQ(drawn(schmitt, ".svg").find("pulse, ms"), std::string::npos);
}

TEST(DesignPicture, WhatCannotBeDrawn) {
  const json wheels = description_of({{"preset", "kim-crassidis-1998/figure-4-sliding-mode"}});
  EXPECT_THROW(draw_design(wheels, "", "wheels.svg"), Stop);
  const json linear = description_of({{"preset", "bryson-1994/problem-3-2-2"}});
  EXPECT_THROW(draw_design(linear, "", "locus.doc"), Stop);
  EXPECT_THROW(draw_design(linear, "", "/nowhere/locus.png"), Stop);
}

}  // namespace
}  // namespace slew::ctl
