// The phase plane of an on-off law: what slewctl describe --plot draws.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "server/simulation/axis.hpp"

namespace slew {

/// {type: "phase_plane", edges, end_box, path}: the edges of the dead band as curves of [error_deg,
/// rate_deg_s], from the highest rate of the flown path to the lowest, and the path itself as [error_deg,
/// rate_deg_s, u] at times close enough to be drawn. Flies at most so many steps as that takes, and says when
/// that was not all.
nlohmann::json phase_plane(const OnOffAxisSpecification& specification);

}  // namespace slew
