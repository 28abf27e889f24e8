// A flexible structure in a resolved request, in SI.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/experiment/document.hpp"
#include "server/experiment/sound_fields.hpp"
#include "server/simulation/structure.hpp"
#include "server/simulation/structure_system.hpp"

namespace slew {

/// Of type flexible_structure.
bool is_structure(const nlohmann::json& plant);
/// The same of a request; where its plant is not sound, whether its law is for one.
bool has_structure(const SoundFields& fields);

/// What no schema can say of a request for a structure; and of another plant's that has words for one.
void check_structure(const SoundFields& fields, const Violate& violate);
void check_no_structure(const SoundFields& fields, const Violate& violate);

// The rest expects what the schema has passed.

/// Its system is taken from those derived lately where nothing that it depends on has changed.
StructureSpecification specify_structure(const nlohmann::json& request);
std::optional<Violation> why_it_cannot_be_built(const StructureSpecification& specification);
std::vector<std::string> warnings_about(const StructureSpecification& specification);

/// For which loads, and where, responses are told: the Krylov vectors' of the plant or the design, or what
/// the sensors see, or the antenna's displacements.
std::vector<NodeMotion> response_motions(const StructureSpecification& specification);

}  // namespace slew
