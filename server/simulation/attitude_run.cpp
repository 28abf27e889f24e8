// The three-axis loop: a law evaluated continuously by Dormand & Prince with events, a sampled one by a step
// of Runge & Kutta's between two things that happen. The order of a step is server/doc/step.md's.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/actuator/pwpf_filter.hpp"
#include "server/actuator/thruster_bank.hpp"
#include "server/estimation/sampled_disturbance_observer.hpp"
#include "server/propagation/dormand_prince.hpp"
#include "server/propagation/quartic.hpp"
#include "server/propagation/runge_kutta_4.hpp"
#include "server/sensor/attitude_sensor.hpp"
#include "server/simulation/attitude_channels.hpp"
#include "server/simulation/attitude_filters.hpp"
#include "server/simulation/attitude_loop.hpp"
#include "server/simulation/attitude_metrics.hpp"
#include "server/simulation/stepped_run.hpp"

namespace slew {
namespace {

using Eigen::Vector3d;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::array<double, 5> kNodes{0, 0.25, 0.5, 0.75, 1};
/// What a step of the classical Runge-Kutta method may turn by, by rate, acceleration or what a rising thrust
/// adds, rad: its error is x^5/120, below 1e-13. And of a sinusoidal disturbance's phase, of which it makes
/// x^4/2880.
constexpr double kTurnPerStep_rad = 0.006, kPhasePerStep_rad = 0.03;
constexpr int kChangesAtOneInstant = 256;

/// What the triggers of the channels look at, and behind them |p|^2.
using Looks = std::array<double, kMaxThrusters + 1>;

class AttitudeRun final : public SteppedRun {
 public:
  explicit AttitudeRun(const AttitudeSpecification& specification);

  const std::vector<std::string>& event_channels() const override { return *event_channels_; }
  double duration_s() const override { return spec().duration_s; }
  RunReport report() const override;
  std::unique_ptr<Run> clone() const override { return std::make_unique<AttitudeRun>(*this); }

 private:
  struct Channel {
    int output = 0;
    double free_from_s = 0;  ///< before that the minimum on- or off-time holds it
    double pulse_end_s = kNever;
    double demand = 0;             ///< held by a sampled law
    double filter = 0, limit = 0;  ///< of a sampled law's modulator, at the beginning of the step
  };
  struct Thresholds {
    double on, off;
  };
  /// Where a step ends because a guard crosses: a channel changes to an output, or p to its shadow.
  struct Crossing {
    double x;  ///< of the step
    std::size_t channel;
    int output;
    double rate_1_s = 0;         ///< of the guard there
    double from = 0, until = 1;  ///< what of the step holds it
  };

  const AttitudeSpecification& spec() const { return loop_->specification(); }
  std::size_t channel_count() const { return loop_->channels().size(); }
  bool is_signed(std::size_t c) const { return loop_->channels()[c].is_signed; }
  auto slope() const {
    return [this](double t, const AttitudeState& x, AttitudeState& dx) { loop_->slope(hold_, t, x, dx); };
  }

  void open_step(SampleSink& sink) override;
  void change_what_is_due(SampleSink& sink);
  void take_sample(SampleSink& sink);
  [[gnu::flatten]] void ask_law(const AttitudeSight<double>& sight) {
    held_.law = command(spec().law, sight);
  }
  void switch_to_shadow(SampleSink& sink);
  void set_demand(std::size_t c, double demand, SampleSink& sink);
  void set_outputs(SampleSink& sink);
  int wanted(std::size_t c, double look) const;
  void set_output(std::size_t c, int output, SampleSink& sink);
  void tell_valves(SampleSink& sink);
  void event(std::uint32_t channel, int mode, SampleSink& sink);
  void fail(const char* code, const char* sentence);
  double next_timer_s() const;

  void look(double t_s, const double* state, Looks& looks) const;
  void look_within(double x, Looks& looks);
  double guard(const Crossing& crossing, const Looks& looks) const;
  void fly_continuously(double limit_s);
  void end_filters();
  std::array<bool, kMaxThrusters> free_channels() const;
  std::optional<Crossing> first_crossing();
  bool between_corners(Crossing& crossing, const std::array<double, 5>& guards);
  void land_on(const Crossing& crossing);
  void fly_segment(double limit_s);
  void close_step() override;
  void measure_continuous(double h);
  void measure_segment(double h);
  void measure_held_torque(double h);
  void state_at(double t_s, double* state) const;
  void exact_state_at(double t_s, double* state) const;
  void filters_at(double t_s, double* state) const;

  void fill_row(double t_s, std::span<double> state, std::span<double> thrusters) override;
  void fill_output(double t_s, std::span<double> state, std::span<double> thrusters) override;
  void fill_row_of(double t_s, const AttitudeState& x, std::span<double> state,
                   std::span<double> thrusters) const;
  void digest_state() override;

  const std::shared_ptr<const AttitudeLoop> loop_;
  const std::shared_ptr<const std::vector<std::string>> event_channels_;
  const AttitudeEvents events_;
  const AttitudeState absolute_;
  const Thresholds thresholds_;
  const bool looks_at_law_;                ///< triggers do, at every instant
  const bool valves_differ_from_outputs_;  ///< by delays or faults
  const double fastest_disturbance_rad_s_;
  const std::optional<Vector3d> gas_flow_m3_s_;  ///< of any torque's controls
  const double swing_rad_s_;                     ///< of a body that is not free

