// When a single-axis arc leaves the side of the switching function's band it is on, and when it enters or
// leaves the end box.
#pragma once

#include <optional>

#include "server/control/switching_function.hpp"
#include "server/propagation/hub_path.hpp"
#include "server/propagation/modal_arc.hpp"
#include "server/propagation/quadratic_arc.hpp"

namespace slew {

struct SideCrossing {
  double tau;
  SwitchingSide entered;
};

/// The first time in [0, h] at which s leaves `side`. A crossing counts when s is beyond the end of the band
/// at the end of a monotone piece, so that starting on the end itself is no crossing unless s moves outwards.
/// An arc that begins on an end, to rounding, must get past it by `margin_rad`.
std::optional<SideCrossing> side_crossing(const QuadraticArc<double>& arc, const SwitchingFunction& law,
                                          SwitchingSide side, double h, double margin_rad = 0);

std::optional<SideCrossing> side_crossing(const ModalArc& arc, const SwitchingFunction& law,
                                          SwitchingSide side, double h, double margin_rad = 0);

/// The sign of ds/dtau just after the start of the arc (0 when s stands still).
int side_motion(const QuadraticArc<double>& arc, const SwitchingFunction& law);
int side_motion(const ModalArc& arc, const SwitchingFunction& law);

/// The first time in [0, h] at which the arc enters the box (when `inside` is false) or leaves it. Visits
/// shorter than `resolution` are rounding: an arc that starts on a side of the box has just crossed it.
std::optional<double> box_crossing(const QuadraticArc<double>& arc, const EndBox& box, double final_angle_rad,
                                   bool inside, double h, double resolution);

std::optional<double> box_crossing(const HubPath& path, const EndBox& box, double final_angle_rad,
                                   bool inside, double h, double resolution);

std::optional<double> box_crossing(const ModalArc& arc, const EndBox& box, double final_angle_rad,
                                   bool inside, double h, double resolution);

}  // namespace slew
