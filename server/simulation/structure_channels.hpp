// The channels of a flexible structure's telemetry, and what stands in them.
#pragma once

#include <span>

#include "server/simulation/structure_loop.hpp"

namespace slew {

ChannelTable structure_channels(const StructureSpecification& specification);

/// A row of them. `z` and `rate` are the plant's coordinates; `controls` one for each actuator.
void fill_structure_row(const StructureSpecification& specification, double t_s, std::span<const double> z,
                        std::span<const double> rate, std::span<const double> controls,
                        std::span<double> state, std::span<double> thrusters);

}  // namespace slew
