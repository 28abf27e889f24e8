// The closed loop of a single-axis slew by closed-form arcs. The order of a step is server/doc/step.md's.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>

#include "server/simulation/axis_dynamics.hpp"
#include "server/simulation/axis_metrics.hpp"
#include "server/simulation/digest.hpp"
#include "server/simulation/single_axis.hpp"
#include "server/simulation/single_axis_channels.hpp"

namespace slew {

int slew_direction(const SingleAxisManeuver& maneuver) {
  return maneuver.final_angle_rad < maneuver.initial_angle_rad ? -1 : 1;
}

double error_factor(const SingleAxisSpecification& specification) {
  return specification.law.gamma_bar * (specification.law.inertia_kg_m2 / specification.law.torque_N_m) /
         (specification.plant.inertia_kg_m2 / specification.actuator.torque_N_m);
}

namespace {

// More changes of mode than this at one instant is an error.
constexpr int kLargestCascade = 32;
constexpr double kInstant_s = 1e-10;

template <typename Dynamics>
class SingleAxisRun final : public Run {
 public:
  explicit SingleAxisRun(const SingleAxisSpecification& specification);

  const ChannelTable& channels() const override { return channels_; }
  const std::vector<std::string>& event_channels() const override { return single_axis_event_channels(); }
  RunStatus advance(double until_s, std::int64_t max_steps, SampleSink& sink) override;
  double t_s() const override { return handed_out_s_; }
  double duration_s() const override { return spec_->duration_s; }
  RunReport report() const override;
  std::unique_ptr<Run> clone() const override { return std::make_unique<SingleAxisRun>(*this); }

 private:
  // Why the open step ends where it does.
  enum class Reason { sample, hold_over, side, box, rest, duration };

  // 1 and 2: what happens at an instant.
  void decide_sampled(SampleSink& sink);
  void decide_continuous(SampleSink& sink);
  void fire(int u, SampleSink& sink);
  void enter_box(bool inside, SampleSink& sink);
  void note(std::uint32_t channel, std::int32_t mode, SampleSink& sink);
  // 3: how far the arc goes.
  void open_step(SampleSink& sink);
  void close_step();
  void look_for(Reason reason, double tau);
  // 4: what lies on the arc.
  void hand_out(double until_s, bool inclusive, SampleSink& sink);
  void fill_row(double t_s, std::span<double> state, std::span<double> thrusters);
  void finish(const char* reason, SampleSink& sink);

  bool is_sampled() const { return spec_->sample_period_s.has_value(); }
  bool is_holding() const { return u_ != 0 && t_s_ < hold_until_s_ - hold_rounding_s_; }
  double resolution_s() const { return 64 * std::numeric_limits<double>::epsilon() * t_s_; }
  double angle() const { return dynamics_.begin(arc_).angle_rad; }
  double rate() const { return dynamics_.begin(arc_).rate_rad_s; }
  bool is_in_end_box() const { return law_.in_end_box(angle(), rate()); }
  SwitchingSide side_now() const { return law_.side(law_.value(angle(), rate())); }
  void digest_state();

  const std::shared_ptr<const SingleAxisSpecification> spec_;  // shared with copies, and with the dynamics
  Dynamics dynamics_;
  const ChannelTable channels_;
  const int direction_;
  const SwitchingFunction law_;
  const double hold_rounding_s_;

  // Time, and the state x: the beginning of the arc.
  double t_s_ = 0;
  typename Dynamics::Arc arc_;

  // The mode m.
  int u_ = 0;
  bool in_box_ = false;
  double hold_until_s_ = 0;
  SwitchingSide side_ = SwitchingSide::inside;
  bool on_edge_ = false;        ///< side_ was just entered through the end of the band
  bool side_is_known_ = false;  ///< otherwise it is judged by the value of s
  std::int64_t next_sample_ = 0;

  // The step that is open: its arc runs from t_s_ to end_s_.
  bool step_is_open_ = false;
  double end_s_ = 0;
  Reason reason_ = Reason::duration;
  SwitchingSide entered_ = SwitchingSide::inside;
  int cascade_ = 0;

