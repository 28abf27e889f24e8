// What two flights of the same request have in common.
#include <algorithm>
#include <cmath>

#include "server/simulation/run.hpp"

namespace slew {
namespace {

// In the order of time; what happens within a nanosecond has none, and is put in the channels' order.
std::vector<SwitchEvent> ordered(std::vector<SwitchEvent> events) {
  constexpr double kTogether_s = 1e-9;
  for (std::size_t from = 0; from < events.size();) {
    std::size_t to = from + 1;
    while (to < events.size() && events[to].t_s - events[to - 1].t_s <= kTogether_s) ++to;
    std::stable_sort(events.begin() + static_cast<std::ptrdiff_t>(from),
                     events.begin() + static_cast<std::ptrdiff_t>(to),
                     [](const SwitchEvent& x, const SwitchEvent& y) { return x.channel < y.channel; });
    from = to;
  }
  return events;
}

// How many of the first events are the same in both.
std::size_t common_events(const std::vector<SwitchEvent>& a, const std::vector<SwitchEvent>& b) {
  const auto differ = std::mismatch(
      a.begin(), a.end(), b.begin(), b.end(),
      [](const SwitchEvent& x, const SwitchEvent& y) { return x.channel == y.channel && x.mode == y.mode; });
  return static_cast<std::size_t>(differ.first - a.begin());
}

}  // namespace

Verification compare(const RunReport& run, const RunReport& verification) {
  Verification result;
  result.propagator = verification.propagator.name;
  result.statistics = verification.propagator;
  result.metrics = verification.metrics;
  result.final_time_difference_s = run.metrics.end_time_s - verification.metrics.end_time_s;
  for (std::size_t i = 0; i < run.metrics.final_state.size(); ++i)
    result.final_state_difference.push_back(run.metrics.final_state[i] - verification.metrics.final_state[i]);
  const std::vector<SwitchEvent> mine = ordered(run.events), theirs = ordered(verification.events);
  result.events_compared = common_events(mine, theirs);
  result.same_event_sequence = run.events_total == verification.events_total &&
                               result.events_compared == run.events.size() &&
                               result.events_compared == verification.events.size();
  if (result.events_compared == 0) return result;
  std::vector<double> differences;
  for (std::size_t i = 0; i < result.events_compared; ++i)
    differences.push_back(std::abs(mine[i].t_s - theirs[i].t_s));
  std::sort(differences.begin(), differences.end());
  result.event_time_median_s = differences[differences.size() / 2];
  result.event_time_max_s = differences.back();
  return result;
}

}  // namespace slew
