// A run: one experiment as the service sees it, whatever plant and law are inside.
//
// A run owns its whole state and knows no clock, no thread and no I/O. It is advanced in pieces by whoever
// paces it; the pieces never change a bit of the trajectory (server/doc/step.md).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/simulation/metrics.hpp"

namespace slew {

/// One channel of telemetry. `unit` is SI ("rad", "rad/s", "N m", "1").
struct Channel {
  std::string name;
  std::string unit;
  std::string frame;
  std::string description;
};

/// The columns of a run's telemetry, in the order in which samples carry them.
struct ChannelTable {
  std::vector<Channel> state;
  std::vector<Channel> thrusters;
};

/// A discrete change of the loop: `channel` indexes Run::event_channels(), `mode` is the value from t_s on.
struct SwitchEvent {
  double t_s;
  std::uint32_t channel;
  std::int32_t mode;
};

/// Receives what a run produces, in the order of simulated time. Called from within Run::advance.
class SampleSink {
 public:
  virtual ~SampleSink() = default;
  /// Spans are as long as the channel tables and are valid during the call only.
  virtual void sample(double t_s, std::span<const double> state, std::span<const double> thrusters) = 0;
  virtual void event(const SwitchEvent& event) = 0;
};

enum class RunStatus {
  running,   ///< more to do
  finished,  ///< duration or stop condition reached; the report is complete
  failed,    ///< the report's failure says why
};

/// Why a run failed: a code for programs and a sentence for people.
struct RunFailure {
  std::string code;
  std::string sentence;
};

/// XXH3-128 over every event and over t and the full state at every propagator step (server/doc/step.md).
struct Digest {
  std::uint64_t high = 0;
  std::uint64_t low = 0;
  std::uint64_t hashed_bytes = 0;
  std::string hex() const;
  bool operator==(const Digest&) const = default;
};

/// The state at one of the times asked for in `outputs.at_s`, in the order of the channel tables.
struct OutputRow {
  double t_s;
  std::vector<double> state;
  std::vector<double> thrusters;
};

struct PropagatorStatistics {
  std::string name;
  std::uint64_t steps = 0;
  std::uint64_t events = 0;
  std::uint64_t rhs_evaluations = 0;  ///< 0 for closed forms
};

/// Everything a finished run has to say, apart from its samples.
struct RunReport {
  std::string stop_reason;  ///< "duration", "end_box", "first_rest", …
  std::optional<RunFailure> failure;
  std::vector<std::string> warnings;
  Metrics metrics;
  std::vector<OutputRow> outputs;
  std::vector<SwitchEvent> events;  ///< at most kReportedEvents
  std::uint64_t events_total = 0;
  PropagatorStatistics propagator;
  Digest digest;
};

inline constexpr std::size_t kReportedEvents = 1000;

class Run {
 public:
  virtual ~Run() = default;

  virtual const ChannelTable& channels() const = 0;
  virtual const std::vector<std::string>& event_channels() const = 0;

  /// Hands out everything up to simulated time `until_s` (inclusive), taking at most `max_steps` propagator
  /// steps. A step may end beyond `until_s`; what lies beyond is handed out by a later call.
  virtual RunStatus advance(double until_s, std::int64_t max_steps, SampleSink& sink) = 0;

  /// Simulated time up to which everything has been handed out.
  virtual double t_s() const = 0;
  virtual double duration_s() const = 0;

  /// Complete once advance() has said finished or failed; before that, the state so far.
  virtual RunReport report() const = 0;

  /// An independent copy that continues from here with the same bits.
  virtual std::unique_ptr<Run> clone() const = 0;
};

/// A second opinion on a run: the same request by other means, and the differences.
struct Verification {
  std::string propagator;
  double relative_tolerance = 0;
  std::uint64_t events_compared = 0;  ///< those before the first that differ
  bool same_event_sequence = false;
  std::optional<double> event_time_median_s;  ///< |difference| over the events before the first that differ
  std::optional<double> event_time_max_s;
  std::vector<double> final_state_difference;  ///< this run minus the verification, per state channel
  double final_time_difference_s = 0;
  Metrics metrics;  ///< the verification's own
  PropagatorStatistics statistics;
};

/// Both reports of runs that have ended.
Verification compare(const RunReport& run, const RunReport& verification);

}  // namespace slew
