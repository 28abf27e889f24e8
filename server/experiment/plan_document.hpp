// What a planner found, as the `plan` of a result.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "server/experiment/guidance_request.hpp"

namespace slew {

/// `is_out_of_time`: the search's time budget ended it.
nlohmann::json plan_document(const PlanningTask& task, const Plan& plan, bool is_out_of_time);

/// What is known before a search: eigenaxis, critical control, bounds (Vadali, Singh & Carter 1993, Eq. 6).
nlohmann::json problem_document(const PlanningTask& task);

}  // namespace slew
