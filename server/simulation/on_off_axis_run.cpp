// The closed loop of a single-axis slew by closed-form arcs. The order of a step is server/doc/step.md's.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "server/actuator/switching_delay.hpp"
#include "server/propagation/constrained_arc.hpp"
#include "server/simulation/axis.hpp"
#include "server/simulation/axis_channels.hpp"
#include "server/simulation/axis_dynamics.hpp"
#include "server/simulation/axis_metrics.hpp"
#include "server/simulation/stepped_run.hpp"

namespace slew {

int slew_direction(const SingleAxisManeuver& maneuver) {
  return maneuver.final_angle_rad < maneuver.initial_angle_rad ? -1 : 1;
}

double error_factor(const OnOffAxisSpecification& specification) {
  return specification.law.gamma_bar * (specification.law.inertia_kg_m2 / specification.law.torque_N_m) /
         (specification.plant.inertia_kg_m2 / specification.actuator.torque_N_m);
}

namespace {

// More changes of mode than this at one instant is an error.
constexpr int kLargestCascade = 32;
constexpr double kInstant_s = 1e-10;
// Arcs between switchings that are shorter than this have accumulated.
constexpr double kAccumulated_s = 1e-9;
// Of angles and of what is made from them, relative.
constexpr double kRounding = 1e-14;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

template <typename Dynamics>
class OnOffAxisRun final : public SteppedRun {
 public:
  explicit OnOffAxisRun(const OnOffAxisSpecification& specification);

  const std::vector<std::string>& event_channels() const override { return axis_event_channels(); }
  double duration_s() const override { return spec_->duration_s; }
  RunReport report() const override;
  std::unique_ptr<Run> clone() const override { return std::make_unique<OnOffAxisRun>(*this); }

 private:
  // Why the open step ends where it does.
  enum class Reason {
    sample,
    hold_over,
    valve,
    program,
    disturbance,
    side,
    box,
    rest,
    turn,
    excess,
    duration
  };
  // Who holds the hub on a path: nobody; thrusters that chatter along an edge, or at rest on it; friction.
  enum class Contact { free, sliding, resting, stuck };
  // An edge of the band, with the firings on either side of it.
  struct Edge {
    double level_rad;
    SwitchingSide lower, upper;
    int event_mode;
  };

  // 1 and 2: what happens at an instant.
  void begin(SampleSink& sink);
  void timers(SampleSink& sink);
  void decide(SampleSink& sink);
  void decide_sampled(SampleSink& sink);
  void decide_continuous(SampleSink& sink);
  void decide_ideal(SampleSink& sink);
  void command(int u, SampleSink& sink);
  void fire(int u, SampleSink& sink);
  void throttle(double part, SampleSink& sink);
  void enter_box(bool inside, SampleSink& sink);
  // Edges, friction.
  Edge edge_between(SwitchingSide one, SwitchingSide other) const;
  void settle_on(const Edge& edge, SampleSink& sink);
  void hold(Contact contact, SampleSink& sink);
  void let_go(SampleSink& sink);
  void find_sense(SampleSink& sink);
  bool accumulates(Reason ended, const SideCrossing& crossing, SampleSink& sink);
  std::optional<SideCrossing> next_crossing(Reason ended) const;
  double rest_rounding_rad_s(Reason ended) const;
  std::pair<double, double> supply(Contact contact) const;
  // 3: how far the arc goes.
  void open_step(SampleSink& sink) override;
  void look_for_timers();
  void open_free_arc(Reason ended, bool stops_at_rest, SampleSink& sink);
  void open_held_arc();
  void close_step() override;
  void look_for(Reason reason, double tau) { look_for_time(reason, t_s_ + tau); }
  void look_for_time(Reason reason, double at_s);
  // 4: what lies on the arc.
  AxisOnTimes on_times(double tau) const;
  AxisFiring firing_at(double tau) const;
  void fill_row(double t_s, std::span<double> state, std::span<double> thrusters) override;
  void finish(const char* reason, SampleSink& sink);

