// A plan flown again by SUNDIALS: what a planner's own propagation may not vouch for.
#pragma once

#include <stdexcept>

#include "server/guidance/planner.hpp"

namespace slew {

/// Controls that spin a body up take the longer the further it has turned; a maneuver does not.
struct MotionTooLong : std::runtime_error {
  using runtime_error::runtime_error;
};

/// Fills what is found by flying; the rest of the certificate stays as it is. Throws MotionTooLong.
void certify_flight(const ManeuverProblem& problem, const Plan& plan, double met,
                    PlanCertificate& certificate);

/// The state at `times_s` (ascending), by SUNDIALS likewise. Throws MotionTooLong.
std::vector<RigidState> fly_controls(const ManeuverProblem& problem, const ControlHistory& history,
                                     const std::vector<double>& times_s);

}  // namespace slew
