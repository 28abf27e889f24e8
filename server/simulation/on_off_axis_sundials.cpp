// The second opinion on a single-axis slew: ARKODE's explicit Runge-Kutta with its own root finding. Shares
// the plant's right-hand side with the first one and nothing else: the law, the guards and the metrics are
// written again here, from the paper.
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <utility>

#include "server/propagation/erk_solver.hpp"
#include "server/simulation/axis.hpp"
#include "server/simulation/axis_channels.hpp"
#include "server/simulation/digest.hpp"

namespace slew {
namespace {

// The order of the root functions.
enum Root {
  kBandLower,
  kBandUpper,
  kBoxLeft,
  kBoxRight,
  kBoxSlow,
  kBoxFast,
  kRest,
  kLeast,
  kMost,
  kRootCount
};

// Who holds the hub: nobody; an ideal law on an edge of its band, moving or at rest; friction.
enum class Hold { free, sliding, resting, stuck };

// Switchings of an ideal law nearer to each other than this are not told apart: they have accumulated.
constexpr double kTogether_s = 1e-5;
constexpr double kHoldRounding = 1e-9;
// Edges of a shaped program nearer to each other than this are one.
constexpr double kEdge_s = 1e-10;

class SundialsOnOffRun final : public Run {
 public:
  explicit SundialsOnOffRun(const OnOffAxisSpecification& specification);

  const ChannelTable& channels() const override { return channels_; }
  const std::vector<std::string>& event_channels() const override { return axis_event_channels(); }
  RunStatus advance(double until_s, std::int64_t max_steps, SampleSink& sink) override;
  double t_s() const override { return t_s_; }
  double duration_s() const override { return spec_.duration_s; }
  RunReport report() const override;
  std::unique_ptr<Run> clone() const override {
    throw std::logic_error("a verification is flown once, from its beginning");
  }

 private:
  static int right_hand_side(sunrealtype t, N_Vector state, N_Vector slope, void* self);
  static int root_functions(sunrealtype t, N_Vector state, sunrealtype* values, void* self);

  double angle() const { return NV_Ith_S(solver_.state, 0); }
  double rate() const { return NV_Ith_S(solver_.state, 1); }
  double s_of(double angle_rad, double rate_rad_s) const;
  double constant_torque() const;
  double sinusoidal_torque(double t_s) const;
  bool is_sampled() const { return spec_.evaluation == Evaluation::sampled; }
  bool is_at_sample() const {
    return is_sampled() && t_s_ >= static_cast<double>(sample_) * spec_.sample_period_s;
  }
  // Where the band is left upwards and downwards from the side it is on.
  double upper_guard() const { return upper_rad_ + half_ - (side_ > 0 ? spec_.law.hysteresis_rad : 0); }
  double lower_guard() const { return lower_rad_ - half_ + (side_ < 0 ? spec_.law.hysteresis_rad : 0); }
  double next_timer() const;
  void timers();
  double programmed(double t_s) const;
  void throttle(double part);
  void order(int u);
  int wanted(double s_rad) const;
  int side_ahead() const;
  void decide();
  double acceleration(double torque_N_m) const;
  double unheld_torque(double t_s) const;
  double wanted_acceleration(double rate_rad_s) const;
  double holding_torque(double t_s, std::span<const double> state) const;
  std::pair<double, double> holding_range(Hold hold) const;
  bool can_hold(Hold hold);
  void hold(Hold hold);
  void decide_ideal();
  void rub();
  bool leads_into_box() const;
  void fire(int u);
  void switch_to(int u);
  void see_box(bool inside);
  void note(std::uint32_t channel, int mode);
  void fly_to(double stop_s);
  void meet(const std::array<int, kRootCount>& found);
  void finish(const char* reason);

  const OnOffAxisSpecification spec_;
  const ChannelTable channels_;
  const int direction_;
  double lower_rad_ = 0, upper_rad_ = 0;
  double half_ = 0;  ///< of the hysteresis, of a law without a band
  ErkSolver solver_;
  double longest_step_s_ = 0;

