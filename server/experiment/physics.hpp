// What a schema cannot say: whether the parts of a request make sense together.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "server/experiment/document.hpp"

namespace slew {

/// For a request that fits the schema and has its defaults.
std::vector<Violation> physics_violations(const nlohmann::json& request);

}  // namespace slew
