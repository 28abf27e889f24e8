// Work done for nothing, so that a cheap plant costs as much as a dear one would.
#pragma once

#include <cstdint>
#include <memory>

#include "server/simulation/run.hpp"

namespace slew {

/// The same run, to the last bit, with so many floating-point operations more in every propagator step.
std::unique_ptr<Run> with_ballast(std::unique_ptr<Run> run, std::uint64_t operations_per_step);

}  // namespace slew