  bool is_sampled() const { return spec_->evaluation == Evaluation::sampled; }
  bool is_ideal() const { return spec_->evaluation == Evaluation::ideal; }
  bool is_held() const { return contact_ != Contact::free; }
  bool is_holding() const { return commanded_ != 0 && t_s_ < hold_until_s_ - hold_rounding_s_; }
  double resolution_s() const { return 64 * kEpsilon * t_s_; }
  AxisMotion motion(double tau) const {
    if (!is_held()) return dynamics_.at(arc_, tau);
    const HubPath& path = held_.path();
    return {path.angle_at(tau), path.rate_at(tau), path.acceleration_at(tau)};
  }
  double angle() const { return is_held() ? held_.path().angle_rad : dynamics_.begin(arc_).angle_rad; }
  double rate() const { return is_held() ? held_.path().rate_rad_s : dynamics_.begin(arc_).rate_rad_s; }
  double thrust(int u) const { return spec_->actuator.torque_N_m * u; }
  double thrust_now() const { return thrust(u_) * share_; }
  double friction() const { return spec_->disturbances.friction_N_m; }
  bool is_in_end_box() const { return law_.in_end_box(angle(), rate()); }
  SwitchingSide side_now() const { return law_.side(law_.value(angle(), rate()), side_); }
  void digest_state() override;

  const std::shared_ptr<const OnOffAxisSpecification> spec_;  // shared with copies, and with the dynamics
  Dynamics dynamics_;
  const int direction_;
  const SwitchingFunction law_;
  const double hold_rounding_s_;
  const std::shared_ptr<const std::vector<HeldCommand>> program_;  ///< shaped where it is to be

  // The state x: the beginning of the arc, or of the path the hub is held on.
  typename Dynamics::Arc arc_;
  ConstrainedArc held_;

  // The mode m.
  int commanded_ = 0;
  int u_ = 0;
  double share_ = 1;  ///< of the full thrust while they fire; less than 1 in a shaped program only
  SwitchingDelay valve_;
  bool in_box_ = false;
  double hold_until_s_ = 0;
  SwitchingSide side_ = SwitchingSide::inside;
  bool on_edge_ = false;        ///< side_ was just entered through the end of the band
  bool side_is_known_ = false;  ///< otherwise it is judged by the value of s
  std::int64_t next_sample_ = 0;
  std::size_t next_firing_ = 0;
  std::size_t next_disturbance_ = 0;
  double constant_N_m_ = 0;  ///< of the disturbances
  Contact contact_ = Contact::free;
  Edge edge_{};
  int sense_ = 0;  ///< of the motion that friction is against; 0: not moving

  // The step that is open: its arc runs from t_s_ to end_s_.
  Reason reason_ = Reason::duration;
  SwitchingSide entered_ = SwitchingSide::inside;
  int excess_ = 0;
  int cascade_ = 0;