  // What has been handed out.
  double handed_out_s_ = 0;
  std::int64_t next_row_ = 0;
  double last_row_s_ = -1;
  std::vector<double> state_row_, thruster_row_;
  std::size_t next_output_ = 0;

  AxisMetrics metrics_;
  AxisOnTimes on_;
  Digester digester_;
  RunReport report_;
  RunStatus status_ = RunStatus::running;
};

template <typename Dynamics>
SingleAxisRun<Dynamics>::SingleAxisRun(const SingleAxisSpecification& specification)
    : spec_(std::make_shared<const SingleAxisSpecification>(specification)),
      dynamics_(*spec_),
      channels_(single_axis_channels(dynamics_.modes())),
      direction_(slew_direction(specification.maneuver)),
      law_(specification.law, specification.maneuver.final_angle_rad, direction_),
      hold_rounding_s_(1e-9 * specification.sample_period_s.value_or(0)),
      arc_(dynamics_.start()),
      state_row_(channels_.state.size()),
      thruster_row_(channels_.thrusters.size()),
      metrics_(specification, direction_) {
  assert(is_sampled() || spec_->actuator.minimum_on_time_s > 0);
  report_.propagator.name = dynamics_.modes() == 0 ? "closed_form_arcs" : "closed_form_modes";
  report_.events.reserve(kReportedEvents);
  for (const double t_s : spec_->output_times_s)
    report_.outputs.push_back(
        {t_s, std::vector<double>(channels_.state.size()), std::vector<double>(channels_.thrusters.size())});
  digest_state();
}

template <typename Dynamics>
void SingleAxisRun<Dynamics>::digest_state() {
  digester_.real(t_s_);
  digester_.real(angle());
  digester_.real(rate());
  dynamics_.digest(arc_, digester_);
}

template <typename Dynamics>
RunStatus SingleAxisRun<Dynamics>::advance(double until_s, std::int64_t max_steps, SampleSink& sink) {
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

// ---- 1 and 2: timers that are due, guards that hold
// ----------------------------------------------------------

template <typename Dynamics>
void SingleAxisRun<Dynamics>::note(std::uint32_t channel, std::int32_t mode, SampleSink& sink) {
  const SwitchEvent event{t_s_, channel, mode};
  digester_.event(event);
  if (report_.events.size() < kReportedEvents) report_.events.push_back(event);
  ++report_.events_total;
  ++report_.propagator.events;
  sink.event(event);
}

template <typename Dynamics>
void SingleAxisRun<Dynamics>::fire(int u, SampleSink& sink) {
  if (u == u_) return;
  metrics_.firing(t_s_, u_, u);
  u_ = u;
  if (u != 0) hold_until_s_ = t_s_ + spec_->actuator.minimum_on_time_s;
  note(kThrusterEvent, u, sink);
}

template <typename Dynamics>
void SingleAxisRun<Dynamics>::enter_box(bool inside, SampleSink& sink) {
  if (inside == in_box_) return;
  in_box_ = inside;
  metrics_.end_box(t_s_, inside);
  note(kEndBoxEvent, inside ? 1 : 0, sink);
}

// Sampled: at t = kT the law reads the exact state, first the end box, then the band, and holds until (k+1)T.
template <typename Dynamics>
void SingleAxisRun<Dynamics>::decide_sampled(SampleSink& sink) {
  if (t_s_ < static_cast<double>(next_sample_) * *spec_->sample_period_s) return;
  ++next_sample_;
  enter_box(is_in_end_box(), sink);
  if (in_box_)
    fire(0, sink);
  else if (!is_holding())
    fire(SwitchingFunction::demand(side_now()), sink);
}

// Continuous: a firing is held for its minimum on-time, unless the end box ends the run; then the box
// decides, and then the side of the band. Were the box stronger than the hold, a disturbance would bring
// about infinitely many firings at its edge.
template <typename Dynamics>
void SingleAxisRun<Dynamics>::decide_continuous(SampleSink& sink) {
  if (reason_ == Reason::box) enter_box(!in_box_, sink);
  if (in_box_ && (spec_->stop == StopCondition::end_box || !is_holding())) {
    side_is_known_ = false;
    return fire(0, sink);
  }
  if (is_holding()) return;
  if (!side_is_known_) {
    side_ = side_now();
    side_is_known_ = true;
    on_edge_ = false;
  }
  int demand = SwitchingFunction::demand(side_);
  if (on_edge_ && demand == 0 && u_ != 0) {
    // Coming off a firing onto the end of the band: where coasting would lead straight back out, both sides
    // point at the edge. The minimum on-time is the regularisation: the firing goes on for one more of it.
    dynamics_.push(arc_, 0);
    const int motion = side_motion(arc_, law_);
    const bool from_above = u_ < 0;
    if ((from_above && motion > 0) || (!from_above && motion < 0)) {
      demand = u_;
      hold_until_s_ = t_s_ + spec_->actuator.minimum_on_time_s;
      side_is_known_ = false;
    }
  }
  on_edge_ = false;
  fire(demand, sink);
  if (is_holding()) side_is_known_ = false;
}

// ---- 3: the arc, to the nearest of next timer, first guard crossing, stop
// ------------------------------------

template <typename Dynamics>
void SingleAxisRun<Dynamics>::look_for(Reason reason, double tau) {
  const double at_s = t_s_ + tau;
  if (at_s >= end_s_) return;
  end_s_ = at_s;
  reason_ = reason;
}

template <typename Dynamics>
void SingleAxisRun<Dynamics>::open_step(SampleSink& sink) {
  if (!is_sampled() && t_s_ == 0 && report_.propagator.steps == 0) enter_box(is_in_end_box(), sink);
  if (t_s_ >= spec_->duration_s) return finish("duration", sink);
  is_sampled() ? decide_sampled(sink) : decide_continuous(sink);
  if (spec_->stop == StopCondition::end_box && in_box_) return finish("end_box", sink);
  const bool stops_at_rest = spec_->stop == StopCondition::first_rest && metrics_.braking_has_begun();
  if (stops_at_rest && (reason_ == Reason::rest || metrics_.is_at_rest(rate()))) {
    metrics_.first_rest(t_s_, angle());
    return finish("first_rest", sink);
  }

  dynamics_.push(arc_, u_);
  end_s_ = spec_->duration_s;
  reason_ = Reason::duration;
  if (is_sampled()) {
    const double next_s = static_cast<double>(next_sample_) * *spec_->sample_period_s;
    if (next_s < end_s_) {
      end_s_ = next_s;
      reason_ = Reason::sample;
    }
  } else {
    if (is_holding() && hold_until_s_ < end_s_) {
      end_s_ = hold_until_s_;
      reason_ = Reason::hold_over;
    }
    const double final_angle_rad = spec_->maneuver.final_angle_rad;
    if (!in_box_ && !is_holding())
      if (const auto crossing = side_crossing(arc_, law_, side_, final_angle_rad, end_s_ - t_s_)) {
        entered_ = crossing->entered;
        look_for(Reason::side, crossing->tau);
      }
    if (law_.end_box())
      if (const auto tau =
              box_crossing(arc_, *law_.end_box(), final_angle_rad, in_box_, end_s_ - t_s_, resolution_s()))
        look_for(Reason::box, *tau);
  }
  if (stops_at_rest)
    if (const auto tau = dynamics_.rest(arc_, end_s_ - t_s_)) {
      look_for(Reason::rest, *tau);
      // A rest at the very end of the step counts before what else happens there.
      if (t_s_ + *tau >= end_s_) reason_ = Reason::rest;
    }
  step_is_open_ = true;
}

template <typename Dynamics>
void SingleAxisRun<Dynamics>::close_step() {
  const double h = end_s_ - t_s_;
  if (h > 0) {
    dynamics_.make_ready(arc_, h);
    dynamics_.each_piece(arc_, h, [this](double from, double length, const auto& piece) {
      metrics_.arc(t_s_ + from, piece, u_, length);
    });
    if (u_ > 0) on_.positive_s += h;
    if (u_ < 0) on_.negative_s += h;
    dynamics_.move(arc_, h);
    t_s_ = end_s_;
  }
  if (h > kInstant_s) {
    cascade_ = 0;
  } else if (++cascade_ > kLargestCascade) {
    report_.failure = RunFailure{"event_cascade", "more than 32 changes of mode at one instant"};
    status_ = RunStatus::failed;
  }
  ++report_.propagator.steps;
  digest_state();
  step_is_open_ = false;
  if (!std::isfinite(angle()) || !std::isfinite(rate())) {
    report_.failure = RunFailure{"diverged", "the state is no longer finite"};
    status_ = RunStatus::failed;
  }
  if (status_ == RunStatus::failed) return;

  if (reason_ == Reason::side) {
    side_ = entered_;
    side_is_known_ = on_edge_ = true;
  }
}

// ---- 4: samples on the open arc
// --------------------------------------------------------------------------------

template <typename Dynamics>
void SingleAxisRun<Dynamics>::fill_row(double t_s, std::span<double> state, std::span<double> thrusters) {
  const double tau = t_s - t_s_;
  AxisOnTimes on = on_;
  if (u_ > 0) on.positive_s += tau;
  if (u_ < 0) on.negative_s += tau;
  const AxisMotion motion = dynamics_.at(arc_, tau);
  fill_axis_row(law_, spec_->maneuver.final_angle_rad, motion.angle_rad, motion.rate_rad_s, u_,
                spec_->actuator.torque_N_m, on, state, thrusters);
  dynamics_.elastic_row(arc_, tau, state.subspan(kAxisStateChannels));
}

// A sample at the end of a step belongs to the next one: it shows the state after the switching.
template <typename Dynamics>
void SingleAxisRun<Dynamics>::hand_out(double until_s, bool inclusive, SampleSink& sink) {
  const auto is_in_reach = [&](double t_s) {
    return t_s <= until_s && (t_s < end_s_ || (inclusive && t_s <= end_s_));
  };
  for (double t_s = static_cast<double>(next_row_) * spec_->telemetry_period_s; is_in_reach(t_s);
       t_s = static_cast<double>(++next_row_) * spec_->telemetry_period_s) {
    fill_row(t_s, state_row_, thruster_row_);
    sink.sample(t_s, state_row_, thruster_row_);
    last_row_s_ = t_s;
  }
  for (; next_output_ < report_.outputs.size() && is_in_reach(report_.outputs[next_output_].t_s);
       ++next_output_) {
    OutputRow& output = report_.outputs[next_output_];
    fill_row(output.t_s, output.state, output.thrusters);
  }
}

template <typename Dynamics>
void SingleAxisRun<Dynamics>::finish(const char* reason, SampleSink& sink) {
  if (spec_->stop == StopCondition::end_box && in_box_) fire(0, sink);
  dynamics_.push(arc_, u_);
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

template <typename Dynamics>
RunReport SingleAxisRun<Dynamics>::report() const {
  RunReport report = report_;
  report.metrics = metrics_.finish(t_s_, angle(), rate());
  // A copy, since a row needs room to be made in.
  Dynamics dynamics = dynamics_;
  std::vector<double> state(channels_.state.size()), thrusters(channels_.thrusters.size());
  fill_axis_row(law_, spec_->maneuver.final_angle_rad, angle(), rate(), u_, spec_->actuator.torque_N_m, on_,
                state, thrusters);
  dynamics.elastic_row(arc_, 0, std::span(state).subspan(kAxisStateChannels));
  report.metrics.final_state = std::move(state);
  report.digest = digester_.digest();
  return report;
}

}  // namespace

std::unique_ptr<Run> make_single_axis_run(const SingleAxisSpecification& specification) {
  if (specification.plant.modes.empty()) return std::make_unique<SingleAxisRun<RigidDynamics>>(specification);
  return std::make_unique<SingleAxisRun<FlexibleDynamics>>(specification);
}

}  // namespace slew
