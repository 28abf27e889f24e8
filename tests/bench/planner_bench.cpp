// Planning maneuvers: medians of times, evaluations of the motion, and how often random starts succeed. Ipopt
// solves the same nonlinear program from the same start where it was found at build time.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include "server/guidance/maneuver_starts.hpp"
#include "server/guidance/on_off_search.hpp"
#include "server/guidance/planner.hpp"
#include "tests/unit/maneuver_cases.hpp"

#ifdef SLEW_HAS_IPOPT
#include <IpStdCInterface.h>
#endif

namespace {

using namespace slew;
using namespace slew::test;

double milliseconds(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

double median(int runs, const std::function<void()>& work) {
  std::vector<double> times;
  for (int i = 0; i < runs; ++i) times.push_back(milliseconds(work));
  std::nth_element(times.begin(), times.begin() + runs / 2, times.end());
  return times[static_cast<std::size_t>(runs / 2)];
}

#ifdef SLEW_HAS_IPOPT
struct Asked {
  const NonlinearProgram* program;
  NonlinearValues values;
  Eigen::VectorXd at;
  int evaluations = 0;

  const NonlinearValues& look(Index n, const Number* x) {
    const Eigen::Map<const Eigen::VectorXd> now(x, n);
    if (at.size() == now.size() && at == now) return values;
    at = now;
    program->evaluate(at, values);
    ++evaluations;
    return values;
  }
};

Bool objective(Index n, Number* x, Bool, Number* value, UserDataPtr context) {
  *value = static_cast<Asked*>(context)->look(n, x).objective;
  return TRUE;
}
Bool slope(Index n, Number* x, Bool, Number* value, UserDataPtr context) {
  const auto& values = static_cast<Asked*>(context)->look(n, x);
  std::copy(values.slope.begin(), values.slope.end(), value);
  return TRUE;
}
Bool constraints(Index n, Number* x, Bool, Index, Number* value, UserDataPtr context) {
  const auto& values = static_cast<Asked*>(context)->look(n, x);
  std::copy(values.positive.begin(), values.positive.end(),
            std::copy(values.equal.begin(), values.equal.end(), value));
  return TRUE;
}
Bool constraint_slopes(Index n, Number* x, Bool, Index m, Index, Index* rows, Index* columns, Number* value,
                       UserDataPtr context) {
  if (!value) {
    for (Index i = 0; i < m; ++i)
      for (Index j = 0; j < n; ++j) rows[i * n + j] = i, columns[i * n + j] = j;
    return TRUE;
  }
  const auto& values = static_cast<Asked*>(context)->look(n, x);
  const auto equals = static_cast<Index>(values.equal.size());
  for (Index i = 0; i < m; ++i)
    for (Index j = 0; j < n; ++j)
      value[i * n + j] = i < equals ? values.equal_slope(i, j) : values.positive_slope(i - equals, j);
  return TRUE;
}
Bool no_hessian(Index, Number*, Bool, Number, Index, Number*, Bool, Index, Index*, Index*, Number*,
                UserDataPtr) {
  return FALSE;
}

// The objective at the end; evaluations through `asked`.
double solve_by_ipopt(const NonlinearProgram& program, const Eigen::VectorXd& start, Asked& asked) {
  constexpr Number kInfinity = 2e19;
  asked = {&program, {}, {}};
  const auto n = static_cast<Index>(start.size());
  const auto m = static_cast<Index>(program.equals + program.positives);
  std::vector<Number> least(program.least.begin(), program.least.end()), most(n), low(m, 0),
      high(m, kInfinity);
  for (Index j = 0; j < n; ++j) most[j] = std::min(kInfinity, program.most[j]);
  for (Index i = 0; i < program.equals; ++i) high[i] = 0;
  IpoptProblem problem =
      CreateIpoptProblem(n, least.data(), most.data(), m, low.data(), high.data(), n * m, 0, 0, objective,
                         constraints, slope, constraint_slopes, no_hessian);
  char hessian[] = "hessian_approximation", limited[] = "limited-memory", print[] = "print_level",
       sb[] = "sb", yes[] = "yes", tolerance[] = "tol";
  AddIpoptStrOption(problem, hessian, limited);
  AddIpoptIntOption(problem, print, 0);
  AddIpoptStrOption(problem, sb, yes);
  AddIpoptNumOption(problem, tolerance, 1e-10);
  std::vector<Number> x(start.begin(), start.end());
  Number value = 0;
  IpoptSolve(problem, x.data(), nullptr, &value, nullptr, nullptr, nullptr, &asked);
  FreeIpoptProblem(problem);
  return value;
}
#endif

void one_program() {
  const ManeuverProblem problem = sphere(180);
  const ManeuverBody body(problem.plant);
  OnOffProgram start;
  start.end_s = 3.5;
  start.controls = {{1, -1, 1}, {1, -1, 1}, {1, -1}};
  start.switch_times_s = {{.35, 2.1}, {1.4, 3.15}, {1.75}};
  const SwitchTimeProgram program(problem, body, start);
  const Eigen::VectorXd variables = program.variables(start);
  SequentialOptions options;
  SequentialResult result;
  const double ours = median(201, [&] { result = minimize(program.nonlinear(), variables, options); });
  std::printf("one program, sphere 180 deg: SLSQP %.4f ms, %d evaluations, %.8f s\n", ours,
              result.evaluations, program.program(result.at).end_s);
#ifdef SLEW_HAS_IPOPT
  Asked asked{};
  double value = 0;
  const double theirs = median(21, [&] { value = solve_by_ipopt(program.nonlinear(), variables, asked); });
  std::printf(
      "one program, sphere 180 deg: Ipopt %.4f ms, %d evaluations, %.8f s: SLSQP is %.0f times as fast\n",
      theirs, asked.evaluations, value * program.reference_s(), theirs / ours);
#else
  std::printf("Ipopt was not found when this was built\n");
#endif
}

void random_starts(const char* name, const ManeuverProblem& problem, double best_s) {
  const ManeuverBody body(problem.plant);
  const ManeuverStarts starts(problem, body, 5);
  OnOffSearch search(problem, body, {});
  constexpr int kStarts = 100;
  int hits = 0, others = 0;
  const double time = milliseconds([&] {
    for (std::uint64_t k = 0; k < kStarts; ++k) {
      const auto found = search.descend(starts.start(k), 1e9);
      if (!found) continue;
      found->maneuver.end_s < best_s*(1 + 1e-5) ? ++hits : ++others;
    }
  });
  std::printf("%-34s of %d starts %3d reach %.6f s, %2d another; %5.1f evaluations and %.3f ms a start\n",
              name, kStarts, hits, best_s, others, search.evaluations() / double{kStarts}, time / kStarts);
}

void whole_plan(const char* name, const ManeuverProblem& problem) {
  Plan found;
  const double time = median(7, [&] { found = plan(problem); });
  std::printf("%-34s %9.6f s, %-10s %3d starts, %4d evaluations, %8.2f ms\n", name, found.time_s,
              found.status == PlanStatus::extremal ? "extremal," : "best,", found.log.starts,
              found.log.evaluations, time);
}

}  // namespace

int main() {
  const auto eight = AstrexThrusters::eight_lbf, two_hundred = AstrexThrusters::two_hundred_lbf;
  one_program();
  random_starts("sphere 180 deg", sphere(180), 3.24308328);
  random_starts("sphere 90 deg", sphere(90), 2.42111655);
  random_starts("sphere 72 deg", sphere(72), 2.18827283);
  random_starts("sphere 45 deg", sphere(45), 1.74708207);
  random_starts("reorientation", reorientation(), 28.6304066);
  random_starts("ASTREX floating, 200/8 lbf", floating(two_hundred), 5.82602363);
  random_starts("ASTREX floating, 8 lbf", floating(eight), 25.2683738);
  random_starts("ASTREX pedestal, 200/8 lbf", on_pedestal(two_hundred), 5.15945721);
  random_starts("ASTREX pedestal, 8 lbf, 160 ft^3", with_air(on_pedestal(eight)), 25.5707914);
  whole_plan("sphere 180 deg", sphere(180));
  whole_plan("sphere 72 deg", sphere(72));
  whole_plan("sphere 45 deg", sphere(45));
  whole_plan("reorientation", reorientation());
  whole_plan("ASTREX floating, 200/8 lbf", floating(two_hundred));
  whole_plan("ASTREX pedestal, 200/8 lbf", on_pedestal(two_hundred));
  whole_plan("three smooth switches", smooth(floating(two_hundred), {1, 1, 1}));
  whole_plan("four smooth switches", smooth(floating(two_hundred), {1, 2, 1}));
  whole_plan("five smooth switches", smooth(floating(two_hundred), {2, 2, 1}));
  whole_plan("pedestal, 8 lbf, 160 ft^3", with_air(on_pedestal(eight)));
  whole_plan("pedestal, 200/8 lbf, 160 ft^3", with_air(on_pedestal(two_hundred)));
  whole_plan("floating, 200/8 lbf, 160 ft^3", with_air(floating(two_hundred)));
  ManeuverProblem impulses = with_air(on_pedestal(two_hundred));
  impulses.family = ProfileFamily::impulses;
  impulses.t1 = {.0294, .0297, .0968};
  whole_plan("impulses, t1 given", impulses);
  ManeuverProblem slow = floating(two_hundred);
  slow.most_rate_rad_s = Eigen::Vector3d::Constant(kAstrexMostRate_rad_s);
  whole_plan("floating, 200/8 lbf, 10 deg/s", slow);
  return 0;
}
