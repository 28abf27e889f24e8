// The motion that controls make of a rigid body, as a reference p_d(t) for laws that track.
#pragma once

#include "server/control/control_history.hpp"
#include "server/control/mrp_table.hpp"
#include "server/guidance/maneuver_problem.hpp"

namespace slew {

/// Relative to the problem's final attitude, by SUNDIALS at 1e-12; between knots it errs by less than 1e-9.
/// Of the two p of an attitude it is the one that vanishes at the end.
MrpTable planned_motion(const ManeuverProblem& problem, const ControlHistory& history);

}  // namespace slew
