// Plants that are frames. Of type flexible_axis_frame: beams, bars and point masses on a hub, from which the
// modes and the couplings of a flexible axis are derived (Agrawal & Bang 1995, Eq. 22 with the superscripts
// put right). Of type flexible_structure: the same with plates, which flies as it is.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "server/experiment/document.hpp"
#include "server/plant/single_axis.hpp"
#include "server/structure/hub_coupling.hpp"
#include "server/structure/mass_properties.hpp"

namespace slew {

bool is_frame(const nlohmann::json& plant);

/// What no schema can say of either kind of frame, all at once; of its modes, when it can be assembled at
/// all. Empty for another plant, and where `schema_violations` leave no whole plant to judge. What it costs
/// is bounded by max_frame_coordinates.
std::vector<Violation> frame_violations(const nlohmann::json& request,
                                        const std::vector<Violation>& schema_violations);

// The rest expects a plant that the schema has passed; those that derive, one without violations.

SpaceFrame specify_frame(const nlohmann::json& plant);
/// Of unit length: as given, or the normal of the plane, or z. Zero where the one given is.
Eigen::Vector3d hub_axis(const nlohmann::json& plant);

/// An appendage and what follows from it.
struct DerivedFrame {
  AssembledFrame assembled;
  NormalModes clamped;   ///< all of them
  HubCoupling coupling;  ///< of all of them
  double hub_inertia_kg_m2;
  double inertia_kg_m2;  ///< of hub and frame
};

/// Throws std::domain_error when the frame can move in a way that has neither stiffness nor mass.
DerivedFrame derive_frame(const nlohmann::json& plant);

/// What flies: the modes that are kept, |D| for D.
SingleAxisPlant keep_modes(const nlohmann::json& plant, const DerivedFrame& frame);
SingleAxisPlant specify_frame_plant(const nlohmann::json& plant);

}  // namespace slew
