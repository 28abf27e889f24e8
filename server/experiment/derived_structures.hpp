// Models and designs of structures that were derived lately, by the digest of what they follow from.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>

#include "server/simulation/structure_system.hpp"

namespace slew {

/// Of a request that the schema has passed and the specification made from it; null where it cannot be
/// derived. Safe from any thread.
std::shared_ptr<const StructureSystem> derived_structure(const nlohmann::json& request,
                                                         const StructureSpecification& specification);

/// How many were derived anew so far.
std::size_t structures_derived();

}  // namespace slew
