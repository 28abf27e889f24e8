#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "server/guidance/maneuver_starts.hpp"
#include "server/guidance/on_off_search.hpp"
#include "server/guidance/plan_search.hpp"
#include "server/guidance/profile_program.hpp"

namespace slew {

namespace {

// The conditions of Karush, Kuhn and Tucker at a point: gradients of what is active add up to the
// objective's.
struct Optimality {
  double residual = 0;
  bool has_right_signs = true;
  Eigen::Matrix<double, 6, 1> terminal = Eigen::Matrix<double, 6, 1>::Zero();
  double price = 0;  ///< multiplier of the first inequality
};

Optimality optimality(const NonlinearProgram& program, const Eigen::VectorXd& at, bool limits_consumption) {
  constexpr double kActive = 1e-6;
  NonlinearValues values;
  program.evaluate(at, values);
  std::vector<Eigen::Index> active, inside;
  for (Eigen::Index i = 0; i < values.positive.size(); ++i)
    if (values.positive[i] < kActive) active.push_back(i);
  for (Eigen::Index j = 0; j < at.size(); ++j)
    if (at[j] - program.least[j] > kActive && program.most[j] - at[j] > kActive) inside.push_back(j);
  const auto rows = static_cast<Eigen::Index>(active.size()) + 6;
  Eigen::MatrixXd all(rows, at.size());
  all.topRows(6) = values.equal_slope;
  for (std::size_t k = 0; k < active.size(); ++k)
    all.row(6 + static_cast<Eigen::Index>(k)) = -values.positive_slope.row(active[k]);
  const Eigen::MatrixXd of_inside = all(Eigen::all, inside);
  const Eigen::VectorXd slope = values.slope(inside);
  const Eigen::VectorXd multipliers = of_inside.transpose().completeOrthogonalDecomposition().solve(-slope);
  Optimality optimality;
  optimality.residual = (of_inside.transpose() * multipliers + slope).lpNorm<Eigen::Infinity>();
  optimality.terminal = multipliers.head<6>();
  for (Eigen::Index k = 6; k < rows; ++k) optimality.has_right_signs &= multipliers[k] > -1e-6;
  if (limits_consumption && !active.empty() && active.front() == 0) optimality.price = multipliers[6];
  // Bounds hold back what would go on.
  const Eigen::VectorXd reduced = values.slope + all.transpose() * multipliers;
  for (Eigen::Index j = 0; j < at.size(); ++j) {
    if (at[j] - program.least[j] <= kActive) optimality.has_right_signs &= reduced[j] > -1e-5;
    if (program.most[j] - at[j] <= kActive) optimality.has_right_signs &= reduced[j] < 1e-5;
  }
  return optimality;
}

struct Start {
  std::vector<ProfileParameter> parameters;
  double time_s;
};

// The k-th start: parameters that are free are put where the double integrators of maneuver_starts.hpp want
// them, with the signs of the k-th corner of the control cube.
Start start_at(const ManeuverProblem& problem, const ManeuverStarts& starts, const ProfileLayout& layout,
               std::vector<ProfileParameter> parameters, std::uint64_t k, std::uint64_t seed) {
  const EigenaxisManeuver& eigenaxis = starts.eigenaxis();
  const RandomStream random(seed, RandomUse::maneuver_start, 2);
  const auto draw = [&](std::uint32_t which) { return random.uniform(64 * k + which); };
  const auto put = [&](std::size_t place, double value) {
    ProfileParameter& parameter = parameters[place];
    if (parameter.is_fixed) return;
    parameter.start = std::clamp(value, parameter.least, parameter.most);
  };
  const double largest = std::max(eigenaxis.effort_s2.cwiseAbs().maxCoeff(), 1e-300);
  const double angle = std::max(eigenaxis.eigenaxis.angle_rad, 1e-3);
  if (layout.family == ProfileFamily::impulses) {
    // Each bump's area is its peak times t1: the rate about the eigenaxis that it gives is the least that the
    // limits allow.
    double rate = std::sqrt(angle / largest) * (0.3 + 0.6 * draw(1));
    double per_rate = 0;
    for (std::size_t i = 0; i < layout.controls; ++i)
      per_rate += 2 * problem.plant.consumption(static_cast<Eigen::Index>(i)) *
                  std::abs(eigenaxis.effort_s2[static_cast<Eigen::Index>(i)]);
    if (problem.most_consumption && per_rate > 0)
      rate = std::min(rate, *problem.most_consumption / per_rate * (0.7 + 0.3 * draw(2)));
    if (problem.most_rate_rad_s)
      for (int axis = 0; axis < 3; ++axis)
        rate = std::min(rate, (0.7 + 0.25 * draw(2)) * (*problem.most_rate_rad_s)[axis] /
                                  std::max(std::abs(eigenaxis.eigenaxis.axis[axis]), 1e-9));
    const double time = angle / rate + largest * rate;
    for (std::size_t i = 0; i < layout.controls; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double impulse = eigenaxis.effort_s2[row] * rate / time;
      ProfileParameter& t1 = parameters[layout.t1(i)];
      put(layout.t1(i), std::abs(impulse) / (0.4 + 0.6 * draw(8 + static_cast<std::uint32_t>(i))));
      put(layout.amplitude(i), impulse / t1.start);
      put(layout.last_peak(i), -impulse / t1.start);
    }
    return {std::move(parameters), problem.time_start_s.value_or(time)};
  }
  bool is_single = true;
  for (const int count : layout.switches) is_single &= count <= 1;
  // One switch each is an eigenaxis maneuver, nearly; more of them are faster.
  const double boldest = 2 * std::sqrt(angle / std::max(eigenaxis.boldest_rad_s2, 1e-300));
  const double slow = 1.1 * eigenaxis.synthetic_s;
  double time = is_single
                    ? slow * (0.95 + 0.3 * draw(1))
                    : 1.2 * boldest * std::pow(std::max(slow / (1.2 * boldest), 1.0), draw(1) * draw(1));
  if (k >= 4 && is_single && !problem.plant.is_free()) time *= 1 + draw(3);
  if (problem.time_start_s) time = *problem.time_start_s * (k == 0 ? 1 : 0.9 + 0.3 * draw(1));
  for (std::size_t i = 0; i < layout.controls; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto which = static_cast<std::uint32_t>(8 + 4 * i);
    const double part = std::clamp(4 * eigenaxis.effort_s2[row] * angle / (time * time), -1.0, 1.0);
    const bool is_critical = static_cast<Eigen::Index>(i) == eigenaxis.critical || std::abs(part) > 0.9;
    const int count = layout.switches[i];
    double sign = ((k >> (i % 3)) & 1U) ? -1 : 1;
    if (is_critical || count <= 1) sign = part < 0 ? -1 : 1;
    if (count <= 1) {
      // A switch that is not critical is strong only where others undo what it does.
      const double size = is_single ? std::abs(eigenaxis.effort_s2[row]) / largest : 0.3 + 0.7 * draw(which);
      put(layout.amplitude(i), sign * size);
      // The first starts hold to the eigenaxis; later ones less, for moments of the surroundings.
      const bool is_near = k < 4 || problem.plant.is_free();
      const double spread = is_near ? 0.04 : 0.8;
      if (count == 1) put(layout.first_switch(i), 0.5 + spread * (draw(which + 1) - 0.5));
      if (!is_near && !is_critical) put(layout.amplitude(i), 2 * draw(which + 2) - 1);
      continue;
    }
    // u has the sign of a prod(p_j - t) just after 0: that of a.
    put(layout.amplitude(i), sign * (0.6 + 0.4 * draw(which)));
    const double a = std::clamp(0.25 * (1 + sign * part) + 0.12 * (2 * draw(which + 1) - 1), 0.03, 0.47);
    for (int j = 0; j < count; ++j)
      put(layout.first_switch(i) + static_cast<std::size_t>(j),
          count == 2 ? a + 0.5 * j : (j + draw(which + 2)) / count);
  }
  return {std::move(parameters), time};
}

// Switching at once takes a little less time than switching smoothly: the shortest on-off maneuvers with as
// many switches are good starts.
std::vector<Start> on_off_starts(const ManeuverProblem& problem, const ManeuverBody& body,
                                 const ManeuverStarts& starts, const ProfileLayout& layout,
                                 const std::vector<ProfileParameter>& given, SearchBudget& budget) {
  constexpr std::uint64_t kTried = 24;
  constexpr double kLonger = 1.13, kSmaller = 0.95;
  ManeuverProblem switching = problem;
  switching.family = ProfileFamily::on_off;
  switching.most_consumption.reset();
  switching.most_rate_rad_s.reset();
  OnOffSearch search(switching, body, [&budget] { return budget.spend(); });
  std::vector<OnOffProgram> found;
  for (std::uint64_t k = 0; k < kTried && !budget.is_spent(); ++k) {
    std::vector<SwitchSequence> sequences(layout.controls);
    for (std::size_t i = 0; i < layout.controls; ++i) {
      int sign = ((k >> (i % 3)) & 1U) ? -1 : 1;
      for (int j = 0; j <= layout.switches[i]; ++j, sign = -sign) sequences[i].push_back(sign);
    }
    if (const auto solution = search.settle(starts.start_of(sequences, k)))
      found.push_back(solution->maneuver);
  }
  std::sort(found.begin(), found.end(),
            [](const OnOffProgram& a, const OnOffProgram& b) { return a.end_s < b.end_s; });
  std::vector<Start> result;
  for (const OnOffProgram& maneuver : found) {
    if (!result.empty() && maneuver.end_s * kLonger < result.back().time_s * (1 + 1e-5)) continue;
    Start start{given, maneuver.end_s * kLonger};
    for (std::size_t i = 0; i < layout.controls; ++i) {
      const auto put = [&](std::size_t place, double value) {
        if (!start.parameters[place].is_fixed) start.parameters[place].start = value;
      };
      put(layout.amplitude(i), maneuver.controls[i].front() < 0 ? -kSmaller : kSmaller);
      for (std::size_t j = 0; j < maneuver.switch_times_s[i].size(); ++j)
        put(layout.first_switch(i) + j, maneuver.switch_times_s[i][j] / maneuver.end_s);
    }
    result.push_back(std::move(start));
    if (result.size() == 5) break;
  }
  return result;
}

}  // namespace

bool search_profile(const ManeuverProblem& problem, const ManeuverBody& body, const PlannerOptions& options,
                    SearchBudget& budget, Plan& plan) {
  constexpr double kMet = 1e-7;
  constexpr int kLeastStarts = 8;  // each costs as much as ten of on-off maneuvers
  const ManeuverStarts starts(problem, body, options.seed);
  plan.certificate.eigenaxis_s = starts.eigenaxis().time_s;
  plan.certificate.critical_control = starts.eigenaxis().critical;
  plan.layout = profile_layout(problem);
  const std::vector<ProfileParameter> given = profile_parameters(problem, plan.layout);
  std::vector<Start> informed;
  const bool is_given = !problem.parameters.empty();
  if (problem.family == ProfileFamily::smooth_switches && plan.layout.switch_count() >= 5 &&
      options.most_starts > 1)
    informed = on_off_starts(problem, body, starts, plan.layout, given, budget);
  bool has_best = false, is_best_informed = false;
  for (int k = 0; k < options.most_starts && !budget.is_spent(); ++k) {
    ++plan.log.starts;
    Start start{given, 0};
    const auto next = static_cast<std::size_t>(is_given ? k - 1 : k);
    if (k == 0 && is_given) {
      start.time_s = problem.time_start_s.value_or(1.1 * starts.eigenaxis().synthetic_s);
    } else if (next < informed.size()) {
      start = informed[next];
    } else {
      start = start_at(problem, starts, plan.layout, given, static_cast<std::uint64_t>(k), options.seed);
    }
    const ProfileProgram program(problem, body, plan.layout, start.parameters, start.time_s);
    SequentialOptions sequential;
    sequential.tolerance = 1e-9;
    sequential.most_evaluations = 150;
    sequential.keep_going = [&budget] { return budget.spend(); };
    const SequentialResult result = minimize(program.nonlinear(), program.start(), sequential);
    ++plan.log.programs_solved;
    if (!(result.violation <= kMet)) {
      ++plan.log.failed_starts;
      continue;
    }
    const Optimality conditions =
        optimality(program.nonlinear(), result.at, problem.most_consumption.has_value());
    const bool is_extremal = conditions.residual < 1e-4 && conditions.has_right_signs;
    const double time = program.time_s(result.at);
    if (budget.met(plan.log, time, 0, plan.layout.switches, is_extremal)) {
      has_best = true;
      is_best_informed = next < informed.size();
      plan.time_s = time;
      plan.parameters = program.parameters(result.at);
      plan.certificate.residual = conditions.residual;
      plan.certificate.final_costate = conditions.terminal;
      plan.certificate.price = conditions.price;
      plan.status = is_extremal ? PlanStatus::extremal : PlanStatus::best_found;
    }
    budget.report(plan.log);
    if (is_best_informed && next >= informed.size()) break;
    if (k + 1 >= std::min(options.least_starts, kLeastStarts) && budget.is_content(plan.log)) break;
  }
  if (!has_best) return false;
  ProfileFlight flight(body, plan.layout);
  flight.fly(plan.parameters, plan.time_s, problem.initial, {});
  plan.consumption = flight.consumption();
  return true;
}

}  // namespace slew