  AttitudeState state_{};
  AttitudeHold hold_;
  std::optional<ThrusterBank> bank_;
  std::array<bool, kMaxThrusters> valves_told_{};
  bool empty_told_ = false;
  std::array<Channel, kMaxThrusters> channel_{};
  std::size_t next_disturbance_ = 0;
  double program_changes_s_ = kNever, reference_changes_s_ = kNever;
  int changes_at_this_instant_ = 0;

  // Of a sampled law.
  std::optional<AttitudeSensor> sensor_;
  std::optional<SampledDisturbanceObserver> observer_;
  ObserverState<double> observer_state_;
  AttitudeDemand held_;
  Vector3d input_N_m_ = Vector3d::Zero();      ///< to the observer, but for the torque applied
  Vector3d impulse_N_m_s_ = Vector3d::Zero();  ///< of the actuator since the latest sample
  std::int64_t sample_ = 0;
  double next_sample_s_ = kNever;

  // The step that is open, from t_s_ to end_s_.
  std::optional<Crossing> ends_at_;
  mutable DormandPrince<kMaxAttitudeState> integrator_;
  mutable RungeKutta4<kMaxAttitudeState> segment_;
  AttitudeFilters filters_;  ///< where they are apart: over filters_length_s_ from t_s_ on
  double filters_length_s_ = 0;
  std::array<double, kMaxThrusters> end_filters_{};
  bool goes_on_ = false;  ///< nothing has changed since the step before
  double next_length_s_ = 0.01;

