// Requests that describe an appendage by its frame.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>

#include "server/experiment/experiment.hpp"
#include "tests/unit/prepared.hpp"

namespace slew::test {

inline const char* const kElbowHeavyPreset = "agrawal-bang-1995/flexible-frame-elbow-heavy";
inline const char* const kTipHeavyPreset = "agrawal-bang-1995/flexible-frame-tip-heavy";

/// With every default filled in, and complete without its preset.
inline nlohmann::json resolved(const nlohmann::json& request) {
  nlohmann::json whole = nlohmann::json::parse(prepared(request).resolved);
  whole.erase("preset");
  return whole;
}

inline const SingleAxisPlant& plant_of(const Prepared& prepared) {
  if (const auto* linear = std::get_if<LinearAxisSpecification>(&prepared.system)) return linear->plant;
  return std::get<OnOffAxisSpecification>(prepared.system).plant;
}

class Ignore final : public SampleSink {
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

inline nlohmann::json flown(const Prepared& prepared) {
  const auto run = make_run(prepared);
  Ignore ignore;
  while (run->advance(std::numeric_limits<double>::infinity(), 1 << 20, ignore) == RunStatus::running) {
  }
  return result_document({"e", "r", "completed", std::nullopt, {}}, prepared, run.get(), std::nullopt);
}

/// frame_cases.hpp's one of everything, as a request's plant.
inline nlohmann::json one_of_everything_plant() {
  return nlohmann::json::parse(R"({
    "type": "flexible_axis_frame",
    "hub_inertia_kg_m2": 2,
    "axis": [1, -2, 0.5],
    "damping_ratio": 0.01,
    "modes_kept": 8,
    "elements_per_member": 2,
    "sections": {"skew": {
      "mass_per_length_kg_m": 0.4, "axial_stiffness_N": 4e5, "bending_stiffness_y_N_m2": 55,
      "bending_stiffness_z_N_m2": 30, "torsional_stiffness_N_m2": 24, "polar_inertia_per_length_kg_m": 8e-5}},
    "nodes": [{"position_m": [0.3, 0.1, -0.2], "held": ["all"]},
              {"position_m": [1.1, 0.4, 0.3]},
              {"position_m": [1.5, 1.2, 0.5]},
              {"position_m": [0.6, 0.9, 1.1]}],
    "beams": [{"from_node": 0, "to_node": 1, "section": "skew", "orientation": [0.2, -0.3, 1]},
              {"from_node": 1, "to_node": 2, "section": "skew", "orientation": [0.2, -0.3, 1],
               "released_at_to": ["ry"]},
              {"from_node": 2, "to_node": 3, "section": "skew", "orientation": [0.2, -0.3, 1]}],
    "bars": [{"from_node": 1, "to_node": 3, "mass_per_length_kg_m": 0.05, "axial_stiffness_N": 2e5},
             {"from_node": 0, "to_node": 3, "mass_per_length_kg_m": 0.05, "axial_stiffness_N": 2e5}],
    "point_masses": [{"node": 3, "mass_kg": 0.7, "inertia_kg_m2":
      [[0.02, -0.004, 0.001], [-0.004, 0.03, 0.002], [0.001, 0.002, 0.025]]}]})");
}

/// A slew of that spacecraft, complete by itself.
inline nlohmann::json one_of_everything_request() {
  return {{"plant", one_of_everything_plant()},
          {"maneuver", {{"type", "single_axis"}, {"final_angle_deg", 30}}},
          {"controller",
           {{"type", "switching_function"},
            {"gamma_bar", 1.2},
            {"evaluation", {{"type", "sampled"}, {"period_s", 0.01}}}}},
          {"actuator", {{"type", "on_off_pair"}, {"torque_N_m", 0.3}}},
          {"simulation", {{"duration_s", 8}}},
          {"telemetry", {{"sample_period_s", 0.1}}}};
}

}  // namespace slew::test
