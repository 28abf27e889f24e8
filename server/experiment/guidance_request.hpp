// The guidance block of a request: a maneuver that is planned, or given, before it is flown.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/experiment/document.hpp"
#include "server/experiment/sound_fields.hpp"
#include "server/guidance/impulse_shaper.hpp"
#include "server/guidance/modal_surrogate.hpp"
#include "server/guidance/planner.hpp"
#include "server/simulation/attitude.hpp"

namespace slew {

/// What a plan is made from. Immutable.
struct PlanningTask {
  ManeuverProblem problem;              ///< consumption in m^3 of gas, or in kg of propellant
  std::optional<ControlHistory> given;  ///< then nothing is searched for
  const char* consumed = nullptr;       ///< "gas_m3" or "propellant_kg"; null: not known
  PlannerOptions options;
  std::optional<double> time_budget_s;  ///< wall time
  std::vector<SurrogateMode> vibration;
  ImpulseShaper shaper;           ///< of the controls that are given
  std::vector<Impulse> impulses;  ///< that it makes; `given` has them in it
  double unshaped_end_s = 0;      ///< of what is given
  std::string problem_text;       ///< all that the plan depends on, the same for the same plan
};

/// What no schema can say of a guidance block, and of what else must be there with it.
void check_guidance(const SoundFields& fields, const Violate& violate);

/// Of a resolved request that has passed; null: nothing is planned.
std::shared_ptr<const PlanningTask> planning_task(const nlohmann::json& resolved,
                                                  const AttitudeSpecification& specification);

/// The surrogate's modes, as a shaper counts them.
std::vector<VibratingMode> own_modes(const PlanningTask& task);

/// What is wrong with the problem itself, at the places of the request.
std::vector<Violation> planning_violations(const PlanningTask& task, const nlohmann::json& resolved);

}  // namespace slew
