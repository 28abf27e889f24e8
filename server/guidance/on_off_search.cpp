#include "server/guidance/on_off_search.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "server/guidance/newton_program.hpp"
#include "server/guidance/singular_arcs.hpp"

namespace slew {

namespace {

// Of the maneuver's time: shorter segments have vanished.
constexpr double kVanished = 1e-6;
// Of the terminal error in units of t_ref.
constexpr double kMet = 1e-7;
// Of the maneuver's time: what must be left to be saved for another round of segments, while many starts are
// compared and of what was found at last. Where a control is singular (Kumar & Seywald 1991) no number of
// segments is enough.
constexpr double kWorthARound = 1e-4;
constexpr double kWorthRefining = 3e-6;
// Of the maneuver's time: what may be saved by more segments is not worth them.
constexpr double kNothingToSave = 5e-6;
// Of the Hamiltonian, which is -1.
constexpr double kSignsRight = 1e-4;
constexpr double kConditionsMet = 1e-5;
constexpr double kConditionsNearlyMet = 1e-3;
constexpr double kPolished = 1e-8;
// Of the maneuver's time: what taking levels for bounds may cost, and what more pieces of an arc must be
// worth.
constexpr double kSettled = 1e-7;
constexpr double kWorthMorePieces = 2e-7;
// Of an arc, one attempt after the other.
constexpr std::pair<std::size_t, ArcEnds> kPieces[] = {
    {8, ArcEnds::alike}, {16, ArcEnds::alike}, {16, ArcEnds::free}, {24, ArcEnds::free}};
constexpr std::size_t kMostSwitches = 240;
// Newton's method flies once for each switch in every step, and with more of them it gains nothing.
constexpr Eigen::Index kMostForNewton = 60;
// With levels it does: these are what SLSQP leaves undone.
constexpr Eigen::Index kMostWithLevels = 160;

// Newton's method may end at another root, which is longer.
const OnOffSolution& sound(const OnOffSolution& polished, const OnOffSolution& before) {
  const bool is_sound = polished.violation <= std::max(before.violation, 1e-9) &&
                        polished.maneuver.end_s < before.maneuver.end_s * (1 + 1e-6);
  return is_sound ? polished : before;
}

bool saves_next_to_nothing(const OnOffSolution& solution) {
  return !solution.is_rate_active && solution.signs.saving_s < kNothingToSave * solution.maneuver.end_s;
}

}  // namespace

bool is_extremal(const OnOffSolution& solution) {
  return saves_next_to_nothing(solution) && solution.residual < kConditionsMet &&
         solution.signs.worst < kSignsRight && solution.signs.legendre_clebsch >= 0;
}

bool is_nearly_extremal(const OnOffSolution& solution) {
  return saves_next_to_nothing(solution) && solution.residual < kConditionsNearlyMet;
}

bool is_worth_refining(const OnOffSolution& solution) {
  return !is_extremal(solution) || solution.signs.saving_s >= kWorthRefining * solution.maneuver.end_s;
}

OnOffProgram without_short_segments(const OnOffProgram& program, double shortest_s) {
  OnOffProgram shorter = program;
  for (std::size_t i = 0; i < program.controls.size(); ++i) {
    std::vector<double>& values = shorter.controls[i];
    std::vector<double>& times = shorter.switch_times_s[i];
    values.clear();
    times.clear();
    for (std::size_t k = 0; k < program.controls[i].size(); ++k) {
      const double from = k == 0 ? 0 : program.switch_times_s[i][k - 1];
      const double to = k + 1 == program.controls[i].size() ? program.end_s : program.switch_times_s[i][k];
      if (to - from <= shortest_s) continue;
      if (!values.empty() && values.back() == program.controls[i][k]) continue;
      if (!values.empty()) times.push_back(from);
      values.push_back(program.controls[i][k]);
    }
    if (values.empty()) values.push_back(program.controls[i].front());
  }
  return shorter;
}

void insert_segment(OnOffProgram& program, std::size_t control, double value, double from_s, double to_s) {
  std::vector<double>& values = program.controls[control];
  std::vector<double>& times = program.switch_times_s[control];
  const auto at = std::upper_bound(times.begin(), times.end(), from_s) - times.begin();
  const auto segment = static_cast<std::size_t>(at);
  const double around = values[segment];
  const double since = segment > 0 ? times[segment - 1] : 0;
  const double until = segment < times.size() ? times[segment] : program.end_s;
  const double tiny = 1e-9 * program.end_s;
  if (from_s <= since + tiny) {  // at its beginning
    times.insert(times.begin() + at, std::min(to_s, until));
    values.insert(values.begin() + at, value);
  } else if (to_s >= until - tiny) {  // at its end
    times.insert(times.begin() + at, from_s);
    values.insert(values.begin() + at + 1, value);
  } else {
    times.insert(times.begin() + at, {from_s, to_s});
    values.insert(values.begin() + at + 1, {value, around});
  }
}

bool OnOffSearch::may_go_on() {
  if (!was_stopped_ && keep_going_ && !keep_going_()) was_stopped_ = true;
  return !was_stopped_;
}

// Levenberg & Marquardt's steps towards a terminal error of zero: a start from which the quadratic program is
// not absurd.
bool OnOffSearch::restore(const SwitchTimeProgram& program, Eigen::VectorXd& z) {
  constexpr double kNear = 0.1;
  constexpr int kMostSteps = 12;
  const Eigen::Index n = z.size(), end = program.time_at();
  NonlinearValues values;
  program.nonlinear().evaluate(z, values);
  ++evaluations_;
  double damping = 1e-2, error = values.equal.norm();
  for (int step = 0; step < kMostSteps && error > kNear; ++step) {
    if (!may_go_on()) return false;
    const Eigen::MatrixXd normal =
        values.equal_slope.transpose() * values.equal_slope + damping * Eigen::MatrixXd::Identity(n, n);
    Eigen::VectorXd next = z - normal.ldlt().solve(values.equal_slope.transpose() * values.equal);
    next = next.cwiseMax(program.nonlinear().least).cwiseMin(program.nonlinear().most);
    next[end] = std::clamp(next[end], 0.6 * z[end], 1.5 * z[end]);
    // Lengths that do not fit in are made shorter alike.
    OnOffProgram fitted = program.program(next);
    for (auto& times : fitted.switch_times_s)
      if (!times.empty() && times.back() > fitted.end_s) {
        const double part = fitted.end_s / times.back();
        for (double& time : times) time *= part;
      }
    next = program.variables(fitted);
    NonlinearValues tried;
    program.nonlinear().evaluate(next, tried);
    ++evaluations_;
    if (tried.equal.norm() < error) {
      error = tried.equal.norm();
      z = next;
      std::swap(values, tried);
      damping = std::max(damping * 0.2, 1e-6);
    } else {
      damping *= 8;
      if (damping > 1e3) break;
    }
  }
  return error < 1;
}

// The nearest point that meets the conditions, of those variables and limits that are not at their bounds or
// beyond: Newton's method, each step the shortest.
Eigen::VectorXd OnOffSearch::finished(const SwitchTimeProgram& program, Eigen::VectorXd z) {
  NonlinearValues values;
  for (int step = 0; step < 4; ++step) {
    program.nonlinear().evaluate(z, values);
    ++evaluations_;
    std::vector<Eigen::Index> inside, active;
    for (Eigen::Index j = 0; j < z.size(); ++j)
      if (z[j] > program.nonlinear().least[j] + 1e-9 &&
          !(j > program.time_at() && z[j] > program.nonlinear().most[j] - 1e-9))
        inside.push_back(j);
    for (Eigen::Index i = 0; i < values.positive.size(); ++i)
      if (values.positive[i] < 1e-9) active.push_back(i);
    if (inside.empty()) break;
    const auto rows = static_cast<Eigen::Index>(active.size()) + 6;
    Eigen::MatrixXd slope(rows, static_cast<Eigen::Index>(inside.size()));
    Eigen::VectorXd value(rows);
    slope.topRows(6) = values.equal_slope(Eigen::all, inside);
    value.head<6>() = values.equal;
    for (std::size_t k = 0; k < active.size(); ++k) {
      const auto row = 6 + static_cast<Eigen::Index>(k);
      slope.row(row) = values.positive_slope(active[k], inside);
      value[row] = values.positive[active[k]];
    }
    if (value.lpNorm<Eigen::Infinity>() < 1e-11) break;
    const Eigen::VectorXd change = slope.completeOrthogonalDecomposition().solve(-value);
    for (std::size_t j = 0; j < inside.size(); ++j) z[inside[j]] += change[static_cast<Eigen::Index>(j)];
    const Eigen::Index levels = program.levels();
    z.tail(levels) = z.tail(levels)
                         .cwiseMax(program.nonlinear().least.tail(levels))
                         .cwiseMin(program.nonlinear().most.tail(levels));
  }
  return z;
}

std::optional<OnOffProgram> OnOffSearch::optimize(const OnOffProgram& start, double tolerance) {
  const SwitchTimeProgram program(*problem_, *body_, start);
  Eigen::VectorXd variables = program.variables(start);
  if (variables.size() < 6) return std::nullopt;
  if (!restore(program, variables)) return std::nullopt;
  SequentialOptions options;
  options.tolerance = tolerance;
  options.most_evaluations = 60 + 4 * static_cast<int>(variables.size());
  options.keep_going = [this] { return may_go_on(); };
  const SequentialResult result = minimize(program.nonlinear(), variables, options);
  evaluations_ += result.evaluations;
  ++solved_;
  Eigen::VectorXd at = result.at;
  if (result.violation > kMet && result.violation < 1e-2) at = finished(program, at);
  NonlinearValues values;
  program.nonlinear().evaluate(at, values);
  ++evaluations_;
  const double violation = std::max(values.equal.lpNorm<Eigen::Infinity>(), -values.positive.minCoeff());
  if (!(violation <= kMet) || (at - program.nonlinear().least).minCoeff() < 0) return std::nullopt;
  return program.program(at);
}

OnOffSolution OnOffSearch::judge(const OnOffProgram& maneuver, int steps) {
  OnOffSolution solution;
  solution.maneuver = maneuver;
  const SwitchTimeProgram program(*problem_, *body_, maneuver);
  NonlinearValues values;
  program.nonlinear().evaluate(program.variables(maneuver), values);
  solution.violation = std::max(values.equal.lpNorm<Eigen::Infinity>(), -values.positive.minCoeff());
  const auto controls = static_cast<Eigen::Index>(maneuver.controls.size());
  const auto switches = static_cast<Eigen::Index>(maneuver.switches());
  if (problem_->most_consumption) solution.is_consumption_active = values.positive[controls] < 1e-5;
  if (problem_->most_rate_rad_s)
    solution.is_rate_active = values.positive.tail(3 * (2 * switches + 1)).minCoeff() < 1e-6;
  solution.signs = test_signs(*problem_, *body_, program, maneuver, solution.is_consumption_active, steps);
  solution.residual = solution.signs.multipliers.residual;
  evaluations_ += 2;
  return solution;
}

std::optional<OnOffSolution> OnOffSearch::descend(const OnOffProgram& start, double worth_s) {
  auto maneuver = optimize(start, 1e-8);
  if (!maneuver) return std::nullopt;
  *maneuver = without_short_segments(*maneuver, kVanished * maneuver->end_s);
  OnOffSolution solution = judge(*maneuver, 80);
  if (maneuver->end_s > worth_s) return solution;
  return filled(std::move(solution), kWorthARound, 10, false);
}

// The worst of each control; or all of them, the worst first, while there is room.
OnOffProgram OnOffSearch::with_segments(const OnOffSolution& solution, double part, bool is_everywhere) {
  std::vector<SignViolation> violations = solution.signs.violations;
  std::stable_sort(violations.begin(), violations.end(),
                   [](const SignViolation& a, const SignViolation& b) { return a.saving_s > b.saving_s; });
  OnOffProgram filled = solution.maneuver;
  std::vector<bool> has_one(filled.controls.size(), false);
  for (const SignViolation& violation : violations) {
    if (filled.switches() + 2 > kMostSwitches) break;
    if (violation.saving_s < 0.05 * violations.front().saving_s) break;
    if (!is_everywhere && has_one[violation.control]) continue;
    // Where a control is throttled already more pieces help, not other values.
    if (is_throttled_at(body_->plant, solution.maneuver, violation.control, violation.peak_s)) continue;
    has_one[violation.control] = true;
    const double half = 0.5 * part * (violation.to_s - violation.from_s);
    const double from = std::max(violation.from_s, violation.peak_s - half);
    insert_segment(filled, violation.control, violation.value, from,
                   std::min(violation.to_s, from + 2 * half));
  }
  return filled;
}

// Wherever signs are wrong at once: along a singular arc each round makes three segments of one, and a ninth
// is left to be saved.
OnOffSolution OnOffSearch::refine(const OnOffSolution& solution) {
  return mended(polish(filled(polish(solution), kWorthRefining, 12, true)));
}

std::optional<OnOffProgram> OnOffSearch::optimize_levels(const OnOffProgram& start) {
  const SwitchTimeProgram program(*problem_, *body_, start);
  Eigen::VectorXd variables = program.variables(start);
  if (!restore(program, variables)) return std::nullopt;
  NewtonOptions options;
  const Eigen::Index n = variables.size(), levels = program.levels();
  options.steps = Eigen::VectorXd::Constant(n, 1e-6);
  options.steps.tail(levels).setConstant(1e-5);
  options.reach = Eigen::VectorXd::Constant(n, 0.05);
  options.reach.tail(levels) =
      0.5 * (program.nonlinear().most.tail(levels) - program.nonlinear().least.tail(levels));
  options.keep_going = [this] { return may_go_on(); };
  const SequentialResult result = minimize_by_newton(program.nonlinear(), variables, options);
  evaluations_ += result.evaluations;
  ++solved_;
  if (!(result.violation <= kMet)) return std::nullopt;
  return program.program(result.at);
}

// Levels near a bound become the bound, pieces that are alone switches, short segments nothing, and Newton's
// method does the rest. How near and how short: until it gets there.
OnOffSolution OnOffSearch::settled(const OnOffProgram& maneuver) {
  std::optional<OnOffSolution> best;
  const auto look_at = [&](const OnOffProgram& given, double shortest) {
    OnOffProgram cleaned = without_short_segments(given, shortest * given.end_s);
    const SwitchTimeProgram program(*problem_, *body_, cleaned);
    cleaned = program.program(finished(program, program.variables(cleaned)));
    const OnOffSolution projected = judge(cleaned, 80);
    const OnOffSolution newton = polished(projected);
    const OnOffSolution& found = sound(newton, projected);
    const bool is_better = best && found.violation <= kMet && found.residual < best->residual &&
                           found.maneuver.end_s < best->maneuver.end_s * (1 + kSettled);
    if (!best || is_better) best = found;
  };
  const auto is_settled = [&] { return best && best->violation <= kMet && best->residual < kPolished; };
  for (const double near : {1e-6, 1e-4, 1e-3, 1e-2}) {
    const OnOffProgram snapped = with_saturated_levels(body_->plant, maneuver, near);
    const double shortest = std::max(kVanished, 0.1 * near);
    look_at(snapped, shortest);
    if (!is_settled()) look_at(without_lone_levels(body_->plant, snapped), shortest);
    if (is_settled()) break;
  }
  return *best;
}

std::optional<OnOffSolution> OnOffSearch::throttled(const OnOffSolution& solution) {
  std::optional<OnOffSolution> best;
  OnOffSolution now = solution;
  for (const auto& [pieces, ends] : kPieces) {
    if (now.is_rate_active || !may_go_on()) break;
    auto arcs = likely_arcs(body_->plant, now.maneuver, now.signs);
    if (arcs.empty()) break;
    OnOffProgram start = with_segments(now, 0.5, true);
    for (SingularArc& arc : arcs) {
      leave_room(now, pieces, arc, start);
      throttle(body_->plant, arc, pieces, ends, start);
    }
    const auto maneuver = optimize_levels(start);
    if (!maneuver) break;
    now = settled(*maneuver);
    if (now.violation <= kMet && now.maneuver.end_s < (best ? best->maneuver : solution.maneuver).end_s)
      best = now;
    if (best && is_extremal(*best) && best->signs.saving_s < kWorthMorePieces * best->maneuver.end_s) break;
  }
  if (best) best = mended(*best);
  return best;
}

// An arc that reaches an end of the maneuver: a bang comes between, as S_i has no reason to vanish there.
void OnOffSearch::leave_room(const OnOffSolution& solution, std::size_t pieces, SingularArc& arc,
                             OnOffProgram& program) {
  const double end = program.end_s, tiny = 1e-9 * end;
  const double room = 0.3 * (arc.to_s - arc.from_s) / static_cast<double>(pieces);
  const bool at_start = arc.from_s <= tiny, at_end = arc.to_s >= end - tiny;
  for (const SignViolation& violation : solution.signs.violations) {
    if (violation.control != arc.control) continue;
    if (at_start && violation.from_s <= tiny) {
      insert_segment(program, arc.control, violation.value, 0, room);
      arc.from_s = room;
    }
    if (at_end && violation.to_s >= end - tiny) {
      insert_segment(program, arc.control, violation.value, end - room, end);
      arc.to_s = end - room;
    }
  }
}

// A wrong sign so short that no point of the last look but one fell into it, as at the ends of a maneuver.
OnOffSolution OnOffSearch::mended(const OnOffSolution& solution) {
  if (is_extremal(solution) || !saves_next_to_nothing(solution) || solution.residual >= kConditionsMet)
    return solution;
  for (const int fine : {4000, 32000}) {
    const OnOffSolution seen = judge(solution.maneuver, fine);
    const OnOffProgram start = with_segments(seen, 0.5, true);
    if (start.switches() == seen.maneuver.switches()) continue;
    const auto maneuver = optimize_levels(start);
    if (!maneuver) break;
    OnOffSolution found = settled(*maneuver);
    if (is_extremal(found) && found.maneuver.end_s <= solution.maneuver.end_s * (1 + 1e-9)) return found;
  }
  return solution;
}

OnOffSolution OnOffSearch::filled(OnOffSolution best, double worth, int most_rounds, bool is_thorough) {
  double part = 0.5;  // of an interval in which the sign is wrong
  for (int round = 0; round < most_rounds && !best.is_rate_active && may_go_on(); ++round) {
    if (best.signs.saving_s < worth * best.maneuver.end_s) break;
    const OnOffProgram start = with_segments(best, part, is_thorough);
    if (start.switches() == best.maneuver.switches()) break;
    auto maneuver = optimize(start, 1e-8);
    if (maneuver) *maneuver = without_short_segments(*maneuver, kVanished * maneuver->end_s);
    bool is_better = false;
    if (maneuver && maneuver->end_s < best.maneuver.end_s * (1 - 1e-9)) {
      OnOffSolution found = judge(*maneuver, 80);
      if (is_thorough) {
        const OnOffSolution newton = polished(found);
        found = sound(newton, found);
      }
      // Many segments that vanished at once leave an error behind.
      is_better = found.violation <= std::max(kMet, best.violation);
      if (is_better) best = found;
    }
    if (is_better) {
      part = 0.5;
    } else {
      if (part < 0.05) break;
      part *= 0.3;  // a smaller change of what was best
    }
  }
  return best;
}

std::optional<OnOffSolution> OnOffSearch::settle(const OnOffProgram& start) {
  const auto maneuver = optimize(start, 1e-10);
  if (!maneuver) return std::nullopt;
  const OnOffProgram cleaned = without_short_segments(*maneuver, kVanished * maneuver->end_s);
  if (cleaned.switches() != maneuver->switches()) return std::nullopt;
  return judge(*maneuver, 80);
}

std::optional<OnOffSolution> OnOffSearch::settle_beside(const OnOffProgram& start) {
  const SwitchTimeProgram program(*problem_, *body_, start);
  Eigen::VectorXd variables = program.variables(start);
  if (variables.size() < 6 || !restore(program, variables)) return std::nullopt;
  const OnOffProgram met = program.program(finished(program, variables));
  if (without_short_segments(met, 1e-5 * met.end_s).switches() != start.switches()) return std::nullopt;
  const OnOffSolution solution = polished(judge(met, 80));
  if (!(solution.violation <= kMet && solution.residual < 1e-8)) return std::nullopt;
  return solution;
}

// A segment that is about to vanish keeps Newton's method from the conditions: it is taken out, and the
// switch times are optimized once more.
OnOffSolution OnOffSearch::polish(const OnOffSolution& solution) {
  if (static_cast<Eigen::Index>(solution.maneuver.switches()) > kMostForNewton) return solution;
  OnOffSolution best = polished(solution);
  for (const double shortest : {1e-4, 1e-3}) {
    if (best.residual < kPolished || best.is_rate_active) break;
    const OnOffProgram fewer = without_short_segments(solution.maneuver, shortest * solution.maneuver.end_s);
    if (fewer.switches() == solution.maneuver.switches()) continue;
    const auto optimized = optimize(fewer, 1e-10);
    if (!optimized || optimized->end_s > best.maneuver.end_s * (1 + 1e-6)) continue;
    const OnOffSolution other = polished(judge(*optimized, 80));
    if (other.violation <= std::max(best.violation, 1e-9) && other.residual < best.residual) best = other;
  }
  return sound(best, solution);
}

OnOffSolution OnOffSearch::polished(const OnOffSolution& solution) {
  const SwitchTimeProgram program(*problem_, *body_, solution.maneuver);
  const Eigen::Index n = program.parameter_count();
  const Eigen::Index conditions = solution.is_consumption_active ? 7 : 6;
  if (solution.is_rate_active || n < conditions ||
      n > (program.levels() > 0 ? kMostWithLevels : kMostForNewton) + 1)
    return solution;
  const double scale = program.reference_s();
  const double limit = problem_->most_consumption.value_or(0);

  const auto look = [&](const Eigen::VectorXd& y, Eigen::VectorXd& c, Eigen::MatrixXd& a) {
    const OnOffProgram moved = program.program_of_parameters(y);
    const SwitchTimeProgram::Slopes slopes = program.slopes(moved);
    ++evaluations_;
    c.resize(conditions);
    a.resize(conditions, n);
    c.head<6>() = slopes.error;
    a.topRows(6) = slopes.error_slope;
    if (conditions == 7) {
      c[6] = (consumption_of(moved, body_->plant) - limit) / scale;
      a.row(6) = slopes.consumption_slope.transpose();
    }
  };
  const Eigen::Index levels = program.levels();
  const auto is_possible = [&](const Eigen::VectorXd& y) {
    if (!(y.tail(levels).array() > program.nonlinear().least.tail(levels).array()).all() ||
        !(y.tail(levels).array() < program.nonlinear().most.tail(levels).array()).all())
      return false;
    const OnOffProgram moved = program.program_of_parameters(y);
    for (const auto& times : moved.switch_times_s) {
      double before = 0;
      for (const double time : times) {
        if (!(time > before)) return false;
        before = time;
      }
      if (!(moved.end_s > before)) return false;
    }
    return true;
  };

  // First the parameters, then the multipliers.
  Eigen::VectorXd y = program.parameters(solution.maneuver), m(conditions), c, c_moved;
  Eigen::MatrixXd a, a_moved;
  m.head<6>() = solution.signs.multipliers.terminal;
  if (conditions == 7) m[6] = solution.signs.multipliers.consumption;
  const Eigen::VectorXd wanted = Eigen::VectorXd::Unit(n, program.time_at());
  look(y, c, a);
  double error =
      std::max(c.lpNorm<Eigen::Infinity>(), (wanted + a.transpose() * m).lpNorm<Eigen::Infinity>());
  for (int iteration = 0; iteration < 8 && error > 1e-13; ++iteration) {
    constexpr double kStep = 1e-6;
    Eigen::MatrixXd kkt = Eigen::MatrixXd::Zero(n + conditions, n + conditions);
    for (Eigen::Index j = 0; j < n; ++j) {
      Eigen::VectorXd moved = y;
      moved[j] += kStep;
      look(moved, c_moved, a_moved);
      kkt.col(j).head(n) = (a_moved - a).transpose() * m / kStep;
    }
    kkt.topLeftCorner(n, n) = (0.5 * (kkt.topLeftCorner(n, n) + kkt.topLeftCorner(n, n).transpose())).eval();
    kkt.topRightCorner(n, conditions) = a.transpose();
    kkt.bottomLeftCorner(conditions, n) = a;
    Eigen::VectorXd right(n + conditions);
    right << wanted + a.transpose() * m, c;
    const Eigen::VectorXd step = kkt.completeOrthogonalDecomposition().solve(-right);
    if (!step.allFinite()) break;
    bool has_moved = false;
    for (double part = 1; part > 0.01 && !has_moved; part *= 0.5) {
      const Eigen::VectorXd y_next = y + part * step.head(n), m_next = m + part * step.tail(conditions);
      if (!is_possible(y_next)) continue;
      look(y_next, c_moved, a_moved);
      const double next_error = std::max(c_moved.lpNorm<Eigen::Infinity>(),
                                         (wanted + a_moved.transpose() * m_next).lpNorm<Eigen::Infinity>());
      if (!(next_error < error)) continue;
      error = next_error, y = y_next, m = m_next, c = c_moved, a = a_moved;
      has_moved = true;
    }
    if (!has_moved) break;
  }
  OnOffSolution result = judge(program.program_of_parameters(y), 200);
  result.is_consumption_active = solution.is_consumption_active;
  return result;
}

}  // namespace slew
