#include "server/guidance/planner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "server/guidance/plan_certificate.hpp"
#include "server/guidance/plan_search.hpp"
#include "server/guidance/profile_program.hpp"

namespace slew {

namespace {

// Times that agree so well are one optimum's.
constexpr double kSameTime = 2e-6;

std::string sentence(const Plan& plan, bool is_on_off) {
  switch (plan.status) {
    case PlanStatus::extremal:
      if (plan.certificate.throttled_s > 0)
        return "an extremal: along singular arcs controls are throttled, elsewhere their signs agree with "
               "Pontryagin's principle; nothing shorter was found, which is no proof that nothing is";
      return plan.family == ProfileFamily::on_off
                 ? "an extremal: the signs of all controls agree with Pontryagin's principle; nothing "
                   "shorter was "
                   "found, which is no proof that nothing is"
                 : "an optimum of its family: no small change of the parameters is shorter";
    case PlanStatus::nearly_extremal:
      return is_on_off
                 ? "an extremal but for a singular arc, along which a control that is on or off can only "
                   "switch often: setting its sign right saves next to nothing"
                 : "an extremal but for signs that are wrong for a while: setting them right saves next "
                   "to nothing";
    case PlanStatus::best_found:
      return plan.log.ended_by == SearchEnd::evaluations || plan.log.ended_by == SearchEnd::caller
                 ? "the best that was found before the search was stopped"
                 : "the best that was found; not shown to be an extremal";
    case PlanStatus::none:
      return plan.log.ended_by == SearchEnd::evaluations || plan.log.ended_by == SearchEnd::caller
                 ? "no maneuver that meets the conditions was found before the search was stopped"
                 : "no maneuver that meets the conditions was found";
    case PlanStatus::refused:
      return plan.faults.front().field + ": " + plan.faults.front().problem;
  }
  return {};
}

bool search(const ManeuverProblem& problem, const ManeuverBody& body, const PlannerOptions& options,
            SearchBudget& budget, Plan& plan) {
  return problem.family == ProfileFamily::on_off ? search_on_off(problem, body, options, budget, plan)
                                                 : search_profile(problem, body, options, budget, plan);
}

// Where SUNDIALS does not get to the end nothing vouches for the plan.
void certify(const ManeuverProblem& problem, const PlannerOptions& options, Plan& plan) {
  try {
    certify_flight(problem, plan, options.met, plan.certificate);
  } catch (const std::runtime_error&) {
    plan.certificate.meets_all = false;
    plan.certificate.attitude_error_rad = plan.certificate.rate_error_rad_s =
        std::numeric_limits<double>::infinity();
  }
}

bool is_there_already(const ManeuverProblem& problem) {
  return eigenaxis(problem.initial.attitude, problem.final.attitude).angle_rad < 1e-9 &&
         (problem.initial.rate_rad_s - problem.final.rate_rad_s).norm() < 1e-12 &&
         problem.initial.rate_rad_s.norm() < 1e-12 && problem.plant.is_free();
}

}  // namespace

bool SearchBudget::met(SearchLog& log, double time_s, double slack_s, std::vector<int> switches,
                       bool is_extremal) {
  const bool is_shortest = log.optima.empty() || time_s < log.optima.front().time_s;
  const auto same = std::find_if(log.optima.begin(), log.optima.end(), [&](const FoundOptimum& optimum) {
    return std::abs(optimum.time_s - time_s) <= kSameTime * time_s + slack_s;
  });
  if (same != log.optima.end()) {
    ++same->hits;
    if (time_s < same->time_s) same->time_s = time_s, same->switches = std::move(switches);
    same->is_extremal = same->is_extremal || is_extremal;
  } else {
    log.optima.push_back({time_s, std::move(switches), 1, is_extremal});
  }
  std::sort(log.optima.begin(), log.optima.end(),
            [](const FoundOptimum& a, const FoundOptimum& b) { return a.time_s < b.time_s; });
  if (log.optima.size() > 16) log.optima.pop_back();
  return is_shortest;
}

void SearchBudget::report(const SearchLog& log) const {
  if (!progress_->report) return;
  progress_->report(
      {log.starts, evaluations_,
       log.optima.empty() ? std::numeric_limits<double>::infinity() : log.optima.front().time_s});
}

bool SearchBudget::is_content(const SearchLog& log) const {
  return !log.optima.empty() && log.optima.front().hits >= options_->enough_hits;
}

Plan plan(const ManeuverProblem& problem, const PlannerOptions& options, const PlannerProgress& progress) {
  Plan plan;
  plan.family = problem.family;
  plan.faults = maneuver_faults(problem);
  if (!plan.faults.empty()) {
    plan.status = PlanStatus::refused;
    plan.why = sentence(plan, problem.plant.is_on_off);
    return plan;
  }
  const ManeuverBody body(problem.plant);
  if (is_there_already(problem)) {
    plan.status = PlanStatus::extremal;
    plan.why = "the body is there already";
    plan.family = ProfileFamily::on_off;
    plan.on_off.controls.assign(static_cast<std::size_t>(problem.plant.controls()), {0.0});
    plan.on_off.switch_times_s.resize(plan.on_off.controls.size());
    plan.certificate.meets_all = true;
    return plan;
  }
  SearchBudget budget(options, progress);
  const bool is_found = search(problem, body, options, budget, plan);
  plan.log.ended_by = budget.is_spent()                        ? budget.end()
                      : plan.log.starts >= options.most_starts ? SearchEnd::starts
                                                               : SearchEnd::content;
  plan.log.evaluations = budget.evaluations();
  plan.certificate.least_s = least_time_s(problem);
  if (is_found) {
    certify(problem, options, plan);
    // Rates are held at nodes: what they exceed between these is taken off the limit.
    ManeuverProblem tighter = problem;
    for (int round = 0; round < 5 && problem.most_rate_rad_s && !plan.certificate.meets_all; ++round) {
      const Eigen::Vector3d excess =
          (plan.certificate.peak_rate_rad_s - *problem.most_rate_rad_s).cwiseMax(0.0);
      if (excess.maxCoeff() <= 0) break;
      *tighter.most_rate_rad_s -= 1.05 * excess + 1e-7 * *problem.most_rate_rad_s;
      if (!(tighter.most_rate_rad_s->minCoeff() > 0)) break;
      PlannerOptions few = options;
      few.most_starts = 1;
      Plan again = plan;
      again.log = {};
      if (plan.family != ProfileFamily::on_off) {
        tighter.time_start_s = plan.time_s;
        tighter.parameters = profile_parameters(problem, plan.layout);
        for (std::size_t k = 0; k < plan.parameters.size(); ++k)
          tighter.parameters[k].start = plan.parameters[k];
      }
      SearchBudget more(few, progress);
      if (!search(tighter, body, few, more, again)) break;
      again.log = plan.log;
      again.log.evaluations = more.evaluations() + plan.log.evaluations;
      again.certificate.least_s = plan.certificate.least_s;
      plan = again;
      certify(problem, options, plan);
    }
    if (!plan.certificate.meets_all) plan.status = PlanStatus::none;
    if (plan.status != PlanStatus::none && budget.is_spent()) plan.status = PlanStatus::best_found;
  }
  plan.why = sentence(plan, problem.plant.is_on_off);
  return plan;
}

Eigen::VectorXd control_at(const ControlHistory& history, const RigidManeuverPlant& plant, double t_s) {
  Eigen::VectorXd u(plant.controls());
  for (Eigen::Index i = 0; i < u.size(); ++i)
    u[i] =
        control_of(history, static_cast<std::size_t>(i), plant.least_control[i], plant.most_control[i], t_s);
  return u;
}

std::optional<TorqueProgram> torque_program(const Plan& plan, const RigidManeuverPlant& plant) {
  if (plan.family != ProfileFamily::on_off || plant.controls() != 3 || plan.on_off.controls.size() != 3)
    return std::nullopt;
  TorqueProgram program;
  program.end_s = plan.time_s;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Vector3d torque = plant.influence_N_m.col(i);
    const Eigen::Vector3d about_axis = torque[i] * Eigen::Vector3d::Unit(i);
    if (!(torque - about_axis).isZero(1e-12 * torque.norm())) return std::nullopt;
    for (const double u : plan.on_off.controls[at])
      if (std::abs(u) != std::abs(plan.on_off.controls[at].front()) || u == 0) return std::nullopt;
    program.initial_torque_N_m[i] = torque[i] * plan.on_off.controls[at].front();
    program.switch_times_s[at] = plan.on_off.switch_times_s[at];
  }
  return program;
}

}  // namespace slew
