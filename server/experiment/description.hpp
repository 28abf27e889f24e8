// Parts of a description, one for each kind of system.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "server/simulation/attitude.hpp"
#include "server/simulation/axis.hpp"
#include "server/simulation/structure.hpp"

namespace slew {

/// Inertia, frequencies clamped and free, poles.
nlohmann::json plant_document(const SingleAxisPlant& plant);

/// Inertia, principal moments and axes.
nlohmann::json rigid_body_document(const RigidBodyPlant& plant);

/// Mass properties, frequencies, reductions, responses, design and loads of a structure; of an outputs block.
nlohmann::json structure_model(const StructureSpecification& specification, const nlohmann::json& outputs);

/// All but warnings and request.
nlohmann::json system_document(const LinearAxisSpecification& specification);
nlohmann::json system_document(const OnOffAxisSpecification& specification);
nlohmann::json system_document(const AttitudeSpecification& specification);
nlohmann::json system_document(const StructureSpecification& specification);

/// What a picture of the design is drawn from. `type` tells what there is.
nlohmann::json design_document(const LinearAxisSpecification& specification);
nlohmann::json design_document(const OnOffAxisSpecification& specification);
nlohmann::json design_document(const AttitudeSpecification& specification);
nlohmann::json design_document(const StructureSpecification& specification);

}  // namespace slew
