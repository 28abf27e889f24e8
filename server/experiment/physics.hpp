// What a schema cannot say: whether the parts of a request make sense together.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "server/experiment/document.hpp"

namespace slew {

/// For a request that has its defaults. Looks only at fields that `schema_violations` leaves standing, so
/// that both kinds can be told at once.
std::vector<Violation> physics_violations(const nlohmann::json& request,
                                          const std::vector<Violation>& schema_violations);

}  // namespace slew
