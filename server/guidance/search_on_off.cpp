#include <algorithm>
#include <cmath>
#include <limits>

#include "server/guidance/maneuver_starts.hpp"
#include "server/guidance/on_off_search.hpp"
#include "server/guidance/plan_search.hpp"

namespace slew {

namespace {

// Of the maneuver's time: optima that differ by less, and by no more than each of them may still save, are
// one.
constexpr double kMostSlack = 1e-4;

std::vector<int> switch_counts(const OnOffProgram& program) {
  std::vector<int> counts;
  for (const auto& times : program.switch_times_s) counts.push_back(static_cast<int>(times.size()));
  return counts;
}

// The shorter; of two that are of a length the one that is an extremal.
bool is_better(const OnOffSolution& one, const OnOffSolution& other) {
  constexpr double kAlike = 1e-6;
  const double longer = one.maneuver.end_s / other.maneuver.end_s - 1;
  if (std::abs(longer) > kAlike || is_extremal(one) == is_extremal(other)) return longer < 0;
  return is_extremal(one);
}

OnOffProgram given_start(const ManeuverProblem& problem, const ManeuverStarts& starts) {
  OnOffProgram start = starts.start_of(problem.sequences, 0);
  double last = 0;
  for (const auto& times : problem.switch_starts_s)
    for (const double time : times) last = std::max(last, time);
  start.switch_times_s = problem.switch_starts_s;
  start.end_s = problem.time_start_s.value_or(std::max(1.2 * last, start.end_s));
  return start;
}

// A neighbour: a segment of another value put in at random.
OnOffProgram changed(const OnOffProgram& maneuver, const RigidManeuverPlant& plant,
                     const RandomStream& random, std::uint64_t k) {
  OnOffProgram neighbour = maneuver;
  const auto n = static_cast<double>(maneuver.controls.size());
  const auto i = std::min(maneuver.controls.size() - 1, static_cast<std::size_t>(random.uniform(8 * k) * n));
  const auto row = static_cast<Eigen::Index>(i);
  const double choice = random.uniform(8 * k + 1);
  const double value = choice < 0.4 ? plant.most_control[row] : choice < 0.8 ? plant.least_control[row] : 0;
  const double from = random.uniform(8 * k + 2) * 0.98 * maneuver.end_s;
  insert_segment(neighbour, i, value, from,
                 from + (0.005 + 0.03 * random.uniform(8 * k + 3)) * maneuver.end_s);
  return without_short_segments(neighbour, 0);
}

}  // namespace

bool search_on_off(const ManeuverProblem& problem, const ManeuverBody& body, const PlannerOptions& options,
                   SearchBudget& budget, Plan& plan) {
  const ManeuverStarts starts(problem, body, options.seed);
  plan.certificate.eigenaxis_s = starts.eigenaxis().time_s;
  plan.certificate.critical_control = starts.eigenaxis().critical;
  OnOffSearch search(problem, body, [&budget] { return budget.spend(); });
  const bool is_fixed = !problem.sequences.empty();
  std::optional<OnOffSolution> best;
  const auto take = [&](std::optional<OnOffSolution> found) {
    if (!found) {
      ++plan.log.failed_starts;
      return;
    }
    const double slack_s = is_fixed ? 0 : std::min(found->signs.saving_s, kMostSlack * found->maneuver.end_s);
    if (!best || found->maneuver.end_s < best->maneuver.end_s * (1 - 1e-7)) best = search.polish(*found);
    budget.met(plan.log, found->maneuver.end_s, slack_s, switch_counts(found->maneuver), is_extremal(*found));
    budget.report(plan.log);
  };
  // A plan that was found before, under limits that were not as tight.
  if (!plan.on_off.controls.empty())
    take(search.descend(plan.on_off, std::numeric_limits<double>::infinity()));
  for (int k = 0; k < options.most_starts && !budget.is_spent() && !(best && k == 0); ++k) {
    ++plan.log.starts;
    const auto start = static_cast<std::uint64_t>(k);
    if (!is_fixed) {
      const double worth = best ? 1.6 * best->maneuver.end_s : std::numeric_limits<double>::infinity();
      take(search.descend(starts.start(start), worth));
    } else if (k == 0 && !problem.switch_starts_s.empty()) {
      const OnOffProgram given = given_start(problem, starts);
      auto beside = search.settle_beside(given);
      take(beside ? std::move(beside) : search.settle(given));
      if (best) break;  // what was asked for is the optimum beside this start
    } else {
      const OnOffProgram chosen = starts.start_of(problem.sequences, start);
      auto settled = search.settle(chosen);
      take(settled ? std::move(settled) : search.settle_beside(chosen));
    }
    // Where most starts did not arrive, three that agree say little: as many again.
    const int arrived = k + 1 - plan.log.failed_starts;
    if (best && k + 1 >= options.least_starts && budget.is_content(plan.log) &&
        (is_fixed || best->is_rate_active || 2 * arrived >= options.least_starts ||
         k + 1 >= 2 * options.least_starts))
      break;
  }
  // Where a rate is on its limit the signs do not tell where a segment would help: neighbours are tried.
  if (best && best->is_rate_active && !is_fixed && plan.on_off.controls.empty()) {
    const RandomStream random(options.seed, RandomUse::maneuver_start, 1);
    for (std::uint64_t k = 0; k < 24 && !budget.is_spent(); ++k) {
      auto found = search.descend(changed(best->maneuver, body.plant, random, k), 0);
      if (found && found->maneuver.end_s < best->maneuver.end_s * (1 - 1e-7)) take(std::move(found));
    }
  }
  // No slower than turning about the eigenaxis, whatever the starts came to.
  const double eigenaxis_s = starts.eigenaxis().time_s;
  for (int slots = 8; slots <= 32 && !is_fixed && starts.turns_about_the_eigenaxis() && !budget.is_spent() &&
                      !(best && best->maneuver.end_s < eigenaxis_s);
       slots *= 2)
    take(search.descend(starts.about_the_eigenaxis(slots), std::numeric_limits<double>::infinity()));
  if (best && !is_fixed && !budget.is_spent()) {
    const bool may_throttle = !body.plant.is_on_off && is_worth_refining(*best);
    const auto throttled = may_throttle ? search.throttled(*best) : std::nullopt;
    if (throttled && is_extremal(*throttled)) {
      best = throttled;
    } else {
      const OnOffSolution refined = search.refine(*best);
      if (refined.violation <= std::max(best->violation, 1e-7)) best = refined;
      if (throttled && is_better(*throttled, *best)) best = throttled;
      if (may_throttle && !is_extremal(*best)) {
        const auto again = search.throttled(*best);
        if (again && is_better(*again, *best)) best = again;
      }
    }
    if (!plan.log.optima.empty())
      budget.met(plan.log, best->maneuver.end_s, kMostSlack * best->maneuver.end_s,
                 switch_counts(best->maneuver), is_extremal(*best));
  }
  plan.log.programs_solved = search.programs_solved();
  if (!best) return false;
  plan.on_off = best->maneuver;
  plan.time_s = best->maneuver.end_s;
  plan.consumption = consumption_of(best->maneuver, body.plant);
  PlanCertificate& certificate = plan.certificate;
  certificate.residual = best->residual;
  certificate.violating_s = best->signs.violating_s;
  certificate.worst_sign = best->signs.worst;
  certificate.signs_were_tested = !best->is_rate_active;
  certificate.final_costate = best->signs.multipliers.terminal;
  certificate.price = best->signs.multipliers.consumption;
  certificate.throttled_s = best->signs.throttled_s;
  certificate.legendre_clebsch = best->signs.legendre_clebsch;
  certificate.saving_s = best->signs.saving_s;
  plan.status = is_extremal(*best)          ? PlanStatus::extremal
                : is_nearly_extremal(*best) ? PlanStatus::nearly_extremal
                                            : PlanStatus::best_found;
  return true;
}

}  // namespace slew