  double t_s_ = 0;
  int ordered_ = 0;
  int u_ = 0;
  double share_ = 1;                              ///< of the thrust, while they fire
  std::deque<std::pair<double, int>> under_way_;  ///< orders that wait for the valves
  bool in_box_ = false;
  bool is_fresh_ = true;  ///< the torque or a guard changed, or nothing has been flown yet
  double hold_until_s_ = 0;
  int side_ = 0;  ///< of the band: -1 below, 0 inside, +1 above; followed by root directions
  std::int64_t sample_ = 0;
  Hold hold_ = Hold::free;
  int edge_ = 1;          ///< of the band, on which an ideal law holds or may hold: +1 the upper one
  bool at_edge_ = false;  ///< just arrived there
  int excess_ = 0;        ///< what held gave way, downwards or upwards
  double last_edge_s_ = -1;
  int sense_ = 0;  ///< of the motion that friction is against
  bool has_braked_ = false;
  bool is_over_ = false;

  RunReport report_;
  Digester digester_;
  Metrics metrics_;
};

SundialsOnOffRun::SundialsOnOffRun(const OnOffAxisSpecification& specification)
    : spec_(specification),
      channels_(axis_channels(specification.plant.modes.size())),
      direction_(slew_direction(specification.maneuver)) {
  const double epsilon = spec_.law.deadband_rad;
  if (spec_.law.deadband == Deadband::double_sided ||
      (spec_.law.deadband == Deadband::single_sided && direction_ > 0))
    lower_rad_ = -epsilon;
  if (spec_.law.deadband == Deadband::double_sided ||
      (spec_.law.deadband == Deadband::single_sided && direction_ < 0))
    upper_rad_ = epsilon;
  if (spec_.law.deadband == Deadband::none) half_ = 0.5 * spec_.law.hysteresis_rad;

  solver_.state = N_VNew_Serial(static_cast<sunindextype>(2 + 2 * spec_.plant.modes.size()), solver_.context);
  if (!solver_.state) throw std::bad_alloc();
  N_VConst(0, solver_.state);
  NV_Ith_S(solver_.state, 0) = spec_.maneuver.initial_angle_rad;
  NV_Ith_S(solver_.state, 1) = spec_.maneuver.initial_rate_rad_s;
  solver_.memory = ERKStepCreate(&right_hand_side, 0.0, solver_.state, solver_.context);
  if (!solver_.memory) throw std::bad_alloc();
  check_sundials(ERKStepSetUserData(solver_.memory, this), "ERKStepSetUserData");
  check_sundials(ERKStepSetErrFile(solver_.memory, nullptr),
                 "ERKStepSetErrFile");  // check() throws what it would print
  // A low order keeps full precision at roots, where the dense output is a Hermite interpolant.
  check_sundials(ERKStepSetTableNum(solver_.memory, ARKODE_DORMAND_PRINCE_7_4_5), "ERKStepSetTableNum");
  const double tolerance = spec_.verification_tolerance;
  check_sundials(ERKStepSStolerances(solver_.memory, tolerance, tolerance * 1e-3), "ERKStepSStolerances");
  check_sundials(ERKStepRootInit(solver_.memory, kRootCount, &root_functions), "ERKStepRootInit");
  check_sundials(ERKStepSetNoInactiveRootWarn(solver_.memory), "ERKStepSetNoInactiveRootWarn");
  check_sundials(ERKStepSetMaxNumSteps(solver_.memory, 1000000), "ERKStepSetMaxNumSteps");
  // Two crossings within one step would show no change of sign.
  const double acceleration = spec_.actuator.torque_N_m / spec_.plant.inertia_kg_m2;
  const double slew = std::abs(spec_.maneuver.final_angle_rad - spec_.maneuver.initial_angle_rad);
  const double rate = std::abs(spec_.maneuver.initial_rate_rad_s);
  const double scale_rad = std::max({slew, rate * rate / acceleration, spec_.law.rate_gain_s * rate,
                                     spec_.law.deadband_rad, spec_.law.hysteresis_rad});
  double& longest_s = longest_step_s_;
  longest_s = scale_rad > 0 ? std::sqrt(scale_rad / acceleration) / 50 : spec_.duration_s / 50;
  for (const ElasticMode& mode : spec_.plant.modes) longest_s = std::min(longest_s, 1 / mode.frequency_rad_s);
  for (const Sinusoid& sinusoid : spec_.disturbances.sinusoids)
    longest_s = std::min(longest_s, 1 / sinusoid.frequency_rad_s);
  if (spec_.law.rate_gain_s > 0) longest_s = std::min(longest_s, spec_.law.rate_gain_s / 10);
  check_sundials(ERKStepSetMaxStep(solver_.memory, longest_s), "ERKStepSetMaxStep");
  report_.propagator.name = "sundials_erkstep_dormand_prince";
  metrics_.thruster_on_time_s.per_thruster.assign(2, 0);
  metrics_.firings.per_thruster.assign(2, 0);
}

double SundialsOnOffRun::constant_torque() const {
  double torque = spec_.disturbances.constant_N_m;
  for (const StepDisturbance& step : spec_.disturbances.steps)
    if (t_s_ >= step.from_s) torque += step.torque_N_m;
  return torque;
}

double SundialsOnOffRun::sinusoidal_torque(double t_s) const {
  double torque = 0;
  for (const Sinusoid& one : spec_.disturbances.sinusoids)
    torque += one.amplitude_N_m * std::sin(one.frequency_rad_s * t_s + one.phase_rad);
  return torque;
}

double SundialsOnOffRun::unheld_torque(double t_s) const {
  return constant_torque() + sinusoidal_torque(t_s) - spec_.disturbances.friction_N_m * sense_;
}

int SundialsOnOffRun::right_hand_side(sunrealtype t, N_Vector state, N_Vector slope, void* self) {
  const auto& run = *static_cast<const SundialsOnOffRun*>(self);
  const std::size_t size = 2 + 2 * run.spec_.plant.modes.size();
  const std::span<const double> x(NV_DATA_S(state), size);
  const double torque = run.hold_ == Hold::free
                            ? run.spec_.actuator.torque_N_m * run.u_ * run.share_ + run.unheld_torque(t)
                            : run.holding_torque(t, x) + run.unheld_torque(t);
  derivative<double>(run.spec_.plant, x, torque, std::span<double>(NV_DATA_S(slope), size));
  return 0;
}

// On an edge s stands still: 0 = omega + (tau + 2 k |omega|) alpha.
double SundialsOnOffRun::wanted_acceleration(double rate_rad_s) const {
  if (hold_ != Hold::sliding) return 0;
  const double k = spec_.law.gamma_bar * spec_.law.inertia_kg_m2 / (2 * spec_.law.torque_N_m);
  if (spec_.law.rate_gain_s == 0) return -std::copysign(0.5 / k, rate_rad_s);
  return -rate_rad_s / (spec_.law.rate_gain_s + 2 * k * std::abs(rate_rad_s));
}

// What thrusters (and friction, at rest) have to give: the acceleration is linear in it.
double SundialsOnOffRun::holding_torque(double t_s, std::span<const double> state) const {
  std::vector<double> slope(state.size());
  const double unheld = unheld_torque(t_s);
  derivative<double>(spec_.plant, state, unheld, slope);
  const double without = slope[1];
  derivative<double>(spec_.plant, state, unheld + 1, slope);
  return (wanted_acceleration(state[1]) - without) / (slope[1] - without);
}

std::pair<double, double> SundialsOnOffRun::holding_range(Hold hold) const {
  const double thrust = spec_.actuator.torque_N_m, friction = spec_.disturbances.friction_N_m;
  if (hold == Hold::stuck) return {thrust * u_ * share_ - friction, thrust * u_ * share_ + friction};
  const bool is_line = lower_rad_ == upper_rad_;
  // At rest the ends belong to the range: no thrust at all may be what holds it.
  const double slack = hold == Hold::resting ? friction + kHoldRounding * thrust : 0;
  return {(is_line || edge_ > 0 ? -thrust : 0) - slack, (is_line || edge_ < 0 ? thrust : 0) + slack};
}

double SundialsOnOffRun::s_of(double angle_rad, double rate_rad_s) const {
  const auto& law = spec_.law;
  return angle_rad - spec_.maneuver.final_angle_rad + law.rate_gain_s * rate_rad_s +
         law.gamma_bar * law.inertia_kg_m2 / (2 * law.torque_N_m) * rate_rad_s * std::abs(rate_rad_s);
}

int SundialsOnOffRun::root_functions(sunrealtype t, N_Vector state, sunrealtype* values, void* self) {
  const auto& run = *static_cast<const SundialsOnOffRun*>(self);
  const double angle_rad = NV_Ith_S(state, 0), rate_rad_s = NV_Ith_S(state, 1);
  const double s = run.s_of(angle_rad, rate_rad_s);
  const double error = angle_rad - run.spec_.maneuver.final_angle_rad;
  const EndBox box = run.spec_.law.end_box.value_or(EndBox{1, 1});
  // While held, the edges are not what ends it.
  const bool is_held = run.hold_ != Hold::free;
  values[kBandLower] = is_held ? 1 : s - run.lower_guard();
  values[kBandUpper] = is_held ? 1 : s - run.upper_guard();
  values[kBoxLeft] = error + box.angle_rad;
  values[kBoxRight] = error - box.angle_rad;
  values[kBoxSlow] = rate_rad_s + box.rate_rad_s;
  values[kBoxFast] = rate_rad_s - box.rate_rad_s;
  values[kRest] = run.hold_ == Hold::resting || run.hold_ == Hold::stuck ? 1 : rate_rad_s;
  values[kLeast] = values[kMost] = 1;
  if (!is_held) return 0;
  const std::size_t size = 2 + 2 * run.spec_.plant.modes.size();
  const double torque = run.holding_torque(t, std::span<const double>(NV_DATA_S(state), size));
  const auto [least, most] = run.holding_range(run.hold_);
  values[kLeast] = torque - least;
  values[kMost] = torque - most;
  return 0;
}

int SundialsOnOffRun::wanted(double s_rad) const {
  if (s_rad > upper_guard()) return -1;
  if (s_rad < lower_guard()) return 1;
  return half_ > 0 ? (s_rad >= 0 ? -1 : 1) : 0;
}

// Where s is, or, exactly on a guard, where it is going: a root function that begins at zero is passed over.
int SundialsOnOffRun::side_ahead() const {
  const double k = spec_.law.gamma_bar * spec_.law.inertia_kg_m2 / (2 * spec_.law.torque_N_m);
  const double slope = rate() + (spec_.law.rate_gain_s + 2 * k * std::abs(rate())) *
                                    acceleration(spec_.actuator.torque_N_m * u_);
  return -wanted(s_of(angle(), rate()) + 1e-12 * longest_step_s_ * slope);
}

void SundialsOnOffRun::note(std::uint32_t channel, int mode) {
  if (report_.events.size() < kReportedEvents) report_.events.push_back({t_s_, channel, mode});
  ++report_.events_total;
  ++report_.propagator.events;
  digester_.event({t_s_, channel, mode});
}

void SundialsOnOffRun::order(int u) {
  if (u == ordered_) return;
  ordered_ = u;
  if (u != 0) hold_until_s_ = t_s_ + spec_.actuator.minimum_on_time_s;
  if (spec_.actuator.switching_delay_s == 0) return fire(u);
  under_way_.emplace_back(t_s_ + spec_.actuator.switching_delay_s, u);
  is_fresh_ = true;  // the integrator may already be past the time at which it arrives
}

// What is due by the clock alone.
void SundialsOnOffRun::timers() {
  for (; !under_way_.empty() && under_way_.front().first <= t_s_; under_way_.pop_front())
    fire(under_way_.front().second);
  for (const StepDisturbance& step : spec_.disturbances.steps)
    if (step.from_s == t_s_) is_fresh_ = true;
  if (spec_.evaluation != Evaluation::program) return;
  spec_.impulses.empty() ? order(static_cast<int>(programmed(t_s_))) : throttle(programmed(t_s_ + kEdge_s));
}

// Every firing once for each impulse, as large as that is.
double SundialsOnOffRun::programmed(double t_s) const {
  double part = 0;
  const std::vector<Impulse> unshaped{{0, 1}};
  for (const Impulse& impulse : spec_.impulses.empty() ? unshaped : spec_.impulses)
    for (const ProgrammedFiring& firing : spec_.program)
      if (firing.from_s + impulse.time_s <= t_s && t_s < firing.to_s + impulse.time_s)
        part += impulse.amplitude * firing.direction;
  return part;
}

void SundialsOnOffRun::throttle(double part) {
  const int u = part > 0 ? 1 : part < 0 ? -1 : 0;
  if (u == u_ && (u == 0 || std::abs(part) == share_)) return;
  share_ = u == 0 ? 1 : std::abs(part);
  ordered_ = u;
  switch_to(u);
}

double SundialsOnOffRun::next_timer() const {
  double next_s = spec_.duration_s;
  const auto at = [&](double t_s) {
    if (t_s > t_s_) next_s = std::min(next_s, t_s);
  };
  if (is_sampled()) next_s = std::min(next_s, static_cast<double>(sample_) * spec_.sample_period_s);
  if (!under_way_.empty()) at(under_way_.front().first);
  for (const StepDisturbance& step : spec_.disturbances.steps) at(step.from_s);
  for (const ProgrammedFiring& firing : spec_.program) {
    if (spec_.impulses.empty()) {
      at(firing.from_s);
      at(firing.to_s);
    }
    for (const Impulse& impulse : spec_.impulses)
      for (const double edge_s : {firing.from_s, firing.to_s})
        if (edge_s + impulse.time_s > t_s_ + kEdge_s) at(edge_s + impulse.time_s);
  }
  return next_s;
}

void SundialsOnOffRun::fire(int u) {
  if (u != u_) switch_to(u);
}

void SundialsOnOffRun::switch_to(int u) {
  u_ = u;
  is_fresh_ = true;
  if (u == -direction_) has_braked_ = true;
  if (u != 0) {
    ++metrics_.firings.total;
    ++metrics_.firings.per_thruster[u > 0 ? 0 : 1];
  }
  note(kThrusterEvent, u);
}

void SundialsOnOffRun::see_box(bool inside) {
  if (inside == in_box_) return;
  in_box_ = inside;
  note(kEndBoxEvent, inside ? 1 : 0);
}

// At the present instant: what the law, the box and the hold make of the thrusters.
void SundialsOnOffRun::decide() {
  const double s = s_of(angle(), rate());
  const double rounding_s = is_sampled() ? 1e-9 * spec_.sample_period_s : 0;
  const bool is_held = ordered_ != 0 && t_s_ < hold_until_s_ - rounding_s;
  if (is_sampled()) {
    const auto& box = spec_.law.end_box;
    see_box(box && std::abs(angle() - spec_.maneuver.final_angle_rad) <= box->angle_rad &&
            std::abs(rate()) <= box->rate_rad_s);
    ++sample_;
    if (in_box_) {
      side_ = 0;
      order(0);
    } else if (!is_held) {
      side_ = -wanted(s);
      order(-side_);
    }
    return;
  }
  if (is_held && !(in_box_ && spec_.stop == StopCondition::end_box)) return;
  if (in_box_) {
    order(0);
    if (spec_.stop == StopCondition::end_box || leads_into_box()) return;
    see_box(false);
    side_ = 0;
    side_ = side_ahead();
  }
  int wish = -side_;
  if (wish == 0 && ordered_ != 0 && spec_.actuator.minimum_on_time_s > 0 && spec_.law.hysteresis_rad == 0) {
    // At the end of the band, coming off a firing: would coasting lead straight back out?
    const bool at_edge = std::abs(s - (ordered_ < 0 ? upper_rad_ : lower_rad_)) < 1e-9;
    const double drift = acceleration(0.0);
    const double k = spec_.law.gamma_bar * spec_.law.inertia_kg_m2 / (2 * spec_.law.torque_N_m);
    const double s_rate = rate() + (spec_.law.rate_gain_s + 2 * k * std::abs(rate())) * drift;
    if (at_edge && s_rate * -ordered_ > 0) {
      wish = ordered_;
      hold_until_s_ = t_s_ + spec_.actuator.minimum_on_time_s;
    }
  }
  order(wish);
  // On the edge of the box a firing may lead straight back in; no root function sees that, being zero
  // already.
  if (!in_box_ && leads_into_box()) see_box(true);
}

double SundialsOnOffRun::acceleration(double torque_N_m) const {
  const std::size_t size = 2 + 2 * spec_.plant.modes.size();
  std::vector<double> slope(size);
  derivative<double>(spec_.plant, std::span<const double>(NV_DATA_S(solver_.state), size),
                     torque_N_m + unheld_torque(t_s_), slope);
  return slope[1];
}

bool SundialsOnOffRun::can_hold(Hold hold) {
  const Hold before = std::exchange(hold_, hold);
  const std::size_t size = 2 + 2 * spec_.plant.modes.size();
  const double torque = holding_torque(t_s_, std::span<const double>(NV_DATA_S(solver_.state), size));
  hold_ = before;
  const auto [least, most] = holding_range(hold);
  excess_ = torque <= least ? -1 : torque >= most ? 1 : 0;
  return excess_ == 0;
}

void SundialsOnOffRun::hold(Hold hold) {
  if (hold == hold_) return;
  is_fresh_ = true;
  if (hold_ == Hold::sliding) note(kSlidingEvent, 0);
  if (hold == Hold::free && hold_ != Hold::sliding) note(kRestEvent, 0);
  hold_ = hold;
  if (hold == Hold::resting || hold == Hold::stuck) NV_Ith_S(solver_.state, 1) = 0;
  if (hold == Hold::sliding || hold == Hold::resting) {
    ordered_ = 0;
    fire(0);
    has_braked_ = true;
  }
  if (hold == Hold::sliding) note(kSlidingEvent, lower_rad_ == upper_rad_ ? 1 : edge_);
  if (hold == Hold::resting || hold == Hold::stuck) note(kRestEvent, 1);
}

// An ideal law: on an edge of the band the torque that keeps s there tells whether both sides point at it.
void SundialsOnOffRun::decide_ideal() {
  const bool is_line = lower_rad_ == upper_rad_;
  const auto leave = [&] {
    const int below = is_line || edge_ < 0 ? -1 : 0, above = is_line || edge_ > 0 ? 1 : 0;
    side_ = excess_ > 0 ? below : above;
    if (hold_ != Hold::free) hold(Hold::free);
    order(-side_);
  };
  if (in_box_) {
    if (hold_ == Hold::sliding || hold_ == Hold::resting) hold(Hold::free);
    return order(0);
  }
  if (hold_ == Hold::sliding || hold_ == Hold::resting) {
    const bool is_still = std::abs(rate()) <= 1e-9 * metrics_.peak_rate_rad_s;
    if (hold_ == Hold::sliding && is_still && can_hold(Hold::resting)) return hold(Hold::resting);
    if (excess_ != 0) leave();
    return;
  }
  if (hold_ == Hold::stuck) return order(-side_);
  if (!std::exchange(at_edge_, false)) return order(-side_);
  const bool is_together = t_s_ - last_edge_s_ < kTogether_s;
  last_edge_s_ = t_s_;
  if (is_together && can_hold(Hold::resting)) {
    hold(Hold::resting);
    return note(kAccumulatedEvent, 1);
  }
  can_hold(Hold::sliding) ? hold(Hold::sliding) : leave();
}

// Coulomb friction: at a standstill it holds what it can.
void SundialsOnOffRun::rub() {
  if (spec_.disturbances.friction_N_m == 0 || hold_ == Hold::sliding || hold_ == Hold::resting) return;
  if (hold_ == Hold::free && sense_ != 0) return;
  sense_ = 0;
  if (can_hold(Hold::stuck)) return hold(Hold::stuck);
  sense_ = -excess_;
  is_fresh_ = true;
  if (hold_ == Hold::stuck) hold(Hold::free);
}

bool SundialsOnOffRun::leads_into_box() const {
  if (!spec_.law.end_box) return false;
  const EndBox& box = *spec_.law.end_box;
  const double error = angle() - spec_.maneuver.final_angle_rad;
  const double motion = acceleration(spec_.actuator.torque_N_m * u_ * share_);
  const auto is_or_gets_within = [](double value, double limit, double slope) {
    if (std::abs(std::abs(value) - limit) < 1e-10 * limit) return value > 0 ? slope < 0 : slope > 0;
    return std::abs(value) < limit;
  };
  return is_or_gets_within(error, box.angle_rad, rate()) && is_or_gets_within(rate(), box.rate_rad_s, motion);
}

void SundialsOnOffRun::meet(const std::array<int, kRootCount>& found) {
  // Which side of the band: by the direction in which its ends were passed.
  const bool is_line = lower_rad_ == upper_rad_;
  const int side = side_;
  if (found[kBandUpper] != 0 && side_ >= 0) side_ = found[kBandUpper] > 0 ? 1 : (is_line ? -1 : 0);
  if (found[kBandLower] != 0 && side_ <= 0) side_ = found[kBandLower] < 0 ? -1 : (is_line ? 1 : 0);
  if (side_ != side) {
    at_edge_ = true;
    edge_ = is_line || side_ > 0 || side > 0 ? 1 : -1;
  }
  if (found[kLeast] != 0 || found[kMost] != 0) excess_ = found[kMost] > 0 ? 1 : -1;
  if (spec_.law.hysteresis_rad > 0) is_fresh_ = true;
  if (spec_.law.end_box && !is_sampled() &&
      (found[kBoxLeft] || found[kBoxRight] || found[kBoxSlow] || found[kBoxFast])) {
    const EndBox& box = *spec_.law.end_box;
    const double error = angle() - spec_.maneuver.final_angle_rad;
    const auto within = [](int direction, bool is_upper, bool by_value) {
      return direction == 0 ? by_value : (direction > 0) != is_upper;
    };
    see_box(within(found[kBoxLeft], false, error >= -box.angle_rad) &&
            within(found[kBoxRight], true, error <= box.angle_rad) &&
            within(found[kBoxSlow], false, rate() >= -box.rate_rad_s) &&
            within(found[kBoxFast], true, rate() <= box.rate_rad_s));
  }
  if (found[kRest] != 0) sense_ = 0;
  if (found[kRest] != 0 && found[kRest] == -direction_ && has_braked_) {
    if (!metrics_.first_rest_s) metrics_.first_rest_s = t_s_;
    if (spec_.stop == StopCondition::first_rest) finish("first_rest");
  }
}

// One call of the integrator: to a root or to the stop, whichever comes first.
void SundialsOnOffRun::fly_to(double stop_s) {
  if (is_fresh_) {
    // Never go on across a switching: the integrator has already stepped past it with the old torque.
    check_sundials(ERKStepReset(solver_.memory, t_s_, solver_.state), "ERKStepReset");
    check_sundials(ERKStepSetInitStep(solver_.memory, 0), "ERKStepSetInitStep");
    is_fresh_ = false;
  }
  check_sundials(ERKStepSetStopTime(solver_.memory, stop_s), "ERKStepSetStopTime");
  const double from_s = t_s_;
  const double before = rate();
  const std::span<const double> state(NV_DATA_S(solver_.state), 2 + 2 * spec_.plant.modes.size());
  const double momentum = momentum_N_m_s(spec_.plant, state);
  excess_ = 0;
  sunrealtype reached = t_s_;
  int flag = ERKStepEvolve(solver_.memory, stop_s, solver_.state, &reached, ARK_NORMAL);
  if (flag == ARK_ILL_INPUT) {
    // A root at the very beginning: it begins on a guard, to rounding. Off it blindly, then look where that
    // was.
    check_sundials(ERKStepReset(solver_.memory, t_s_, solver_.state), "ERKStepReset");
    check_sundials(ERKStepRootInit(solver_.memory, 0, nullptr), "ERKStepRootInit");
    const double off_s = std::min(stop_s, t_s_ + 1e-9 * longest_step_s_);
    flag = ERKStepEvolve(solver_.memory, off_s, solver_.state, &reached, ARK_NORMAL);
    check_sundials(ERKStepRootInit(solver_.memory, kRootCount, &root_functions), "ERKStepRootInit");
    is_fresh_ = true;
    if (!is_sampled() && hold_ == Hold::free) side_ = side_ahead();
  }
  check_sundials(flag, "ERKStepEvolve");
  t_s_ = reached;
  ++report_.propagator.steps;
  const double h = t_s_ - from_s;
  if (u_ != 0) {
    metrics_.thruster_on_time_s.total += share_ * h;
    metrics_.thruster_on_time_s.per_thruster[u_ > 0 ? 0 : 1] += share_ * h;
  } else if (hold_ == Hold::sliding && lower_rad_ == upper_rad_) {
    metrics_.thruster_on_time_s.total += h;
  } else if (hold_ == Hold::sliding || hold_ == Hold::resting) {
    double impulse = momentum_N_m_s(spec_.plant, state) - momentum;
    impulse -= (constant_torque() - spec_.disturbances.friction_N_m * sense_) * h;
    for (const Sinusoid& one : spec_.disturbances.sinusoids)
      impulse += one.amplitude_N_m / one.frequency_rad_s *
                 (std::cos(one.frequency_rad_s * t_s_ + one.phase_rad) -
                  std::cos(one.frequency_rad_s * from_s + one.phase_rad));
    const double by_friction = hold_ == Hold::resting ? spec_.disturbances.friction_N_m * h : 0;
    metrics_.thruster_on_time_s.total +=
        std::max(0.0, std::abs(impulse) - by_friction) / spec_.actuator.torque_N_m;
  }
  metrics_.peak_rate_rad_s = std::max({metrics_.peak_rate_rad_s, std::abs(before), std::abs(rate())});
  digester_.real(t_s_);
  digester_.real(angle());
  digester_.real(rate());
  if (flag != ARK_ROOT_RETURN) return;
  std::array<int, kRootCount> found{};
  check_sundials(ERKStepGetRootInfo(solver_.memory, found.data()), "ERKStepGetRootInfo");
  meet(found);
}

RunStatus SundialsOnOffRun::advance(double, std::int64_t max_steps, SampleSink&) {
  if (t_s_ == 0 && report_.propagator.steps == 0 && !is_over_) {
    const double s = s_of(angle(), rate());
    side_ = side_ahead();
    if (spec_.evaluation == Evaluation::ideal && (s == lower_rad_ || s == upper_rad_)) {
      at_edge_ = true;
      edge_ = s == upper_rad_ ? 1 : -1;
    }
    sense_ = rate() > 0 ? 1 : rate() < 0 ? -1 : 0;
    const auto& box = spec_.law.end_box;
    if (!is_sampled() && box)
      see_box(std::abs(angle() - spec_.maneuver.final_angle_rad) <= box->angle_rad &&
              std::abs(rate()) <= box->rate_rad_s);
  }
  while (!is_over_) {
    if (max_steps-- <= 0) return RunStatus::running;
    if (t_s_ >= spec_.duration_s) {
      finish("duration");
      break;
    }
    timers();
    if (is_at_sample() || spec_.evaluation == Evaluation::continuous) decide();
    if (spec_.evaluation == Evaluation::ideal) decide_ideal();
    rub();
    if (spec_.stop == StopCondition::end_box && in_box_) {
      finish("end_box");
      break;
    }
    // A rest that sampled firings reach exactly is not crossed: it is met to the integrator's accuracy.
    const double rest_rate = 10 * spec_.verification_tolerance * metrics_.peak_rate_rad_s;
    if (has_braked_ && direction_ * rate() <= rest_rate) {
      if (!metrics_.first_rest_s) metrics_.first_rest_s = t_s_;
      if (spec_.stop == StopCondition::first_rest) {
        finish("first_rest");
        break;
      }
    }
    double stop_s = next_timer();
    const bool is_held = !is_sampled() && ordered_ != 0 && t_s_ < hold_until_s_;
    if (is_held) stop_s = std::min(stop_s, hold_until_s_);
    fly_to(stop_s);
    // When a hold is over the side is judged afresh, by the hysteresis of what has been firing.
    if (is_held && t_s_ >= hold_until_s_) {
      side_ = -ordered_;
      side_ = side_ahead();
    }
  }
  return RunStatus::finished;
}

void SundialsOnOffRun::finish(const char* reason) {
  if (spec_.stop == StopCondition::end_box && in_box_) fire(0);
  report_.stop_reason = reason;
  is_over_ = true;
}

RunReport SundialsOnOffRun::report() const {
  RunReport report = report_;
  long evaluations = 0;
  ERKStepGetNumRhsEvals(solver_.memory, &evaluations);
  report.propagator.rhs_evaluations = static_cast<std::uint64_t>(evaluations);
  report.metrics = metrics_;
  report.metrics.end_time_s = t_s_;
  const double error = angle() - spec_.maneuver.final_angle_rad;
  report.metrics.final_error_rad = error;
  report.metrics.residual_rate_rad_s = rate();
  report.metrics.final_state = {angle(), rate(), error, s_of(angle(), rate())};
  if (!spec_.plant.modes.empty()) {
    const std::span<const double> state(NV_DATA_S(solver_.state), 2 + 2 * spec_.plant.modes.size());
    report.metrics.final_state.push_back(momentum_N_m_s(spec_.plant, state));
    report.metrics.final_state.insert(report.metrics.final_state.end(), state.begin() + 2, state.end());
  }
  report.digest = digester_.digest();
  return report;
}

}  // namespace

std::unique_ptr<Run> make_on_off_axis_verification(const OnOffAxisSpecification& specification) {
  return std::make_unique<SundialsOnOffRun>(specification);
}

}  // namespace slew
