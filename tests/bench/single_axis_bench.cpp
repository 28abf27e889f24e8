// A single-axis slew from beginning to end, by closed-form arcs and by SUNDIALS: the ratio counts, in one
// run.
#include <benchmark/benchmark.h>

#include <limits>

#include "tests/unit/flexible_cases.hpp"

namespace {

using namespace slew;

class Discard final : public SampleSink {
 public:
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

template <typename Make>
void fly(benchmark::State& state, const OnOffAxisSpecification& spec, Make make) {
  std::uint64_t steps = 0;
  for (auto _ : state) {
    const auto run = make(spec);
    Discard discard;
    run->advance(std::numeric_limits<double>::infinity(), std::numeric_limits<std::int64_t>::max(), discard);
    steps += run->report().propagator.steps;
  }
  state.counters["steps"] =
      benchmark::Counter(static_cast<double>(steps), benchmark::Counter::kAvgIterations);
  state.counters["ns/step"] = benchmark::Counter(static_cast<double>(steps) * 1e-9,
                                                 benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

OnOffAxisSpecification sampled() {
  return test::single_sided(1.1, 0.1, 1e-3);
}
OnOffAxisSpecification minimum_on_time() {
  auto spec = test::continuous(test::single_sided(1.1, 0.1, 0), 0.05);
  spec.law.end_box = EndBox{0.01, 0.05};
  spec.stop = StopCondition::end_box;
  return spec;
}

void SampledByArcs(benchmark::State& state) {
  fly(state, sampled(), make_on_off_axis_run);
}
void SampledBySundials(benchmark::State& state) {
  fly(state, sampled(), make_on_off_axis_verification);
}
void MinimumOnTimeByArcs(benchmark::State& state) {
  fly(state, minimum_on_time(), make_on_off_axis_run);
}
void MinimumOnTimeBySundials(benchmark::State& state) {
  fly(state, minimum_on_time(), make_on_off_axis_verification);
}
OnOffAxisSpecification flexible() {
  auto spec = test::flexible_slew(1.0, 0.01);
  spec.verification_tolerance = 1e-9;
  spec.telemetry_period_s = spec.duration_s;  // SUNDIALS hands out no samples either
  return spec;
}
OnOffAxisSpecification flexible_events() {
  auto spec = test::continuous(flexible(), 0.05);
  spec.law.deadband = Deadband::single_sided;
  spec.law.deadband_rad = test::kRadPerDeg;
  return spec;
}
void FlexibleSampledByModes(benchmark::State& state) {
  fly(state, flexible(), make_on_off_axis_run);
}
void FlexibleSampledBySundials(benchmark::State& state) {
  fly(state, flexible(), make_on_off_axis_verification);
}
void FlexibleEventsByModes(benchmark::State& state) {
  fly(state, flexible_events(), make_on_off_axis_run);
}
void FlexibleEventsBySundials(benchmark::State& state) {
  fly(state, flexible_events(), make_on_off_axis_verification);
}
BENCHMARK(FlexibleSampledByModes)->Unit(benchmark::kMicrosecond);
BENCHMARK(FlexibleSampledBySundials)->Unit(benchmark::kMicrosecond);
BENCHMARK(FlexibleEventsByModes)->Unit(benchmark::kMicrosecond);
BENCHMARK(FlexibleEventsBySundials)->Unit(benchmark::kMicrosecond);
BENCHMARK(SampledByArcs)->Unit(benchmark::kMicrosecond);
BENCHMARK(SampledBySundials)->Unit(benchmark::kMicrosecond);
BENCHMARK(MinimumOnTimeByArcs)->Unit(benchmark::kMicrosecond);
BENCHMARK(MinimumOnTimeBySundials)->Unit(benchmark::kMicrosecond);

}  // namespace
