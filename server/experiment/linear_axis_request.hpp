// The linear laws of a resolved request, in SI.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/experiment/document.hpp"
#include "server/experiment/sound_fields.hpp"
#include "server/simulation/axis.hpp"

namespace slew {

/// Attitude and rate feedback, or lead compensation.
bool has_linear_law(const SoundFields& fields);
bool is_linear_law(const nlohmann::json& controller);

/// What makes no sense together with a linear law, or without one.
void check_linear_law(const SoundFields& fields, const Violate& violate);

/// Expects a request that has passed validation.
LinearAxisSpecification specify_linear_axis(const nlohmann::json& request);

/// What only the whole loop tells: how many steps the propagator would take.
std::optional<Violation> why_it_cannot_be_built(const LinearAxisSpecification& specification);

/// What is legal and yet worth a word: a loop that is not stable, first of all.
std::vector<std::string> warnings_about(const LinearAxisSpecification& specification);

}  // namespace slew
