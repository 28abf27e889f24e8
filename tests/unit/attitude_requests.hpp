// A request in three axes, and what becomes of it.
#pragma once

#include <gtest/gtest.h>

#include "server/experiment/attitude_request.hpp"
#include "server/experiment/experiment.hpp"
#include "tests/unit/prepared.hpp"

namespace slew::test {

/// Kim & Crassidis 1998, Case C, with changes as a merge patch.
inline nlohmann::json attitude_request(const nlohmann::json& changes = nlohmann::json::object()) {
  auto request = nlohmann::json::parse(R"({
    "plant": {"type": "rigid_body", "inertia_kg_m2": [125.4, 108.3, 131.1]},
    "maneuver": {"type": "three_axis", "initial_attitude": {"type": "mrp", "value": [0, 0, 1]}},
    "controller": {"type": "sliding_mode", "lambda_1_s": -0.3854, "gain_rad_s2": 0.0421,
                   "inertia_kg_m2": [114, 114, 114], "evaluation": {"type": "continuous"}},
    "actuator": {"type": "axis_thrusters", "torque_N_m": [1, 1, 1], "modulator": {"type": "pwpf"}},
    "simulation": {"duration_s": 120}})");
  request.merge_patch(changes);
  return request;
}

inline AttitudeSpecification attitude_specified(const nlohmann::json& changes = nlohmann::json::object()) {
  const Prepared made = prepared(attitude_request(changes));
  const auto* spec = std::get_if<AttitudeSpecification>(&made.system);
  if (!spec) ADD_FAILURE() << "not in three axes";
  return spec ? *spec : AttitudeSpecification{};
}

/// Where a request is refused, with a sentence and what is allowed at each place; nowhere when it is not.
inline std::vector<std::string> refused_at(const nlohmann::json& request) {
  const auto outcome = prepare(request.dump());
  std::vector<std::string> pointers;
  if (const auto* rejection = std::get_if<Rejection>(&outcome))
    for (const Violation& violation : rejection->violations) {
      EXPECT_FALSE(violation.problem.empty());
      EXPECT_FALSE(violation.allowed.empty()) << violation.pointer;
      pointers.push_back(violation.pointer);
    }
  return pointers;
}

/// Twelve thrusters: two couples to either side of each axis.
inline nlohmann::json twelve_thrusters() {
  nlohmann::json list = nlohmann::json::array();
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& [side, way] : {std::pair{1, 1}, {-1, -1}, {1, -1}, {-1, 1}}) {
      std::array<int, 3> position{}, direction{};
      position[static_cast<std::size_t>((axis + 1) % 3)] = side;
      direction[static_cast<std::size_t>((axis + 2) % 3)] = way;
      list.push_back({{"position_m", position}, {"direction", direction}});
    }
  return list;
}

/// The actuator of a patch in which nothing is left of the one before.
inline nlohmann::json instead_of_thrusters(nlohmann::json actuator) {
  for (const char* field : {"torque_N_m", "modulator"})
    if (!actuator.contains(field)) actuator[field] = nullptr;
  return actuator;
}

inline nlohmann::json thruster_set(nlohmann::json thrusters, nlohmann::json more = nlohmann::json::object()) {
  nlohmann::json actuator = {{"type", "thruster_set"},
                             {"thrusters", std::move(thrusters)},
                             {"thrust_N", 1},
                             {"torque_N_m", nullptr},
                             {"modulator", {{"type", "pwpf"}}}};
  actuator.merge_patch(more);
  actuator["torque_N_m"] = nullptr;
  return actuator;
}

/// A law in a patch in which nothing is left of the one before.
inline nlohmann::json instead_of_sliding_mode(nlohmann::json law) {
  for (const char* field : {"lambda_1_s", "gain_rad_s2", "inertia_kg_m2", "evaluation"})
    if (!law.contains(field)) law[field] = nullptr;
  return law;
}

}  // namespace slew::test