  AttitudeMetrics metrics_;
};

AttitudeState scaled_tolerances(const AttitudeLoop& loop) {
  return loop.absolute_tolerances(1e-3 * loop.specification().relative_tolerance);
}

double fastest_rad_s(const BodyDisturbances& disturbances) {
  double fastest = 0;
  for (const BodySinusoid& one : disturbances.sinusoids)
    fastest = std::max(fastest, std::abs(one.frequency_rad_s));
  return fastest;
}

bool valves_are_late_or_broken(const AttitudeSpecification& spec) {
  const auto thrusters = thrusters_of(spec.actuator);
  return std::any_of(thrusters.begin(), thrusters.end(), [](const Thruster& thruster) {
    return thruster.on_delay_s > 0 || thruster.off_delay_s > 0 || thruster.stuck_open_from_s < kNever ||
           thruster.stuck_closed_from_s < kNever;
  });
}

// Integral of |x| from 0 to h, linear from begin to end.
double absolute_integral(double begin, double end, double h) {
  if (begin * end >= 0) return 0.5 * h * std::abs(begin + end);
  return 0.5 * h * (begin * begin + end * end) / std::abs(end - begin);
}

AttitudeRun::AttitudeRun(const AttitudeSpecification& specification)
    : loop_(std::make_shared<const AttitudeLoop>(specification)),
      event_channels_(std::make_shared<const std::vector<std::string>>(attitude_event_channels(*loop_))),
      events_(attitude_events(*loop_)),
      absolute_(scaled_tolerances(*loop_)),
      thresholds_([&]() -> Thresholds {
        if (const auto* pwpf = loop_->pwpf()) return {pwpf->on, pwpf->off};
        if (!loop_->modulator()) return {};
        const auto* schmitt = std::get_if<SchmittModulator>(loop_->modulator());
        return schmitt ? Thresholds{schmitt->on, schmitt->off} : Thresholds{};
      }()),
      looks_at_law_(loop_->acts_within_steps() && loop_->modulator() && !loop_->pwpf()),
      valves_differ_from_outputs_(valves_are_late_or_broken(specification)),
      fastest_disturbance_rad_s_(fastest_rad_s(specification.disturbances)),
      gas_flow_m3_s_([&]() -> std::optional<Vector3d> {
        const auto* ideal = std::get_if<IdealTorque>(&specification.actuator);
        return ideal ? ideal->gas_flow_m3_s : std::nullopt;
      }()),
      swing_rad_s_(specification.plant.is_free() ? 0 : specification.plant.fastest_swing_rad_s()),
      state_(loop_->initial_state()),
      integrator_(loop_->integrated()),
      segment_(loop_->size()),
      metrics_(specification) {
  if (auto thrusters = thrusters_of(spec().actuator); !thrusters.empty())
    bank_.emplace(std::move(thrusters), *propellant_of(spec().actuator), spec().seed);
  hold_.disturbance_N_m = spec().disturbances.constant_N_m;
  if (loop_->is_sampled()) {
    next_sample_s_ = 0;
    if (!spec().sensor.is_ideal()) sensor_.emplace(spec().sensor, spec().seed);
    if (spec().observer) observer_.emplace(*spec().observer, *spec().sample_period_s);
  }
  program_changes_s_ = next_change_s(spec().law, 0);
  reference_changes_s_ = spec().maneuver.reference.next_change_s(0);
  report_.propagator.name = loop_->is_sampled() ? "runge_kutta_4" : "dormand_prince_5_4";
  lay_out(attitude_channels(*loop_), spec().telemetry_period_s, spec().output_times_s);
  digest_state();
}

void AttitudeRun::digest_state() {
  digester_.real(t_s_);
  for (std::size_t i = 0; i < loop_->size(); ++i) digester_.real(state_[i]);
}

void AttitudeRun::fail(const char* code, const char* sentence) {
  report_.failure = RunFailure{code, sentence};
  status_ = RunStatus::failed;
}

void AttitudeRun::event(std::uint32_t channel, int mode, SampleSink& sink) {
  note(channel, mode, sink);
  goes_on_ = false;
  if (++changes_at_this_instant_ > kChangesAtOneInstant)
    fail("event_cascade", "more changes at one instant than a loop that makes sense can have");
}

void AttitudeRun::open_step(SampleSink& sink) {
  if (t_s_ >= spec().duration_s) return finish("duration", sink);
  change_what_is_due(sink);
  if (status_ != RunStatus::running) return;
  if (loop_->is_sampled())
    fly_segment(next_timer_s());
  else
    fly_continuously(next_timer_s());
  step_is_open_ = status_ == RunStatus::running;
}

// 1 and 2 of a step: timers in their order, then the triggers whose guards hold.
void AttitudeRun::change_what_is_due(SampleSink& sink) {
  hold_.began_s = t_s_;
  if (bank_ && bank_->next_s() <= t_s_) {
    bank_->arrive(t_s_);
    goes_on_ = false;
  }
  const auto& steps = spec().disturbances.steps;
  for (; next_disturbance_ < steps.size() && steps[next_disturbance_].from_s <= t_s_; ++next_disturbance_) {
    hold_.disturbance_N_m += steps[next_disturbance_].torque_N_m;
    goes_on_ = false;
  }
  if (program_changes_s_ <= t_s_) {
    program_changes_s_ = next_change_s(spec().law, t_s_);
    event(events_.program, program_changes_s_ < kNever ? 1 : 0, sink);
  }
  if (reference_changes_s_ <= t_s_) {
    reference_changes_s_ = spec().maneuver.reference.next_change_s(t_s_);
    goes_on_ = false;
  }
  if (next_sample_s_ <= t_s_) take_sample(sink);
  if (ends_at_ && ends_at_->channel == channel_count()) {
    switch_to_shadow(sink);
    ends_at_.reset();
  }
  if (!bank_) return;
  set_outputs(sink);
  tell_valves(sink);
  hold_.torque_N_m = bank_->torque_N_m();
  hold_.torque_slope_N_m_s = bank_->torque_slope_N_m_s();
  hold_.torque_began_s = bank_->piece_began_s();
}

void AttitudeRun::take_sample(SampleSink& sink) {
  const double period_s = *spec().sample_period_s;
  if (const auto& most = spec().plant.shadow_switch_norm)
    if (loop_->mrp_of(state_.data()).squaredNorm() > *most * *most) switch_to_shadow(sink);
  AttitudeSight<double> sight{loop_->mrp_of(state_.data()), loop_->rate_of(state_.data()), {}, t_s_, t_s_};
  if (sensor_) {
    const AttitudeReading reading = sensor_->read(sight.mrp, sight.rate_rad_s);
    sight.mrp = reading.mrp;
    sight.rate_rad_s = reading.rate_rad_s;
  }
  if (!spec().maneuver.reference.is_fixed()) sight.reference = spec().maneuver.reference.at(t_s_);
  const Vector3d surface_before = held_.law.surface_rad_s;
  ask_law(sight);
  if (observer_) {
    observer_state_ = sample_ == 0 ? initial_observer_state<double>(*spec().observer, held_.law.surface_rad_s)
                                   : observer_->step(observer_state_, surface_before, held_.law.surface_rad_s,
                                                     input_N_m_ + impulse_N_m_s_ / period_s);
    held_.estimate_N_m = observer_->estimate(observer_state_, held_.law.surface_rad_s)[0];
    impulse_N_m_s_.setZero();
  }
  held_.torque_N_m = held_.law.torque_N_m - held_.estimate_N_m;
  if (observer_) {
    // What of the input is known now; the torque that is applied is added up as it acts.
    input_N_m_.setZero();
    if (spec().observer->feeding == ObserverFeeding::applied_minus_equivalent)
      input_N_m_ = -held_.law.equivalent_N_m;
    if (spec().observer->feeding == ObserverFeeding::commanded)
      input_N_m_ = held_.torque_N_m - held_.law.equivalent_N_m;
  }
  if (bank_) {
    std::array<double, kMaxThrusters> demands;
    loop_->allocate(hold_, t_s_, held_.torque_N_m, std::span(demands).first(channel_count()));
    for (std::size_t c = 0; c < channel_count(); ++c) set_demand(c, demands[c], sink);
  } else {
    hold_.torque_N_m = loop_->limited(held_.torque_N_m);
    hold_.torque_began_s = t_s_;
  }
  next_sample_s_ = static_cast<double>(++sample_) * period_s;
}

// s jumps with p; what the observer has estimated does not.
void AttitudeRun::switch_to_shadow(SampleSink& sink) {
  const Vector3d before = loop_->surface(hold_, t_s_, state_.data());
  loop_->switch_to_shadow(state_);
  const Vector3d jump = loop_->surface(hold_, t_s_, state_.data()) - before;
  if (observer_) {
    const std::array<double, 3> gains = observer_gains(spec().observer->pole_rad_s);
    for (std::size_t i = 0; i < 3; ++i)
      observer_state_[i] -= gains[i] * spec().observer->inertia_kg_m2 * jump;
    held_.law.surface_rad_s += jump;  // from here the next sample counts
  } else {
    loop_->jump(state_, jump);
  }
  event(events_.shadow, 1, sink);
}

void AttitudeRun::set_demand(std::size_t c, double demand, SampleSink& sink) {
  channel_[c].demand = demand;
  const auto* pulse = std::get_if<PulseWidthModulator>(loop_->modulator());
  if (!pulse) return;
  const double period_s = *spec().sample_period_s;
  const double length_s = std::min(1.0, std::abs(demand) / loop_->channels()[c].level) * period_s;
  const bool fires = length_s > 0 && length_s >= pulse->minimum_on_time_s;
  channel_[c].pulse_end_s = fires && length_s < period_s ? t_s_ + length_s : kNever;
  set_output(c, !fires ? 0 : demand > 0 ? 1 : -1, sink);
}

int AttitudeRun::wanted(std::size_t c, double look) const {
  const int output = channel_[c].output;
  if (output != 0) return output * look <= thresholds_.off ? 0 : output;
  if (look >= thresholds_.on) return 1;
  return is_signed(c) && -look >= thresholds_.on ? -1 : 0;
}

void AttitudeRun::look(double t_s, const double* state, Looks& looks) const {
  const std::size_t n = channel_count();
  if (looks_at_law_) {
    loop_->allocate(hold_, t_s, loop_->demand(hold_, t_s, state).torque_N_m, std::span(looks).first(n));
    for (std::size_t c = 0; c < n; ++c) looks[c] /= loop_->channels()[c].level;
  } else if (loop_->filters() > 0 && !loop_->filters_are_apart()) {
    std::copy_n(state + loop_->filters_at(), n, looks.begin());
  }
  if (spec().plant.shadow_switch_norm) looks[n] = loop_->mrp_of(state).squaredNorm();
}

void AttitudeRun::set_outputs(SampleSink& sink) {
  if (std::holds_alternative<PulseWidthModulator>(*loop_->modulator())) {
    for (std::size_t c = 0; c < channel_count(); ++c) {
      if (channel_[c].pulse_end_s > t_s_) continue;
      channel_[c].pulse_end_s = kNever;
      set_output(c, 0, sink);
    }
    return;
  }
  Looks looks;
  if (loop_->is_sampled())
    for (std::size_t c = 0; c < channel_count(); ++c)
      looks[c] = loop_->pwpf() ? channel_[c].filter : channel_[c].demand / loop_->channels()[c].level;
  else if (loop_->filters() > 0)
    std::copy_n(state_.begin() + static_cast<std::ptrdiff_t>(loop_->filters_at()), channel_count(),
                looks.begin());
  else
    look(t_s_, state_.data(), looks);
  for (std::size_t c = 0; c < channel_count(); ++c) {
    // The guard that ended the step before has crossed, whatever rounding says.
    if (ends_at_ && ends_at_->channel == c) {
      set_output(c, ends_at_->output, sink);
      continue;
    }
    // On to off, and from there to the other side: no more at one instant.
    for (int change = 0; change < 2 && channel_[c].free_from_s <= t_s_; ++change)
      set_output(c, wanted(c, looks[c]), sink);
  }
  ends_at_.reset();
}

void AttitudeRun::set_output(std::size_t c, int output, SampleSink& sink) {
  Channel& channel = channel_[c];
  if (output == channel.output) return;
  const auto thruster = [&](int sign) { return is_signed(c) ? 2 * c + (sign < 0 ? 1 : 0) : c; };
  bool is_taken = true;
  if (channel.output != 0) is_taken = bank_->command(t_s_, thruster(channel.output), false);
  if (output != 0) is_taken = bank_->command(t_s_, thruster(output), true) && is_taken;
  if (!is_taken) fail("too_many_commands", "a thruster is commanded faster than its valve can follow");
  channel.free_from_s = t_s_ + (output != 0 ? bank_->shortest_command_s(thruster(output))
                                            : bank_->thruster(thruster(channel.output)).minimum_off_time_s);
  channel.output = output;
  hold_.outputs[c] = output;
  event(static_cast<std::uint32_t>(c), output, sink);
}

void AttitudeRun::tell_valves(SampleSink& sink) {
  if (bank_->is_empty() && !empty_told_) {
    empty_told_ = true;
    event(events_.tank, 1, sink);
  }
  if (!valves_differ_from_outputs_) return;
  for (std::size_t j = 0; j < bank_->size(); ++j) {
    if (bank_->is_open(j) == valves_told_[j]) continue;
    valves_told_[j] = bank_->is_open(j);
    event(events_.valves + static_cast<std::uint32_t>(j), valves_told_[j] ? 1 : 0, sink);
  }
}

double AttitudeRun::next_timer_s() const {
  double next = std::min({spec().duration_s, next_sample_s_, program_changes_s_, reference_changes_s_});
  const auto& steps = spec().disturbances.steps;
  if (next_disturbance_ < steps.size()) next = std::min(next, steps[next_disturbance_].from_s);
  if (!bank_) return next;
  next = std::min(next, bank_->next_s());
  for (std::size_t c = 0; c < channel_count(); ++c) {
    next = std::min(next, channel_[c].pulse_end_s);
    if (channel_[c].free_from_s > t_s_) next = std::min(next, channel_[c].free_from_s);
  }
  return next;
}

// 3 of a step, of a law evaluated continuously: to the first guard, or as far as the error allows.
void AttitudeRun::fly_continuously(double limit_s) {
  using Integrator = DormandPrince<kMaxAttitudeState>;
  const auto f = slope();
  if (goes_on_) {
    integrator_.go_on();
  } else {
    integrator_.begin(f, t_s_, state_);
    ++report_.propagator.rhs_evaluations;
  }
  const double room = limit_s - t_s_;
  const double least = 1e-13 * std::max(1.0, t_s_);
  double h = std::min(next_length_s_, room);
  // Not much further than where a filter will end it.
  if (loop_->filters_are_apart())
    h = std::clamp(1.5 * filters_.begin(*loop_, hold_, t_s_, state_, free_channels()), std::min(least, h), h);
  while (true) {
    integrator_.attempt(f, t_s_, h);
    report_.propagator.rhs_evaluations += 6;
    const double error = integrator_.error(spec().relative_tolerance, absolute_);
    if (!std::isfinite(error)) {
      if (h <= least) return fail("diverged", "the state has grown beyond what can be calculated with");
      h *= 0.1;
      continue;
    }
    double next = h * Integrator::growth(error);
    if ((error <= 1 || h <= least) && loop_->filters_are_apart()) {
      const auto outcome =
          filters_.step(*loop_, hold_, t_s_, h, integrator_, state_.data() + loop_->filters_at());
      if (!outcome.is_taken && h > least) {
        next_length_s_ = std::min(next_length_s_, outcome.next);
        h = outcome.length;
        continue;
      }
      filters_length_s_ = h;
      next = std::min(next, outcome.next);
    }
    // A step as short as rounding is taken as it is.
    if (error <= 1 || h <= least) {
      // One that was cut short says little about the next.
      next_length_s_ = h < next_length_s_ && error <= 1 ? std::max(next_length_s_, next) : next;
      break;
    }
    next_length_s_ = next;
    h = next;
  }
  end_s_ = h < room ? t_s_ + h : limit_s;
  goes_on_ = true;
  if (loop_->filters_are_apart()) return end_filters();
  if (const auto crossing = first_crossing()) land_on(*crossing);
}

// Whose minimum on- or off-time is over.
std::array<bool, kMaxThrusters> AttitudeRun::free_channels() const {
  std::array<bool, kMaxThrusters> is_free{};
  for (std::size_t c = 0; c < channel_count(); ++c) is_free[c] = channel_[c].free_from_s <= t_s_;
  return is_free;
}

// The first that changes ends the step: a channel, of which its filter tells when, or the parameters.
void AttitudeRun::end_filters() {
  const auto crossing = filters_.first_crossing(*loop_, hold_, free_channels());
  if (crossing) {
    end_s_ = t_s_ + crossing->x * filters_length_s_;
    ends_at_ = Crossing{crossing->x, crossing->channel, crossing->output};
    integrator_.attempt(slope(), t_s_, end_s_ - t_s_);
    report_.propagator.rhs_evaluations += 6;
  }
  if (spec().plant.shadow_switch_norm)
    if (const auto shadow = first_crossing()) land_on(*shadow);
  for (std::size_t c = 0; c < channel_count(); ++c)
    end_filters_[c] = filters_.at(c, (end_s_ - t_s_) / filters_length_s_);
  if (!ends_at_ || ends_at_->channel == channel_count()) return;
  const int output = channel_[ends_at_->channel].output;
  end_filters_[ends_at_->channel] =
      output != 0 ? output * thresholds_.off : ends_at_->output * thresholds_.on;
}

// Positive from the crossing on.
double AttitudeRun::guard(const Crossing& crossing, const Looks& looks) const {
  const double look = looks[crossing.channel];
  if (crossing.channel == channel_count()) {
    const double most = *spec().plant.shadow_switch_norm;
    return look - most * most;
  }
  const int output = channel_[crossing.channel].output;
  return output != 0 ? thresholds_.off - output * look : crossing.output * look - thresholds_.on;
}

void AttitudeRun::look_within(double x, Looks& looks) {
  AttitudeState between;
  const std::size_t from = looks_at_law_ || spec().plant.shadow_switch_norm ? 0 : loop_->filters_at();
  integrator_.at(x, from, loop_->integrated(), between.data() + from);
  look(t_s_ + x * integrator_.length(), between.data(), looks);
}

std::optional<AttitudeRun::Crossing> AttitudeRun::first_crossing() {
  const bool has_triggers = looks_at_law_ || (loop_->filters() > 0 && !loop_->filters_are_apart());
  if (!has_triggers && !spec().plant.shadow_switch_norm) return std::nullopt;
  std::array<Looks, 5> looks;
  look(t_s_, integrator_.start().data(), looks[0]);
  for (std::size_t i = 1; i < 4; ++i) look_within(kNodes[i], looks[i]);
  look(end_s_, integrator_.end().data(), looks[4]);
  std::optional<Crossing> first;
  const auto consider = [&](Crossing crossing) {
    std::array<double, 5> guards;
    for (std::size_t i = 0; i < 5; ++i) guards[i] = guard(crossing, looks[i]);
    if (Quartic::is_far_below(guards)) return;
    const Quartic curve = Quartic::through(guards);
    const auto x = curve.first_positive();
    crossing.x = x.value_or(2);
    if (looks_at_law_ && crossing.channel < channel_count() && !between_corners(crossing, guards)) return;
    if (crossing.x > 1 || (first && crossing.x >= first->x)) return;
    constexpr double kAside = 1e-3;
    const double before = std::max(0.0, crossing.x - kAside), after = std::min(1.0, crossing.x + kAside);
    crossing.rate_1_s = (curve.at(after) - curve.at(before)) / ((after - before) * integrator_.length());
    first = crossing;
  };
  for (std::size_t c = 0; has_triggers && c < channel_count(); ++c) {
    if (channel_[c].free_from_s > t_s_) continue;
    if (channel_[c].output != 0) {
      consider({0, c, 0});
    } else {
      consider({0, c, 1});
      if (is_signed(c)) consider({0, c, -1});
    }
  }
  if (spec().plant.shadow_switch_norm) consider({0, channel_count(), 0});
  return first;
}

// What a law or an allocation asks for has corners, of which the integrator knows nothing as long as no more
// than the triggers look at it: the curve through five points is a guess, and their signs decide. False where
// it stays below.
bool AttitudeRun::between_corners(Crossing& crossing, const std::array<double, 5>& guards) {
  const auto guard_at = [&](double x) {
    Looks looks;
    look_within(x, looks);
    return guard(crossing, looks);
  };
  // So near that the order of the channels is beyond doubt.
  const auto narrow = [&](PointOfFunction from, PointOfFunction until) {
    crossing.from = from.x;
    crossing.until = until.x;
    crossing.x = becomes_positive(guard_at, from, until, 1e-13);
    return true;
  };
  if (guards[0] > 0) {
    crossing.x = crossing.until = 0;
    return true;
  }
  const auto positive = std::find_if(guards.begin(), guards.end(), [](double value) { return value > 0; });
  const auto node = static_cast<std::size_t>(positive - guards.begin());
  // An excursion between two points that the curve foresees.
  if (crossing.x <= 1 && (node == 5 || crossing.x < kNodes[node - 1])) {
    const auto before = static_cast<std::size_t>(std::min(3.0, crossing.x / 0.25));
    constexpr int kParts = 8;
    PointOfFunction from{kNodes[before], guards[before]};
    for (int i = 1; i < kParts; ++i) {
      const double x = kNodes[before] + 0.25 * i / kParts;
      const PointOfFunction until{x, guard_at(x)};
      if (until.value > 0) return narrow(from, until);
      from = until;
    }
  }
  return node < 5 && narrow({kNodes[node - 1], guards[node - 1]}, {kNodes[node], guards[node]});
}

// Ends the step on the crossing: not on the continuous extension's, which is of a lower order, but on the
// method's own, by steps of Newton's, and by halving where they lead out of what holds it.
void AttitudeRun::land_on(const Crossing& crossing) {
  const double whole = integrator_.length();
  const double least = 1e-14 * std::max(1.0, t_s_);
  double from = crossing.from * whole, until = crossing.until * whole;
  double h = crossing.x * whole, rate = crossing.rate_1_s;
  double h_before = 0, value_before = 0;
  const auto f = slope();
  for (int i = 0; i < 60; ++i) {
    integrator_.attempt(f, t_s_, h);
    report_.propagator.rhs_evaluations += 6;
    Looks looks;
    look(t_s_ + h, integrator_.end().data(), looks);
    const double value = guard(crossing, looks);
    (value > 0 ? until : from) = h;
    if (crossing.channel < channel_count() && !looks_at_law_) {
      const double fs_rate = integrator_.last_slope()[loop_->filters_at() + crossing.channel];
      rate = crossing.output != 0 ? crossing.output * fs_rate : -channel_[crossing.channel].output * fs_rate;
      const double by = -value / rate;
      if (rate > 0 && by * by <= 0.01 * spec().relative_tolerance * whole * whole) {
        integrator_.move_end(by);
        h += by;
        break;
      }
    } else if (i > 0 && h != h_before)
      rate = (value - value_before) / (h - h_before);
    h_before = h;
    value_before = value;
    double next = rate > 0 ? h - value / rate : -1;
    if (rate > 0 && std::abs(next - h) <= least) break;
    if (!(next > from && next < until)) next = 0.5 * (from + until);
    if (until - from <= least) break;
    h = next;
  }
  end_s_ = t_s_ + h;
  ends_at_ = crossing;
}

// 3 of a step, of a sampled law: nothing acts but what is held.
void AttitudeRun::fly_segment(double limit_s) {
  end_s_ = limit_s;
  if (const PwpfModulator* pwpf = loop_->pwpf())
    for (std::size_t c = 0; c < channel_count(); ++c) {
      Channel& channel = channel_[c];
      channel.limit = loop_->filter_limit(c, channel.demand, channel.output);
      if (channel.free_from_s > t_s_) continue;
      const auto try_threshold = [&](double threshold, int output) {
        const double at_s = t_s_ + time_to_reach(*pwpf, channel.filter, channel.limit, threshold);
        if (at_s >= end_s_) return;
        end_s_ = at_s;
        ends_at_ = Crossing{1, c, output};
      };
      if (channel.output != 0) {
        try_threshold(channel.output * pwpf->off, 0);
      } else {
        try_threshold(pwpf->on, 1);
        if (is_signed(c)) try_threshold(-pwpf->on, -1);
      }
    }
  const auto f = slope();
  segment_.begin(f, t_s_, state_);
  const Vector3d acceleration = loop_->rate_of(segment_.first_slope().data());
  const Vector3d rate = loop_->rate_of(state_.data());
  double h = end_s_ - t_s_;
  double turns = std::max(swing_rad_s_, std::sqrt(rate.squaredNorm() + acceleration.norm()));
  if (!hold_.torque_slope_N_m_s.isZero(0))
    turns = std::max(turns, std::cbrt((loop_->inverse_inertia() * hold_.torque_slope_N_m_s).norm()));
  const double parts = h * std::max(turns / kTurnPerStep_rad, fastest_disturbance_rad_s_ / kPhasePerStep_rad);
  if (!std::isfinite(parts))
    return fail("diverged", "the state has grown beyond what can be calculated with");
  if (parts > 1) {
    h /= std::ceil(parts);
    end_s_ = t_s_ + h;
    ends_at_.reset();
  }
  segment_.step(f, t_s_, h);
  report_.propagator.rhs_evaluations += 4;
}

void AttitudeRun::close_step() {
  const double h = end_s_ - t_s_;
  if (loop_->is_sampled())
    measure_segment(h);
  else
    measure_continuous(h);
  const AttitudeState& end = loop_->is_sampled() ? segment_.end() : integrator_.end();
  std::copy_n(end.begin(), loop_->integrated(), state_.begin());
  if (loop_->filters_are_apart())
    std::copy_n(end_filters_.begin(), channel_count(),
                state_.begin() + static_cast<std::ptrdiff_t>(loop_->filters_at()));
  if (end_s_ > t_s_) changes_at_this_instant_ = 0;
  t_s_ = end_s_;
  ++report_.propagator.steps;
  digest_state();
  step_is_open_ = false;
}

// Integrals by Boole's rule.
void AttitudeRun::measure_continuous(double h) {
  constexpr std::array<double, 5> kWeights{7.0 / 90, 32.0 / 90, 12.0 / 90, 32.0 / 90, 7.0 / 90};
  std::array<Vector3d, 5> mrp;
  const bool is_any_torque = !bank_.has_value();
  double impulse = 0, effort = 0, gas = 0;
  AttitudeState between;
  for (std::size_t i = 0; i < 5; ++i) {
    const double* x = i == 0 ? integrator_.start().data() : integrator_.end().data();
    if (i > 0 && i < 4) {
      integrator_.at(kNodes[i], 0, loop_->integrated(), between.data());
      x = between.data();
    }
    mrp[i] = loop_->mrp_of(x);
    metrics_.rate(loop_->rate_of(x));
    if (!is_any_torque) continue;
    const double at_s = t_s_ + kNodes[i] * h;
    const Vector3d torque = loop_->torque(hold_, at_s, loop_->demand(hold_, at_s, x));
    impulse += kWeights[i] * torque.lpNorm<1>();
    effort += kWeights[i] * torque.squaredNorm();
    if (gas_flow_m3_s_) gas += kWeights[i] * gas_flow_m3_s_->dot(loop_->controls(torque).cwiseAbs());
  }
  metrics_.step(t_s_, h, mrp);
  if (is_any_torque)
    metrics_.effort(h * impulse, h * effort, h * gas);
  else
    measure_held_torque(h);
}

// Linear in time.
void AttitudeRun::measure_held_torque(double h) {
  const Vector3d half_change = 0.5 * h * hold_.torque_slope_N_m_s;
  const Vector3d middle =
      hold_.torque_N_m + (t_s_ - hold_.torque_began_s) * hold_.torque_slope_N_m_s + half_change;
  double impulse = 0;
  for (int axis = 0; axis < 3; ++axis)
    impulse += absolute_integral(middle[axis] - half_change[axis], middle[axis] + half_change[axis], h);
  // Where controls use gas and no valve rises, torque is held.
  const double gas = gas_flow_m3_s_ ? h * gas_flow_m3_s_->dot(loop_->controls(middle).cwiseAbs()) : 0;
  metrics_.effort(impulse, h * (middle.squaredNorm() + half_change.squaredNorm() / 3), gas);
  if (observer_ && spec().observer->feeding != ObserverFeeding::commanded) impulse_N_m_s_ += h * middle;
}

void AttitudeRun::measure_segment(double h) {
  measure_held_torque(h);
  if (const PwpfModulator* pwpf = loop_->pwpf())
    for (std::size_t c = 0; c < channel_count(); ++c) {
      Channel& channel = channel_[c];
      channel.filter = filter_after(*pwpf, channel.filter, channel.limit, h);
      if (ends_at_ && ends_at_->channel == c)
        channel.filter = channel.output != 0 ? channel.output * pwpf->off : ends_at_->output * pwpf->on;
    }
  const Vector3d begin = loop_->mrp_of(state_.data()), end = loop_->mrp_of(segment_.end().data());
  const Vector3d rate = loop_->rate_of(segment_.end().data());
  metrics_.rate(rate);
  // Between the ends |w|^2 is a parabola, but for what is of third order.
  const Vector3d rate_before = loop_->rate_of(state_.data());
  const double rise = 2 * h * rate_before.dot(loop_->rate_of(segment_.first_slope().data()));
  const double bend = rise - (rate.squaredNorm() - rate_before.squaredNorm());
  if (rise > 0 && rise < 2 * bend) metrics_.rate_square(rate_before.squaredNorm() + rise * rise / (4 * bend));
  // |p'| = (1 + p.p) |w| / 4, which a step hardly changes.
  const double fastest = std::max(rate.norm(), rate_before.norm());
  const double bound = 0.3 * (1 + std::max(begin.squaredNorm(), end.squaredNorm())) * fastest + 1e-9;
  if (metrics_.step(t_s_, h, begin, end, bound)) return;
  std::array<Vector3d, 5> mrp{begin, begin, begin, begin, end};
  AttitudeState between;
  for (std::size_t i = 1; i < 4; ++i) {
    segment_.at(slope(), end_s_, kNodes[i], between.data());
    mrp[i] = loop_->mrp_of(between.data());
  }
  metrics_.step(t_s_, h, mrp);
}

void AttitudeRun::state_at(double t_s, double* state) const {
  if (!step_is_open_ || t_s == t_s_) {
    std::copy_n(state_.begin(), loop_->size(), state);
    return;
  }
  const double x = (t_s - t_s_) / (end_s_ - t_s_);
  if (loop_->is_sampled())
    segment_.at(slope(), end_s_, x, state);
  else
    integrator_.at(x, 0, loop_->integrated(), state);
  filters_at(t_s, state);
}

void AttitudeRun::filters_at(double t_s, double* state) const {
  if (!loop_->filters_are_apart()) return;
  for (std::size_t c = 0; c < channel_count(); ++c)
    state[loop_->filters_at() + c] = filters_.at(c, (t_s - t_s_) / filters_length_s_);
}

// By a step of the method's own, which is of a higher order than what lies between its ends.
void AttitudeRun::exact_state_at(double t_s, double* state) const {
  if (!step_is_open_ || t_s == t_s_) return state_at(t_s, state);
  const auto part = [&](auto copy, auto take) {
    take(copy);
    std::copy_n(copy.end().begin(), loop_->integrated(), state);
  };
  if (loop_->is_sampled())
    part(segment_, [&](auto& segment) { segment.step(slope(), t_s_, t_s - t_s_); });
  else
    part(integrator_, [&](auto& integrator) { integrator.attempt(slope(), t_s_, t_s - t_s_); });
  filters_at(t_s, state);
}

void AttitudeRun::fill_row(double t_s, std::span<double> state, std::span<double> thrusters) {
  AttitudeState x;
  state_at(t_s, x.data());
  fill_row_of(t_s, x, state, thrusters);
}

void AttitudeRun::fill_output(double t_s, std::span<double> state, std::span<double> thrusters) {
  AttitudeState x;
  exact_state_at(t_s, x.data());
  fill_row_of(t_s, x, state, thrusters);
}

void AttitudeRun::fill_row_of(double t_s, const AttitudeState& x, std::span<double> state,
                              std::span<double> thrusters) const {
  AttitudeDemand now;
  if (!loop_->is_sampled()) now = loop_->demand(hold_, t_s, x.data());
  const AttitudeDemand& demand = loop_->is_sampled() ? held_ : now;
  std::size_t at = 0;
  const auto put = [&](const Vector3d& vector) {
    for (int axis = 0; axis < 3; ++axis) state[at++] = vector[axis];
  };
  put(loop_->mrp_of(x.data()));
  if (loop_->attitude_size() == 4)
    for (std::size_t i = 0; i < 4; ++i) state[at++] = x[i];
  put(loop_->rate_of(x.data()));
  if (spec().maneuver.tells_euler_angles) put(euler_angles_123<double>(loop_->attitude_of(x.data())));
  if (has_surface(spec().law)) put(demand.law.surface_rad_s);
  if (spec().observer) put(demand.estimate_N_m);
  if (const PwpfModulator* pwpf = loop_->pwpf())
    for (std::size_t c = 0; c < channel_count(); ++c)
      state[at++] = loop_->is_sampled()
                        ? filter_after(*pwpf, channel_[c].filter, channel_[c].limit, t_s - t_s_)
                        : x[loop_->filters_at() + c];
  const Vector3d torque = loop_->torque(hold_, t_s, demand);
  for (int axis = 0; axis < 3; ++axis) {
    thrusters[axis] = torque[axis];
    thrusters[3 + axis] = demand.torque_N_m[axis];
  }
  if (!bank_) return;
  for (std::size_t j = 0; j < bank_->size(); ++j) {
    thrusters[6 + j] = bank_->is_open(j) ? 1 : 0;
    thrusters[6 + bank_->size() + j] = bank_->on_time_s(j, t_s);
  }
}

RunReport AttitudeRun::report() const {
  RunReport report = report_;
  std::vector<double> thrusters(channels().thrusters.size());
  report.metrics = metrics_.finish(t_s_, loop_->mrp_of(state_.data()), loop_->rate_of(state_.data()));
  report.metrics.final_state.resize(channels().state.size());
  fill_row_of(t_s_, state_, report.metrics.final_state, thrusters);
  const Vector3d w = loop_->rate_of(state_.data());
  report.metrics.kinetic_energy_J = 0.5 * w.dot(spec().plant.inertia_kg_m2 * w);
  if (gas_flow_m3_s_) report.metrics.gas_volume_m3 = metrics_.gas_volume_m3();
  if (bank_) add_thrusters(*bank_, spec().actuator, t_s_, report.metrics);
  report.digest = digester_.digest();
  return report;
}

}  // namespace

std::unique_ptr<Run> make_attitude_run(const AttitudeSpecification& specification) {
  return std::make_unique<AttitudeRun>(specification);
}

}  // namespace slew
