// Quantiles of the standard normal distribution: algorithm AS 241, PPND16 (Wichura 1988, Applied Statistics
// 37, 477-484).
#pragma once

namespace slew {

/// The x below which a standard normal variable is with this probability; to about 1e-16 relative. Expects a
/// probability in (0, 1). Made of + - * / sqrt and log only.
double inverse_normal(double probability);

}  // namespace slew
