// The cases of Agrawal & Bang 1995 in the units of its Figs. 1 to 5: I = N = 1, theta from 0 to 1.
#pragma once

#include <limits>
#include <vector>

#include "server/simulation/axis.hpp"
#include "server/simulation/axis_channels.hpp"

namespace slew::test {

/// Keeps every sample.
class Recorder final : public SampleSink {
 public:
  struct Row {
    double t_s;
    std::vector<double> values;
    bool operator==(const Row&) const = default;
  };
  void sample(double t_s, std::span<const double> state, std::span<const double> thrusters) override {
    Row row{t_s, {state.begin(), state.end()}};
    row.values.insert(row.values.end(), thrusters.begin(), thrusters.end());
    rows.push_back(std::move(row));
  }
  void event(const SwitchEvent& event) override { events.push_back(event); }

  std::vector<Row> rows;
  std::vector<SwitchEvent> events;
};

inline OnOffAxisSpecification unit_slew(double gamma, double period_s) {
  OnOffAxisSpecification spec;
  spec.maneuver.final_angle_rad = 1;
  spec.law.inertia_kg_m2 = gamma;
  spec.evaluation = Evaluation::sampled;
  spec.sample_period_s = period_s;
  spec.duration_s = 20;
  spec.telemetry_period_s = 0.01;
  spec.stop = StopCondition::first_rest;
  return spec;
}

inline OnOffAxisSpecification single_sided(double gamma, double epsilon_rad, double period_s) {
  auto spec = unit_slew(gamma, period_s);
  spec.law.deadband = Deadband::single_sided;
  spec.law.deadband_rad = epsilon_rad;
  return spec;
}

/// The same law evaluated continuously, with a minimum on-time.
inline OnOffAxisSpecification continuous(OnOffAxisSpecification spec, double minimum_on_time_s) {
  spec.evaluation = Evaluation::continuous;
  spec.actuator.minimum_on_time_s = minimum_on_time_s;
  return spec;
}

inline RunReport fly(Run& run) {
  Recorder recorder;
  run.advance(std::numeric_limits<double>::infinity(), std::numeric_limits<std::int64_t>::max(), recorder);
  return run.report();
}

inline RunReport fly(const OnOffAxisSpecification& spec) {
  return fly(*make_on_off_axis_run(spec));
}

}  // namespace slew::test