  AxisMetrics metrics_;
  AxisOnTimes on_;
};

template <typename Dynamics>
OnOffAxisRun<Dynamics>::OnOffAxisRun(const OnOffAxisSpecification& specification)
    : spec_(std::make_shared<const OnOffAxisSpecification>(specification)),
      dynamics_(*spec_),
      direction_(slew_direction(specification.maneuver)),
      law_(specification.law, specification.maneuver.final_angle_rad, direction_),
      hold_rounding_s_(is_sampled() ? 1e-9 * specification.sample_period_s : 0),
      program_(std::make_shared<const std::vector<HeldCommand>>(commanded_torque(specification))),
      arc_(dynamics_.start()),
      held_(spec_->plant, spec_->disturbances.sinusoids),
      constant_N_m_(specification.disturbances.constant_N_m),
      metrics_(specification, direction_) {
  assert(spec_->evaluation != Evaluation::continuous || spec_->actuator.minimum_on_time_s > 0 ||
         spec_->actuator.switching_delay_s > 0 || law_.has_hysteresis());
  report_.propagator.name = spec_->plant.modes.empty() && spec_->disturbances.sinusoids.empty()
                                ? "closed_form_arcs"
                                : "closed_form_modes";
  lay_out(axis_channels(dynamics_.modes()), spec_->telemetry_period_s, spec_->output_times_s);
  digest_state();
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::digest_state() {
  digester_.real(t_s_);
  digester_.real(angle());
  digester_.real(rate());
  is_held() ? dynamics_.digest(held_, digester_) : dynamics_.digest(arc_, digester_);
}

// ---- 1 and 2: timers that are due, guards that hold

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::command(int u, SampleSink& sink) {
  if (u == commanded_) return;
  commanded_ = u;
  if (u != 0) hold_until_s_ = t_s_ + spec_->actuator.minimum_on_time_s;
  const double delay_s = spec_->actuator.switching_delay_s;
  if (delay_s == 0) return fire(u, sink);
  if (valve_.is_full()) {
    report_.failure = RunFailure{"valve_overrun", "more than 64 commands within the switching delay"};
    status_ = RunStatus::failed;
    return;
  }
  valve_.send(t_s_ + delay_s, u);
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::fire(int u, SampleSink& sink) {
  if (u == u_) return;
  metrics_.firing(t_s_, u_, u);
  u_ = u;
  note(kThrusterEvent, u, sink);
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::throttle(double part, SampleSink& sink) {
  const int u = part > 0 ? 1 : part < 0 ? -1 : 0;
  const double share = u == 0 ? 1 : std::abs(part);
  if (u == u_ && share == share_) return;
  metrics_.firing(t_s_, u_, u);
  commanded_ = u_ = u;
  share_ = share;
  note(kThrusterEvent, u, sink);
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::enter_box(bool inside, SampleSink& sink) {
  if (inside == in_box_) return;
  in_box_ = inside;
  metrics_.end_box(t_s_, inside);
  note(kEndBoxEvent, inside ? 1 : 0, sink);
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::begin(SampleSink& sink) {
  if (!is_sampled()) enter_box(is_in_end_box(), sink);
  if (friction() > 0) sense_ = rate() > 0 ? 1 : rate() < 0 ? -1 : 0;
}

// In this order: what is on its way through the valves, disturbances, the program.
template <typename Dynamics>
void OnOffAxisRun<Dynamics>::timers(SampleSink& sink) {
  while (!valve_.is_idle() && valve_.next_s() <= t_s_) fire(valve_.arrive(), sink);
  const auto& steps = spec_->disturbances.steps;
  while (next_disturbance_ < steps.size() && steps[next_disturbance_].from_s <= t_s_)
    constant_N_m_ += steps[next_disturbance_++].torque_N_m;
  const auto& program = *program_;
  while (next_firing_ < program.size() && program[next_firing_].to_s <= t_s_) ++next_firing_;
  if (spec_->evaluation == Evaluation::program) {
    const bool is_on = next_firing_ < program.size() && program[next_firing_].from_s <= t_s_;
    const double part = is_on ? program[next_firing_].value : 0;
    spec_->impulses.empty() ? command(static_cast<int>(part), sink) : throttle(part, sink);
  }
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::decide(SampleSink& sink) {
  switch (spec_->evaluation) {
    case Evaluation::sampled:
      return decide_sampled(sink);
    case Evaluation::continuous:
      return decide_continuous(sink);
    case Evaluation::ideal:
      return decide_ideal(sink);
    case Evaluation::program:
      return;
  }
}

// Sampled: at t = kT the law reads the exact state, first the end box, then the band, and holds until (k+1)T.
template <typename Dynamics>
void OnOffAxisRun<Dynamics>::decide_sampled(SampleSink& sink) {
  if (t_s_ < static_cast<double>(next_sample_) * spec_->sample_period_s) return;
  ++next_sample_;
  enter_box(is_in_end_box(), sink);
  if (in_box_) {
    side_ = SwitchingSide::inside;
    command(0, sink);
  } else if (!is_holding()) {
    side_ = side_now();
    command(SwitchingFunction::demand(side_), sink);
  }
}

// Continuous: a firing is held for its minimum on-time, unless the end box ends the run; then the box
// decides, and then the side of the band. Were the box stronger than the hold, a disturbance would bring
// about infinitely many firings at its edge.
template <typename Dynamics>
void OnOffAxisRun<Dynamics>::decide_continuous(SampleSink& sink) {
  if (reason_ == Reason::box) enter_box(!in_box_, sink);
  if (in_box_ && (spec_->stop == StopCondition::end_box || !is_holding())) {
    side_is_known_ = false;
    side_ = SwitchingSide::inside;
    return command(0, sink);
  }
  if (is_holding()) return;
  if (!side_is_known_) {
    side_ = side_now();
    side_is_known_ = true;
    on_edge_ = false;
  }
  int demand = SwitchingFunction::demand(side_);
  if (on_edge_ && demand == 0 && commanded_ != 0 && spec_->actuator.minimum_on_time_s > 0 &&
      !law_.has_hysteresis() && !is_held()) {
    // Coming off a firing onto the end of the band: where coasting would lead straight back out, both sides
    // point at the edge. The minimum on-time is the regularisation: the firing goes on for one more of it.
    dynamics_.push(arc_, constant_N_m_ - friction() * sense_);
    const int motion = side_motion(arc_, law_);
    const bool from_above = commanded_ < 0;
    if ((from_above && motion > 0) || (!from_above && motion < 0)) {
      demand = commanded_;
      hold_until_s_ = t_s_ + spec_->actuator.minimum_on_time_s;
      side_is_known_ = false;
    }
  }
  on_edge_ = false;
  command(demand, sink);
  if (is_holding()) side_is_known_ = false;
}

// The ideal law: off the edges of the band as everywhere; on an edge, settle_on() tells.
template <typename Dynamics>
void OnOffAxisRun<Dynamics>::decide_ideal(SampleSink& sink) {
  if (reason_ == Reason::box) enter_box(!in_box_, sink);
  if (in_box_) {
    if (contact_ == Contact::sliding || contact_ == Contact::resting) let_go(sink);
    side_is_known_ = on_edge_ = false;
    side_ = SwitchingSide::inside;
    return command(0, sink);
  }
  if (contact_ == Contact::sliding || contact_ == Contact::resting) {
    if (reason_ == Reason::excess) {
      // What is missing comes from the side that supplies it.
      side_ = excess_ > 0 ? edge_.lower : edge_.upper;
      side_is_known_ = true;
      let_go(sink);
      return command(SwitchingFunction::demand(side_), sink);
    }
    return settle_on(edge_, sink);
  }
  if (!side_is_known_) {
    const double s = law_.value(angle(), rate());
    side_ = law_.side(s);
    side_is_known_ = true;
    if (s == law_.upper_rad())
      return settle_on(edge_between(SwitchingSide::above, law_.beyond_above()), sink);
    if (s == law_.lower_rad())
      return settle_on(edge_between(SwitchingSide::below, law_.beyond_below()), sink);
  } else if (on_edge_) {
    on_edge_ = false;
    return settle_on(edge_, sink);
  }
  command(SwitchingFunction::demand(side_), sink);
}

// ---- edges and friction: when is the hub held on a path?

template <typename Dynamics>
typename OnOffAxisRun<Dynamics>::Edge OnOffAxisRun<Dynamics>::edge_between(SwitchingSide one,
                                                                           SwitchingSide other) const {
  if (law_.is_a_line()) return {law_.upper_rad(), SwitchingSide::below, SwitchingSide::above, 1};
  if (one == SwitchingSide::above || other == SwitchingSide::above)
    return {law_.upper_rad(), SwitchingSide::inside, SwitchingSide::above, 1};
  return {law_.lower_rad(), SwitchingSide::below, SwitchingSide::inside, -1};
}

// With ds/dt = omega + (tau + 2 k |omega|) alpha, s stands still under one acceleration only (Filippov's
// equivalent control). If the torque that it takes lies between those of the two sides, both point at the
// edge and the thrusters chatter along it; otherwise the motion goes through, to the side whose torque is the
// nearer. A hub that is at rest on the edge stays so if thrusters and friction can hold it.
template <typename Dynamics>
void OnOffAxisRun<Dynamics>::settle_on(const Edge& edge, SampleSink& sink) {
  const double rate_rad_s = reason_ == Reason::rest ? 0.0 : rate();
  const bool is_rest = rate_rad_s == 0;
  HubPath path{angle(), rate_rad_s, 0, 0};
  if (!is_rest && law_.rate_gain() > 0)
    path.decay_s = law_.rate_gain();
  else if (!is_rest)
    path.acceleration_rad_s2 = -std::copysign(0.5 / law_.curvature(), rate_rad_s);
  if (is_held())
    held_.turn_into(path);
  else
    dynamics_.hold(arc_, path, held_);
  edge_ = edge;
  if (friction() > 0) sense_ = rate_rad_s > 0 ? 1 : rate_rad_s < 0 ? -1 : 0;
  const auto [least, most] = supply(is_rest ? Contact::resting : Contact::sliding);
  const double required = held_.required_torque_at(0);
  side_is_known_ = true;
  if (is_rest ? required >= least && required <= most : required > least && required < most)
    return hold(is_rest ? Contact::resting : Contact::sliding, sink);
  side_ = required >= most ? edge.lower : edge.upper;
  if (is_held()) let_go(sink);
  command(SwitchingFunction::demand(side_), sink);
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::hold(Contact contact, SampleSink& sink) {
  const Contact before = contact_;
  contact_ = contact;
  if (before == contact) return;
  if (before == Contact::sliding) note(kSlidingEvent, 0, sink);
  if (contact == Contact::stuck) return note(kRestEvent, 1, sink);
  // The thrusters are neither on nor off.
  commanded_ = 0;
  if (u_ != 0) fire(0, sink);
  metrics_.chatter(t_s_, SwitchingFunction::demand(edge_.upper), SwitchingFunction::demand(edge_.lower),
                   contact == Contact::resting);
  contact == Contact::sliding ? note(kSlidingEvent, edge_.event_mode, sink) : note(kRestEvent, 1, sink);
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::let_go(SampleSink& sink) {
  dynamics_.let_go(held_, arc_);
  const Contact before = contact_;
  contact_ = Contact::free;
  metrics_.no_chatter();
  note(before == Contact::sliding ? kSlidingEvent : kRestEvent, 0, sink);
}

// At a standstill friction takes what it can; beyond, the hub moves the way it is pushed.
template <typename Dynamics>
void OnOffAxisRun<Dynamics>::find_sense(SampleSink& sink) {
  const bool was_stuck = contact_ == Contact::stuck;
  const HubPath still{angle(), 0, 0, 0};
  sense_ = 0;
  if (was_stuck)
    held_.turn_into(still);
  else
    dynamics_.hold(arc_, still, held_);
  const auto [least, most] = supply(Contact::stuck);
  const double required = held_.required_torque_at(0);
  if (was_stuck && reason_ == Reason::excess)
    sense_ = -excess_;
  else if (required > most)
    sense_ = -1;
  else if (required < least)
    sense_ = 1;
  else
    return hold(Contact::stuck, sink);
  if (was_stuck) return let_go(sink);
  dynamics_.let_go(held_, arc_);
}

// An ideal law lets go where s stands still: for a while rounding is all that s does, and it may well point
// back at the edge. So it may, for an instant, where s goes through.
template <typename Dynamics>
std::optional<SideCrossing> OnOffAxisRun<Dynamics>::next_crossing(Reason ended) const {
  const double h = end_s_ - t_s_;
  const bool was_held = is_ideal() && (ended == Reason::excess || ended == Reason::rest);
  if (!was_held) {
    const auto crossing = side_crossing(arc_, law_, side_, h);
    const bool goes_through = is_ideal() && ended == Reason::side;
    if (!goes_through || !crossing || crossing->tau > kInstant_s) return crossing;
  }
  const double scale_rad = std::abs(angle()) + std::abs(law_.final_angle_rad()) +
                           (law_.rate_gain() + law_.curvature() * std::abs(rate())) * std::abs(rate());
  const double off_rad = std::abs(law_.value(angle(), rate()) - edge_.level_rad);
  return side_crossing(arc_, law_, side_, h, off_rad + kRounding * scale_rad);
}

// What friction lets go begins at rest, to rounding of either sign.
template <typename Dynamics>
double OnOffAxisRun<Dynamics>::rest_rounding_rad_s(Reason ended) const {
  if (ended != Reason::excess && ended != Reason::turn) return 0;
  return std::max(std::numeric_limits<double>::min(),
                  std::abs(rate()) + kRounding * metrics_.peak_rate_rad_s());
}

// Arcs that shrink without end: the next one is shorter than 1 ns, or than the rounding of angles resolves,
// and at rest the thrusters can hold it.
template <typename Dynamics>
bool OnOffAxisRun<Dynamics>::accumulates(Reason ended, const SideCrossing& crossing, SampleSink& sink) {
  const double strongest = thrust(1) / residual_inertia_kg_m2(spec_->plant);
  const double angle_rad = std::max(std::abs(angle()), std::abs(law_.final_angle_rad()));
  const double shortest_s = std::max(kAccumulated_s, 4 * std::sqrt(kEpsilon * angle_rad / strongest));
  if (ended != Reason::side || crossing.tau >= shortest_s || std::abs(rate()) > 4 * shortest_s * strongest)
    return false;
  edge_ = edge_between(side_, crossing.entered);
  dynamics_.hold(arc_, HubPath{angle(), 0, 0, 0}, held_);
  const auto [least, most] = supply(Contact::resting);
  const double required = held_.required_torque_at(0);
  if (required < least || required > most) return false;
  // What is left of the rate, the arcs left out would take away.
  const double impulse_s = -rate() * spec_->plant.inertia_kg_m2 / thrust(1);
  const AxisOnTimes on{std::max(0.0, impulse_s), std::max(0.0, -impulse_s)};
  on_.positive_s += on.positive_s;
  on_.negative_s += on.negative_s;
  metrics_.impulse(on);
  hold(Contact::resting, sink);
  note(kAccumulatedEvent, 1, sink);
  return true;
}

// The torques that thrusters, friction and constant disturbances can supply together while the hub is held.
template <typename Dynamics>
std::pair<double, double> OnOffAxisRun<Dynamics>::supply(Contact contact) const {
  const double given = constant_N_m_ - friction() * sense_;
  if (contact == Contact::stuck)
    return {given + thrust_now() - friction(), given + thrust_now() + friction()};
  const double slack = contact == Contact::resting ? friction() : 0;
  return {given + thrust(SwitchingFunction::demand(edge_.upper)) - slack,
          given + thrust(SwitchingFunction::demand(edge_.lower)) + slack};
}

// ---- 3: the arc, to the nearest of next timer, first guard crossing, stop

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::look_for_time(Reason reason, double at_s) {
  if (at_s >= end_s_) return;
  end_s_ = at_s;
  reason_ = reason;
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::open_step(SampleSink& sink) {
  if (t_s_ == 0 && report_.propagator.steps == 0) begin(sink);
  if (t_s_ >= spec_->duration_s) return finish("duration", sink);
  timers(sink);
  decide(sink);
  if (status_ == RunStatus::failed) return;
  if (friction() > 0 &&
      (contact_ == Contact::stuck || (contact_ == Contact::free && sense_ == 0) || reason_ == Reason::turn))
    find_sense(sink);
  if (spec_->stop == StopCondition::end_box && in_box_) return finish("end_box", sink);
  const bool stops_at_rest = spec_->stop == StopCondition::first_rest && metrics_.braking_has_begun();
  if (stops_at_rest && (reason_ == Reason::rest || metrics_.is_at_rest(rate()))) {
    metrics_.first_rest(t_s_, angle());
    return finish("first_rest", sink);
  }
  const Reason ended = reason_;
  end_s_ = spec_->duration_s;
  reason_ = Reason::duration;
  look_for_timers();
  if (!is_held()) open_free_arc(ended, stops_at_rest, sink);
  if (is_held()) open_held_arc();
  step_is_open_ = true;
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::look_for_timers() {
  if (is_sampled()) look_for_time(Reason::sample, static_cast<double>(next_sample_) * spec_->sample_period_s);
  if (spec_->evaluation == Evaluation::continuous && is_holding())
    look_for_time(Reason::hold_over, hold_until_s_);
  if (!valve_.is_idle()) look_for_time(Reason::valve, valve_.next_s());
  const auto& steps = spec_->disturbances.steps;
  if (next_disturbance_ < steps.size()) look_for_time(Reason::disturbance, steps[next_disturbance_].from_s);
  const auto& program = *program_;
  if (next_firing_ < program.size()) {
    const HeldCommand& firing = program[next_firing_];
    look_for_time(Reason::program, firing.from_s > t_s_ ? firing.from_s : firing.to_s);
  }
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::open_free_arc(Reason ended, bool stops_at_rest, SampleSink& sink) {
  dynamics_.push(arc_, thrust_now() + constant_N_m_ - friction() * sense_);
  if (spec_->evaluation == Evaluation::continuous || is_ideal()) {
    if (!in_box_ && !is_holding())
      if (const auto crossing = next_crossing(ended)) {
        if (is_ideal() && accumulates(ended, *crossing, sink)) return;
        entered_ = crossing->entered;
        look_for(Reason::side, crossing->tau);
      }
    if (law_.end_box())
      if (const auto tau = box_crossing(arc_, *law_.end_box(), law_.final_angle_rad(), in_box_, end_s_ - t_s_,
                                        resolution_s()))
        look_for(Reason::box, *tau);
  }
  // A rest at the very end of the step counts before what else happens there.
  const auto look_for_rest = [&](Reason reason, std::optional<double> tau) {
    if (!tau) return;
    look_for(reason, *tau);
    if (t_s_ + *tau >= end_s_) reason_ = reason;
  };
  if (stops_at_rest)
    look_for_rest(Reason::rest, dynamics_.rest(arc_, end_s_ - t_s_));
  else if (sense_ != 0)
    look_for_rest(Reason::turn, dynamics_.turn(arc_, sense_, rest_rounding_rad_s(ended), end_s_ - t_s_));
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::open_held_arc() {
  const HubPath& path = held_.path();
  if (law_.end_box() && !is_sampled())
    if (const auto tau = box_crossing(path, *law_.end_box(), law_.final_angle_rad(), in_box_, end_s_ - t_s_,
                                      resolution_s()))
      look_for(Reason::box, *tau);
  const auto [least, most] = supply(contact_);
  if (const auto excess = held_.leaves(least, most, end_s_ - t_s_)) {
    excess_ = excess->end;
    look_for(Reason::excess, excess->tau);
  }
  if (const auto tau = rest_time(path, end_s_ - t_s_)) {
    look_for(Reason::rest, *tau);
    if (t_s_ + *tau >= end_s_) reason_ = Reason::rest;
  }
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::close_step() {
  const double h = end_s_ - t_s_;
  if (h > 0) {
    const AxisOnTimes on = on_times(h);
    if (is_held()) {
      const HubPath path = held_.path();
      metrics_.arc(t_s_, PathPiece(path, h), on, h);
      if (contact_ == Contact::sliding) metrics_.slid(h);
      held_.move(h);
    } else {
      dynamics_.make_ready(arc_, h);
      dynamics_.each_piece(arc_, h, [&](double from, double length, const auto& piece) {
        const double share = length / h;
        metrics_.arc(t_s_ + from, piece, {share * on.positive_s, share * on.negative_s}, length);
      });
      dynamics_.move(arc_, h);
    }
    // Throttled, they take less effort than pulsed by the same impulse.
    if (share_ < 1) metrics_.thrust(0, thrust_now() * thrust_now() * (1 - 1 / share_) * h);
    on_.positive_s += on.positive_s;
    on_.negative_s += on.negative_s;
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
    edge_ = edge_between(side_, entered_);
    side_ = entered_;
    side_is_known_ = on_edge_ = true;
  }
}

// How long either thruster is on in [t, t + tau], a part of its thrust counting as a part of the time. While
// they chatter along a line both are, by turns; on an edge only the one outside; at rest only as far as
// something has to be held.
template <typename Dynamics>
AxisOnTimes OnOffAxisRun<Dynamics>::on_times(double tau) const {
  if (contact_ == Contact::free || contact_ == Contact::stuck)
    return {u_ > 0 ? share_ * tau : 0, u_ < 0 ? share_ * tau : 0};
  const double impulse = held_.required_impulse(tau) - (constant_N_m_ - friction() * sense_) * tau;
  double net_s = impulse / thrust(1);
  if (contact_ == Contact::resting) {
    const double by_friction_s = friction() * tau / thrust(1);
    net_s = std::copysign(std::max(0.0, std::abs(net_s) - by_friction_s), net_s);
    return {std::max(0.0, net_s), std::max(0.0, -net_s)};
  }
  if (law_.is_a_line()) return {0.5 * (tau + net_s), 0.5 * (tau - net_s)};
  return {std::max(0.0, net_s), std::max(0.0, -net_s)};
}

// ---- 4: samples on the open arc
// --------------------------------------------------------------------------------

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::fill_row(double t_s, std::span<double> state, std::span<double> thrusters) {
  const double tau = t_s - t_s_;
  const AxisOnTimes since = on_times(tau);
  const AxisMotion now = motion(tau);
  fill_axis_row(law_, now.angle_rad, now.rate_rad_s, firing_at(tau),
                {on_.positive_s + since.positive_s, on_.negative_s + since.negative_s}, state, thrusters);
  const auto elastic = state.subspan(kAxisStateChannels);
  is_held() ? dynamics_.elastic_row(held_, tau, elastic) : dynamics_.elastic_row(arc_, tau, elastic);
}

template <typename Dynamics>
AxisFiring OnOffAxisRun<Dynamics>::firing_at(double tau) const {
  if (contact_ == Contact::free || contact_ == Contact::stuck)
    return {thrust_now(), u_ > 0 ? share_ : 0.0, u_ < 0 ? share_ : 0.0};
  double torque = held_.required_torque_at(tau) - (constant_N_m_ - friction() * sense_);
  if (contact_ == Contact::resting)
    torque = std::copysign(std::max(0.0, std::abs(torque) - friction()), torque);
  const double net = torque / thrust(1);
  if (contact_ == Contact::sliding && law_.is_a_line()) return {torque, 0.5 * (1 + net), 0.5 * (1 - net)};
  return {torque, std::max(0.0, net), std::max(0.0, -net)};
}

template <typename Dynamics>
void OnOffAxisRun<Dynamics>::finish(const char* reason, SampleSink& sink) {
  if (spec_->stop == StopCondition::end_box && in_box_) fire(0, sink);
  if (!is_held()) dynamics_.push(arc_, thrust_now() + constant_N_m_ - friction() * sense_);
  SteppedRun::finish(reason, sink);
}

template <typename Dynamics>
RunReport OnOffAxisRun<Dynamics>::report() const {
  RunReport report = report_;
  report.metrics = metrics_.finish(t_s_, angle(), rate());
  if (!is_held()) report.metrics.vibration = dynamics_.vibration(arc_);
  // A copy, since a row needs room to be made in.
  OnOffAxisRun copy = *this;
  std::vector<double> state(channels().state.size()), thrusters(channels().thrusters.size());
  copy.fill_row(t_s_, state, thrusters);
  report.metrics.final_state = std::move(state);
  report.digest = digester_.digest();
  return report;
}

}  // namespace

std::unique_ptr<Run> make_on_off_axis_run(const OnOffAxisSpecification& specification) {
  if (specification.plant.modes.empty() && specification.disturbances.sinusoids.empty())
    return std::make_unique<OnOffAxisRun<RigidDynamics>>(specification);
  return std::make_unique<OnOffAxisRun<FlexibleDynamics>>(specification);
}

}  // namespace slew
