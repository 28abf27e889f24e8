// A plan flown again by SUNDIALS: what a planner's own propagation may not vouch for.
#pragma once

#include "server/guidance/planner.hpp"

namespace slew {

/// Fills what is found by flying; the rest of the certificate stays as it is.
void certify_flight(const ManeuverProblem& problem, const Plan& plan, double met,
                    PlanCertificate& certificate);

/// The state at `times_s` (ascending), by SUNDIALS likewise.
std::vector<RigidState> fly_controls(const ManeuverProblem& problem, const ControlHistory& history,
                                     const std::vector<double>& times_s);

}  // namespace slew
