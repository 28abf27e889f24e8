// The three-axis part of a resolved request, in SI.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/experiment/document.hpp"
#include "server/experiment/sound_fields.hpp"
#include "server/simulation/attitude.hpp"

namespace slew {

bool is_attitude_law(const nlohmann::json& controller);

/// What no schema can say of a request in three axes, all at once; and of one whose parts have not the same
/// number of axes.
void check_attitude(const SoundFields& fields, const Violate& violate);
/// Whether the plant turns in three axes; where it is not sound, whether the law turns one.
bool has_three_axes(const SoundFields& fields);

// The rest expects what the schema has passed.

AttitudeSpecification specify_attitude(const nlohmann::json& request);
std::optional<Violation> why_it_cannot_be_built(const AttitudeSpecification& specification);
std::vector<std::string> warnings_about(const AttitudeSpecification& specification);

/// Euler parameters of an attitude of a request, of norm 1, with the sign that tells the way round; zero
/// where it has no direction.
Eigen::Vector4d attitude_of(const nlohmann::json& attitude);
/// Of the body relative to the final attitude; kept as it is where that is none.
Eigen::Vector3d initial_mrp_of(const nlohmann::json& maneuver);

/// B of thrusters that fire in couples; and what they push with besides, where they are given one by one.
Eigen::Matrix3d influence_of_couples(const nlohmann::json& actuator,
                                     std::optional<Eigen::Matrix3d>& net_force_N);

Thruster specify_thruster(const nlohmann::json& thruster, const nlohmann::json& set);

}  // namespace slew
