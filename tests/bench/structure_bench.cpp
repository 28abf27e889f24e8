// Case (a) of Sung, Lee & Kim 2001, 12 s of flight: processor time of finite elements, reduction, design and
// integration, each by itself, and of all from a request's text to its result. Medians of several rounds.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "server/experiment/experiment.hpp"
#include "server/simulation/structure_system.hpp"
#include "tests/unit/structure_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;

double processor_time_s() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median_s(const std::function<void()>& work) {
  std::vector<double> times(9);
  for (double& time : times) {
    const double begin = processor_time_s();
    work();
    time = processor_time_s() - begin;
  }
  std::nth_element(times.begin(), times.begin() + 4, times.end());
  return times[4];
}

class Discard final : public SampleSink {
 public:
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

RunReport fly(Run& run) {
  Discard discard;
  while (run.advance(std::numeric_limits<double>::infinity(), 1 << 20, discard) == RunStatus::running) {
  }
  return run.report();
}

void tell(const char* what, double time_s) {
  std::printf("%-44s %9.2f ms  %7.0f x real time\n", what, 1e3 * time_s, 12 / time_s);
}

}  // namespace

int main() {
  StructureSpecification spec = scole_slew(ScoleCase::a);
  const StructureElements elements = structure_elements(spec);
  tell("finite elements", median_s([&] { structure_elements(spec); }));
  tell("reduction by Krylov vectors",
       median_s([&] { reduce(elements.structure, elastic_basis(elements, spec.plant)); }));
  tell("all that is derived: those, design, gains", median_s([&] { build_structure_system(spec); }));
  spec.system = build_structure_system(spec);
  std::printf("  %zu steps of the filter's Riccati equation\n", spec.system->controller->gains->steps());
  RunReport report;
  tell("integration", median_s([&] { report = fly(*make_structure_run(spec)); }));
  std::printf("  %zu steps of the solver\n", static_cast<std::size_t>(report.propagator.steps));

  // From text to text, the damping a little different each time, so that nothing is known.
  int round = 0;
  const auto request = [&](bool is_known) {
    nlohmann::json text = {{"preset", "sung-lee-kim-2001/tracking-control-a"}};
    if (!is_known) text["plant"]["mass_damping_1_s"] = 0.01 + 1e-9 * ++round;
    return text.dump();
  };
  const auto answer = [&](bool is_known) {
    const auto prepared = std::get<Prepared>(prepare(request(is_known)));
    const auto run = make_run(prepared);
    fly(*run);
    return result_document({"", "", "completed", std::nullopt, {}}, prepared, run.get(), std::nullopt).dump();
  };
  answer(true);
  const double anew_s = median_s([&] { answer(false); }), again_s = median_s([&] { answer(true); });
  tell("from request to result, nothing known", anew_s);
  tell("from request to result, model and design kept", again_s);
  std::printf("at least 100 x real time: %s\n", 12 / anew_s >= 100 ? "yes" : "NO");
}
