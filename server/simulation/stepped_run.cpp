#include "server/simulation/stepped_run.hpp"

#include <algorithm>
#include <utility>

namespace slew {

void SteppedRun::lay_out(ChannelTable channels, double telemetry_period_s,
                         const std::vector<double>& output_times_s) {
  channels_ = std::make_shared<const ChannelTable>(std::move(channels));
  telemetry_period_s_ = telemetry_period_s;
  state_row_.resize(channels_->state.size());
  thruster_row_.resize(channels_->thrusters.size());
  report_.events.reserve(kReportedEvents);
  for (const double t_s : output_times_s) report_.outputs.push_back({t_s, state_row_, thruster_row_});
}

RunStatus SteppedRun::advance(double until_s, std::int64_t max_steps, SampleSink& sink) {
  while (status_ == RunStatus::running) {
    if (!step_is_open_) open_step(sink);
    if (status_ != RunStatus::running) break;
    hand_out(std::min(until_s, end_s_), false, sink);
    if (end_s_ > until_s) {
      handed_out_s_ = std::max(handed_out_s_, until_s);
      return status_;
    }
    if (max_steps-- <= 0) {
      handed_out_s_ = std::max(handed_out_s_, t_s_);
      return status_;
    }
    close_step();
  }
  return status_;
}

void SteppedRun::note(std::uint32_t channel, std::int32_t mode, SampleSink& sink) {
  const SwitchEvent event{t_s_, channel, mode};
  digester_.event(event);
  if (report_.events.size() < kReportedEvents) report_.events.push_back(event);
  ++report_.events_total;
  ++report_.propagator.events;
  sink.event(event);
}

// A sample at the end of a step belongs to the next one: it shows the state after the switching.
void SteppedRun::hand_out(double until_s, bool inclusive, SampleSink& sink) {
  const auto is_in_reach = [&](double t_s) {
    return t_s <= until_s && (t_s < end_s_ || (inclusive && t_s <= end_s_));
  };
  for (double t_s = static_cast<double>(next_row_) * telemetry_period_s_; is_in_reach(t_s);
       t_s = static_cast<double>(++next_row_) * telemetry_period_s_) {
    fill_row(t_s, state_row_, thruster_row_);
    sink.sample(t_s, state_row_, thruster_row_);
    last_row_s_ = t_s;
  }
  for (; next_output_ < report_.outputs.size() && is_in_reach(report_.outputs[next_output_].t_s);
       ++next_output_) {
    OutputRow& output = report_.outputs[next_output_];
    fill_output(output.t_s, output.state, output.thrusters);
  }
}

void SteppedRun::finish(const char* reason, SampleSink& sink) {
  end_s_ = t_s_;
  hand_out(t_s_, true, sink);
  if (last_row_s_ < t_s_) {
    fill_row(t_s_, state_row_, thruster_row_);
    sink.sample(t_s_, state_row_, thruster_row_);
  }
  if (next_output_ < report_.outputs.size()) {
    report_.warnings.push_back(std::to_string(report_.outputs.size() - next_output_) +
                               " of the times in outputs.at_s lie after the end of the run and are left out");
    report_.outputs.resize(next_output_);
  }
  digest_state();
  handed_out_s_ = t_s_;
  report_.stop_reason = reason;
  status_ = RunStatus::finished;
}

}  // namespace slew
