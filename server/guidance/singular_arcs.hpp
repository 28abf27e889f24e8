// Singular arcs: control i stays between its bounds while S_i = 0 (Kumar & Seywald 1991). An on-off maneuver
// shows where they are: there it switches often, and S_i stays about zero. Throttled, an arc is flown in
// pieces of one length, each at a level of its own: what is lost falls with the fourth power of their number,
// as the state sees the integral of the control only (Kelley 1964).
#pragma once

#include "server/guidance/pontryagin.hpp"

namespace slew {

struct SingularArc {
  std::size_t control;
  double from_s, to_s;
};

/// Whether a control is throttled at a time.
bool is_throttled_at(const RigidManeuverPlant& plant, const OnOffProgram& maneuver, std::size_t control,
                     double time_s);

/// Where arcs seem to be, control after control in the order of time: those that are flown already, and where
/// a control switches or has the wrong sign while its value hardly matters. An arc ends where another control
/// switches: there its control jumps.
std::vector<SingularArc> likely_arcs(const RigidManeuverPlant& plant, const OnOffProgram& maneuver,
                                     const SignTest& signs);

/// Whether the first and the last piece are as long as the others, or half as long and free to be of another
/// length.
enum class ArcEnds { alike, free };

/// The arc flown in so many pieces; their levels follow the means of the control.
void throttle(const RigidManeuverPlant& plant, const SingularArc& arc, std::size_t pieces, ArcEnds ends,
              OnOffProgram& program);

/// Levels that are near a bound, in parts of its range, at the bound.
OnOffProgram with_saturated_levels(const RigidManeuverPlant& plant, OnOffProgram maneuver, double near);

/// A piece between segments that are not throttled is no arc: it becomes a switch, or a pulse, of the same
/// mean.
OnOffProgram without_lone_levels(const RigidManeuverPlant& plant, const OnOffProgram& maneuver);

}  // namespace slew
