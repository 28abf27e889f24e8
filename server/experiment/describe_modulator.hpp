// A modulator's static figures, as parts of a description.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>

#include "server/actuator/modulator.hpp"

namespace slew {

/// Parameters, and for each level (N m, or N) that channels have: dead band, saturation, a curve over the
/// demand up to 1.1 of the level. A sampled law's period matters to pulse width only.
nlohmann::json modulator_document(const Modulator& modulator, std::span<const double> levels,
                                  std::optional<double> sample_period_s);

/// What a picture of a channel is drawn from: {type: "modulator", unit, level, dead_band, curve, ...}.
nlohmann::json modulator_design(const Modulator& modulator, double level, const char* unit,
                                std::optional<double> sample_period_s);

}  // namespace slew
