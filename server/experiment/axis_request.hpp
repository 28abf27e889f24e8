// The single-axis part of a resolved request, in SI.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "server/simulation/axis.hpp"

namespace slew {

/// Expects a request that has passed validation.
OnOffAxisSpecification specify_on_off_axis(const nlohmann::json& request);

/// What is legal and yet worth a word.
std::vector<std::string> warnings_about(const OnOffAxisSpecification& specification);

}  // namespace slew
