#include "server/experiment/planning.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/experiment/plan_document.hpp"
#include "server/guidance/plan_certificate.hpp"
#include "server/guidance/planned_motion.hpp"

namespace slew {
namespace {

using nlohmann::json;

// What is given is flown by other means too, so that it is known where it ends.
Plan plan_of_given(const PlanningTask& task) {
  Plan plan;
  static_cast<ControlHistory&>(plan) = *task.given;
  certify_flight(task.problem, plan, PlannerOptions{}.met, plan.certificate);
  plan.consumption = plan.certificate.consumption;
  plan.why = "given";
  return plan;
}

// Of the two p of the initial attitude the one from which the plan leads to the final one.
void begin_where_planned(AttitudeSpecification& spec, const MrpTable& motion) {
  const Eigen::Vector3d planned = motion.knots.front().after.mrp;
  Eigen::Vector3d& p = spec.maneuver.initial_mrp;
  if ((p - planned).squaredNorm() > (mrp_shadow<double>(p) - planned).squaredNorm())
    p = mrp_shadow<double>(p);
}

}  // namespace

json plan_maneuver(const PlanningTask& task, const PlanningWatch& watch) {
  if (task.given) return plan_document(task, plan_of_given(task), false);
  bool is_out_of_time = false;
  PlannerProgress progress;
  progress.keep_going = [&] {
    if (watch.is_called_off && watch.is_called_off()) return false;
    is_out_of_time = task.time_budget_s && watch.elapsed_s && watch.elapsed_s() > *task.time_budget_s;
    return !is_out_of_time;
  };
  progress.report = [&](const PlannerState& state) {
    if (!watch.report) return;
    const auto share = [](int done, int most) { return static_cast<double>(done) / std::max(1, most); };
    watch.report(std::min(0.99, std::max(share(state.starts, task.options.least_starts),
                                         share(state.evaluations, task.options.most_evaluations))));
  };
  const Plan found = plan(task.problem, task.options, progress);
  return plan_document(task, found, is_out_of_time);
}

std::optional<RunFailure> adopt_plan(Prepared& prepared, const json& document) {
  prepared.plan = document.dump();
  const json& status = document.at("status");
  if (status == "none" || status == "refused")
    return RunFailure{"no_plan", "no maneuver was found: " + document.at("why").get<std::string>()};
  const PlanningTask& task = *prepared.planning;
  auto& spec = std::get<AttitudeSpecification>(prepared.system);
  const ControlHistory history = controls_of(document);
  const auto motion = std::make_shared<const MrpTable>(planned_motion(task.problem, history));
  if (!spec.plant.shadow_switch_norm) begin_where_planned(spec, *motion);
  if (auto* followed = std::get_if<PlannedMotion>(&spec.maneuver.reference.shape)) followed->table = motion;
  if (auto* flown = std::get_if<PlannedTorque>(&spec.law)) {
    const RigidManeuverPlant& plant = task.problem.plant;
    flown->planned = std::make_shared<const PlannedControls>(PlannedControls{
        history, {plant.influence_N_m, plant.least_control, plant.most_control}, breaks_of(history)});
  }
  // Superposition holds about a principal axis only.
  constexpr double kElsewhere_rad = 1e-3;
  const double error =
      task.impulses.empty() ? 0 : double(document.at("certificate").at("attitude_error_rad"));
  if (error > kElsewhere_rad)
    prepared.warnings.push_back("the shaped controls end " + number(error * 180 / std::numbers::pi) +
                                " deg from the final attitude: where unshaped ones end, they end too only "
                                "about a principal axis");
  if (history.time_s > spec.duration_s)
    prepared.warnings.push_back("the maneuver takes " + number(history.time_s) +
                                " s and the run ends before, at simulation.duration_s");
  if (status == "best_found")
    prepared.warnings.push_back("the maneuver is the best that was found, and not shown to be optimal: " +
                                document.at("why").get<std::string>());
  return std::nullopt;
}

}  // namespace slew
