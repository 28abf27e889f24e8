// Planning a request's maneuver, and taking the plan over into what is to be flown. The document that says
// what was found is all that is kept of a plan: the result shows it, a cache keeps it, and it is flown from
// it.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "server/experiment/experiment.hpp"
#include "server/experiment/guidance_request.hpp"

namespace slew {

/// What the caller of a search says and hears meanwhile; any may be empty.
struct PlanningWatch {
  std::function<bool()> is_called_off;
  std::function<double()> elapsed_s;   ///< wall time since it began, for its budget
  std::function<void(double)> report;  ///< progress, 0 to 1
};

/// The plan as a document (schemas/result.schema.json, `plan`). Its `status` "none" has nothing to fly.
nlohmann::json plan_maneuver(const PlanningTask& task, const PlanningWatch& watch = {});

/// The controls of a plan's document, to the bit.
ControlHistory controls_of(const nlohmann::json& plan);

/// What pictures of a plan are drawn from, at some thousand times: controls as parts of their most, rates,
/// Euler angles 1-2-3 and the angle left; and the surrogate's modes, where there are any.
nlohmann::json plan_curves(const PlanningTask& task, const nlohmann::json& plan);

/// Makes the plan what is flown or followed. Says why where there is none.
std::optional<RunFailure> adopt_plan(Prepared& prepared, const nlohmann::json& plan);

}  // namespace slew
