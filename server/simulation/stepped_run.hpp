// A run whose trajectory is made of steps: what every one of them does with the step that is open, with
// samples and outputs, and at its end (server/doc/step.md). How a step is made is for the loops that derive
// from it.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/simulation/digest.hpp"
#include "server/simulation/run.hpp"

namespace slew {

class SteppedRun : public Run {
 public:
  const ChannelTable& channels() const final { return *channels_; }
  RunStatus advance(double until_s, std::int64_t max_steps, SampleSink& sink) final;
  double t_s() const final { return handed_out_s_; }

 protected:
  SteppedRun() = default;
  SteppedRun(const SteppedRun&) = default;

  /// Room for rows and outputs; once, before the first step. `output_times_s` ascend.
  void lay_out(ChannelTable channels, double telemetry_period_s, const std::vector<double>& output_times_s);

  /// 1 to 3: sets end_s_ and step_is_open_, or ends the run.
  virtual void open_step(SampleSink& sink) = 0;
  /// Moves on to end_s_.
  virtual void close_step() = 0;
  /// t and the full state.
  virtual void digest_state() = 0;
  /// Inside the open step, or where the run ends.
  virtual void fill_row(double t_s, std::span<double> state, std::span<double> thrusters) = 0;
  virtual void fill_output(double t_s, std::span<double> state, std::span<double> thrusters) {
    fill_row(t_s, state, thrusters);
  }

  /// A discrete change at t_s_.
  void note(std::uint32_t channel, std::int32_t mode, SampleSink& sink);
  /// Ends it at t_s_, with what has not been handed out.
  void finish(const char* reason, SampleSink& sink);

  double t_s_ = 0;             ///< where the open step begins
  bool step_is_open_ = false;  ///< from t_s_ to end_s_
  double end_s_ = 0;
  Digester digester_;
  RunReport report_;
  RunStatus status_ = RunStatus::running;

 private:
  void hand_out(double until_s, bool inclusive, SampleSink& sink);

  std::shared_ptr<const ChannelTable> channels_;
  double telemetry_period_s_ = 0;
  double handed_out_s_ = 0;
  std::int64_t next_row_ = 0;
  double last_row_s_ = -1;
  std::vector<double> state_row_, thruster_row_;
  std::size_t next_output_ = 0;
};

}  // namespace slew
