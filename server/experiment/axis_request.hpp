// The single-axis part of a resolved request, in SI.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/experiment/document.hpp"
#include "server/simulation/axis.hpp"

namespace slew {

/// Expects a request that has passed validation.
OnOffAxisSpecification specify_on_off_axis(const nlohmann::json& request);

/// What does not depend on the law. `thrust_N_m` is what fractions of it are of.
void specify_axis(const nlohmann::json& request, double thrust_N_m, AxisSpecification& specification);

/// What only the attempt tells: whether the plant's modes have a closed form.
std::optional<Violation> why_it_cannot_be_built(const OnOffAxisSpecification& specification);

/// What is legal and yet worth a word.
std::vector<std::string> warnings_about(const OnOffAxisSpecification& specification);
void warn_of_growing_modes(const SingleAxisPlant& plant, std::vector<std::string>& warnings);

}  // namespace slew
