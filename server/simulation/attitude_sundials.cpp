// The second opinion on a three-axis slew: ARKODE's explicit Runge-Kutta with its own root finding. Shares
// the laws, the observer, the allocation, the sensor and the plant's right-hand side with the first one and
// nothing else: the loop, the guards, the modulators, the valves and the metrics are written again here. The
// filters of a sampled law's modulators are integrated like everything else.
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "server/actuator/propellant.hpp"
#include "server/actuator/thruster_allocation.hpp"
#include "server/estimation/sampled_disturbance_observer.hpp"
#include "server/propagation/erk_solver.hpp"
#include "server/random/random_stream.hpp"
#include "server/sensor/attitude_sensor.hpp"
#include "server/simulation/attitude_channels.hpp"
#include "server/simulation/digest.hpp"

namespace slew {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector = Eigen::Map<Vector3d>;
using ConstVector = Eigen::Map<const Vector3d>;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr int kChangesAtOneInstant = 256;

// A valve and the thrust behind it. Between two of its times the level is linear in time.
struct Valve {
  Thruster thruster;
  Vector3d torque_N_m;  ///< at full thrust, as mounted in truth
  std::deque<std::pair<double, bool>> under_way{};
  bool is_told_open = false, is_open = false;
  double full = 1;                  ///< level of the present firing
  double level = 0, slope_1_s = 0;  ///< at the beginning of the segment
  double level_after = 0, level_changes_until_s = kNever;
  double on_time_s = 0, impulse_s = 0;
  std::uint64_t firings = 0;
};

// A channel of the modulator.
struct Line {
  double level;
  bool is_signed;
  int output = 0;
  double free_from_s = 0;
  double pulse_end_s = kNever;
  double demand = 0;  ///< held by a sampled law
};

// What the law, and the observer behind it, ask for.
struct Wish {
  AttitudeCommand<double> law;
  Vector3d estimate_N_m = Vector3d::Zero();
  Vector3d torque_N_m = Vector3d::Zero();
};

Vector3d mounted_torque_N_m(const Thruster& thruster, std::uint64_t seed, std::uint32_t index) {
  if (thruster.couple_N_m) return *thruster.couple_N_m;
  Vector3d force = thruster.direction;
  if (thruster.misalignment_rad > 0) {
    const RandomStream draws(seed, RandomUse::misalignment, index);
    const Vector3d across = thruster.direction.unitOrthogonal();
    force += thruster.misalignment_rad * draws.normal(0) * across;
    force += thruster.misalignment_rad * draws.normal(1) * thruster.direction.cross(across);
    force.normalize();
  }
  return thruster.position_m.cross(thruster.thrust_N * force);
}

// Integral of |a + b t| from 0 to h.
double absolute_integral(double a, double b, double h) {
  const double end = a + b * h;
  if (a * end >= 0) return 0.5 * h * std::abs(a + end);
  return 0.5 * (a * a + end * end) / std::abs(b);
}

class SundialsAttitudeRun final : public Run {
 public:
  explicit SundialsAttitudeRun(const AttitudeSpecification& specification);

  const ChannelTable& channels() const override { return columns_; }
  const std::vector<std::string>& event_channels() const override { return event_channels_; }
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

  bool is_sampled() const { return spec_.sample_period_s.has_value(); }
  bool has_quaternion() const { return spec_.plant.attitude == AttitudeParameters::euler_parameters; }
  bool observes_within_steps() const { return spec_.observer && !is_sampled(); }
  double* state() { return NV_DATA_S(solver_.state); }
  const double* state() const { return NV_DATA_S(solver_.state); }
  // Where things are in the state: attitude, w, filters, Q, and of any torque the integrals of |T|, of T^2
  // and of the gas used.
  std::size_t rate_at() const { return has_quaternion() ? 4 : 3; }
  std::size_t filters_at() const { return rate_at() + 3; }
  std::size_t observer_at() const { return filters_at() + (pwpf_ ? lines_.size() : 0); }
  std::size_t integrals_at() const { return observer_at() + (observes_within_steps() ? 9 : 0); }
  std::size_t size() const { return integrals_at() + (ideal_ && !is_sampled() ? 3 : 0); }
  // And among the root functions: two for each channel, then these.
  std::size_t shadow_root() const { return 2 * lines_.size(); }
  std::size_t tank_root() const { return shadow_root() + 1; }
  std::size_t settling_root() const { return shadow_root() + 2; }
  std::size_t roots() const { return shadow_root() + 3; }

  void make_solver();
  Vector3d mrp_of(const double* x) const;
  Vector3d rate_of(const double* x) const { return ConstVector(x + rate_at()); }
  ObserverState<double> q_of(const double* x) const;
  Wish wish(double t_s, const double* x) const;
  void allocate(double t_s, const Vector3d& torque_N_m, std::span<double> demands) const;
  Vector3d limited(const Vector3d& torque_N_m) const;
  double gas_m3_s(const Vector3d& torque_N_m) const;
  Eigen::Vector4d attitude_of(const double* x) const;
  Vector3d torque(double t_s, const Wish& wish) const;
  Vector3d disturbance(double t_s) const;
  double filter_limit(const Line& line, double demand) const;
  void looks(double t_s, const double* x, std::span<double> values) const;
  double propellant_kg(double h) const;
  double outside(const Vector3d& mrp) const;

  void change_what_is_due();
  void take_shadow();
  void take_sample();
  void tell_modulators(const Vector3d& torque_N_m);
  void set_outputs();
  int wanted(const Line& line, double look) const;
  void set_output(std::size_t c, int output);
  std::size_t thruster_of(std::size_t c, int output) const;
  void move_valves();
  void head_for(Valve& valve, double target);
  void tell_valves();
  void note(std::uint32_t channel, int mode);
  double next_timer_s() const;
  void begin_segment();
  void step();
  void end_segment();
  void watch(double from_s);
  void fail(const char* code, const char* sentence);
  void finish(const char* reason);

  const AttitudeSpecification spec_;
  const Eigen::Matrix3d inverse_inertia_;
  const ChannelTable columns_;
  const std::vector<std::string> event_channels_;
  const AttitudeEvents events_;
  const IdealTorque* ideal_ = nullptr;
  const Modulator* modulator_ = nullptr;
  const PwpfModulator* pwpf_ = nullptr;
  const PulseWidthModulator* pulse_width_ = nullptr;
  double on_ = 0, off_ = 0;  ///< thresholds of a Schmitt trigger
  std::optional<ThrusterAllocation> allocation_;
  ErkSolver solver_;
  std::unique_ptr<std::remove_pointer_t<N_Vector>, void (*)(N_Vector)> between_{nullptr, &N_VDestroy};

  double t_s_ = 0;
  std::vector<Line> lines_;
  std::vector<Valve> valves_;
  std::vector<bool> told_open_;
  bool valves_have_events_ = false;
  bool is_empty_ = false, empty_is_told_ = false;
  Vector3d constant_N_m_ = Vector3d::Zero();  ///< of the disturbances, what is constant now
  std::size_t next_disturbance_ = 0;
  double program_changes_s_, reference_changes_s_;
  std::vector<int> found_;  ///< roots that ended the segment
  int changes_at_this_instant_ = 0;

  // Of a sampled law.
  std::optional<AttitudeSensor> sensor_;
  std::optional<SampledDisturbanceObserver> observer_;
  ObserverState<double> q_;
  Wish held_;
  Vector3d known_input_N_m_ = Vector3d::Zero();
  Vector3d impulse_N_m_s_ = Vector3d::Zero();  ///< of the actuator since the latest sample
  std::int64_t sample_ = 0;

  // The segment under way: no discrete change in it. The torque of what is held is linear in time.
  bool is_under_way_ = false;
  double began_s_ = 0, stop_s_ = 0;
  Vector3d torque_N_m_ = Vector3d::Zero(), slope_N_m_s_ = Vector3d::Zero();

  double tolerance_ = 0;  ///< of settling
  bool is_outside_ = false;
  double last_outside_s_ = 0;
  double impulse_sum_N_m_s_ = 0, effort_N2_m2_s_ = 0, gas_m3_ = 0;
  double peak_rate_rad_s_ = 0;
  bool is_over_ = false;
  RunReport report_;
  Digester digester_;
};

SundialsAttitudeRun::SundialsAttitudeRun(const AttitudeSpecification& specification)
    : spec_(specification),
      inverse_inertia_(specification.plant.inertia_kg_m2.inverse()),
      columns_(attitude_channels(AttitudeLoop(specification))),
      event_channels_(attitude_event_channels(AttitudeLoop(specification))),
      events_(attitude_events(AttitudeLoop(specification))),
      ideal_(std::get_if<IdealTorque>(&spec_.actuator)),
      constant_N_m_(specification.disturbances.constant_N_m),
      program_changes_s_(next_change_s(specification.law, 0)),
      reference_changes_s_(specification.maneuver.reference.next_change_s(0)) {
  if (const auto* pairs = std::get_if<AxisThrusters>(&spec_.actuator)) {
    modulator_ = &pairs->modulator;
    for (int axis = 0; axis < 3; ++axis) {
      lines_.push_back({pairs->torque_N_m[axis], true});
      for (const double sign : {1, -1}) {
        const Vector3d couple_N_m = sign * pairs->torque_N_m[axis] * pairs->axes.col(axis);
        valves_.push_back({pairs->valve, couple_N_m});
        valves_.back().thruster.couple_N_m = couple_N_m;
        valves_.back().thruster.thrust_N = pairs->torque_N_m[axis] / pairs->lever_arm_m.value_or(1);
      }
    }
  }
  if (const auto* mounted = std::get_if<MountedThrusters>(&spec_.actuator)) {
    modulator_ = &mounted->modulator;
    allocation_.emplace(mounted->thrusters, mounted->allocation);
    for (std::uint32_t j = 0; j < mounted->thrusters.size(); ++j) {
      const Thruster& thruster = mounted->thrusters[j];
      lines_.push_back({thruster.thrust_N, false});
      valves_.push_back({thruster, mounted_torque_N_m(thruster, spec_.seed, j)});
    }
  }
  if (modulator_) {
    pwpf_ = std::get_if<PwpfModulator>(modulator_);
    pulse_width_ = std::get_if<PulseWidthModulator>(modulator_);
    if (pwpf_) on_ = pwpf_->on, off_ = pwpf_->off;
    if (const auto* schmitt = std::get_if<SchmittModulator>(modulator_))
      on_ = schmitt->on, off_ = schmitt->off;
  }
  told_open_.assign(valves_.size(), false);
  for (const Valve& valve : valves_) {
    const Thruster& one = valve.thruster;
    valves_have_events_ = valves_have_events_ || one.on_delay_s > 0 || one.off_delay_s > 0 ||
                          std::isfinite(one.stuck_open_from_s) || std::isfinite(one.stuck_closed_from_s);
  }
  if (is_sampled()) {
    if (!spec_.sensor.is_ideal()) sensor_.emplace(spec_.sensor, spec_.seed);
    if (spec_.observer) observer_.emplace(*spec_.observer, *spec_.sample_period_s);
  }
  found_.assign(roots(), 0);
  make_solver();
  tolerance_ = spec_.settling.tolerance;
  if (spec_.settling.is_fraction_of_initial) {
    const Vector3d& p = spec_.maneuver.initial_mrp;
    switch (spec_.settling.quantity) {
      case AttitudeQuantity::angle:
        tolerance_ *= rotation_angle_rad(p);
        break;
      case AttitudeQuantity::mrp_norm:
        tolerance_ *= p.norm();
        break;
      default:
        tolerance_ *= std::abs(p[static_cast<int>(spec_.settling.quantity)]);
    }
  }
  is_outside_ = outside(spec_.maneuver.initial_mrp) > 0;
  report_.propagator.name = "sundials_erkstep_dormand_prince";
}

void SundialsAttitudeRun::make_solver() {
  const auto length = static_cast<sunindextype>(size());
  solver_.state = N_VNew_Serial(length, solver_.context);
  between_.reset(N_VNew_Serial(length, solver_.context));
  if (!solver_.state || !between_) throw std::bad_alloc();
  N_VConst(0, solver_.state);
  const Vector3d& p = spec_.maneuver.initial_mrp;
  if (has_quaternion())
    Eigen::Map<Eigen::Vector4d>{state()} = euler_parameters<double>(p);
  else
    Vector{state()} = p;
  Vector(state() + rate_at()) = spec_.maneuver.initial_rate_rad_s;
  const double relative = spec_.verification_tolerance;
  std::vector<double> absolute(size(), 1e-3 * relative);
  if (observes_within_steps()) {
    const AttitudeSight<double> sight{p, spec_.maneuver.initial_rate_rad_s, spec_.maneuver.reference.at(0), 0,
                                      0};
    const ObserverState<double> q =
        initial_observer_state<double>(*spec_.observer, command(spec_.law, sight).surface_rad_s);
    // Q is of the size of K1 s: it is known no better than s times K1.
    const double inertia = spec_.observer->inertia_kg_m2.norm();
    const double a = spec_.observer->pole_rad_s;
    for (std::size_t i = 0; i < 3; ++i) {
      Vector(state() + observer_at() + 3 * i) = q[i];
      for (std::size_t axis = 0; axis < 3; ++axis)
        absolute[observer_at() + 3 * i + axis] *= std::pow(a, static_cast<double>(i + 1)) * inertia;
    }
  }
  solver_.memory = ERKStepCreate(&right_hand_side, 0.0, solver_.state, solver_.context);
  if (!solver_.memory) throw std::bad_alloc();
  check_sundials(ERKStepSetUserData(solver_.memory, this), "ERKStepSetUserData");
  check_sundials(ERKStepSetTableNum(solver_.memory, ARKODE_DORMAND_PRINCE_7_4_5), "ERKStepSetTableNum");
  const N_Vector tolerances = N_VNew_Serial(length, solver_.context);
  if (!tolerances) throw std::bad_alloc();
  std::copy(absolute.begin(), absolute.end(), NV_DATA_S(tolerances));
  const int flag = ERKStepSVtolerances(solver_.memory, relative, tolerances);
  N_VDestroy(tolerances);
  check_sundials(flag, "ERKStepSVtolerances");
  check_sundials(ERKStepRootInit(solver_.memory, static_cast<int>(roots()), &root_functions),
                 "ERKStepRootInit");
  std::vector<int> directions(roots(), 1);
  directions[settling_root()] = 0;
  check_sundials(ERKStepSetRootDirection(solver_.memory, directions.data()), "ERKStepSetRootDirection");
  check_sundials(ERKStepSetNoInactiveRootWarn(solver_.memory), "ERKStepSetNoInactiveRootWarn");
  check_sundials(ERKStepSetMaxNumSteps(solver_.memory, 10000000), "ERKStepSetMaxNumSteps");
  // Corners of the law cost a failed step for every binary digit of their place.
  check_sundials(ERKStepSetMaxErrTestFails(solver_.memory, 100), "ERKStepSetMaxErrTestFails");
}

Vector3d SundialsAttitudeRun::mrp_of(const double* x) const {
  if (has_quaternion()) return mrp<double>(Eigen::Map<const Eigen::Vector4d>(x));
  return ConstVector(x);
}

ObserverState<double> SundialsAttitudeRun::q_of(const double* x) const {
  const double* q = x + observer_at();
  return {ConstVector(q), ConstVector(q + 3), ConstVector(q + 6)};
}

// Of a law evaluated continuously.
Wish SundialsAttitudeRun::wish(double t_s, const double* x) const {
  const AttitudeSight<double> sight{mrp_of(x), rate_of(x), spec_.maneuver.reference.at(t_s, began_s_),
                                    began_s_, t_s};
  Wish wish{command(spec_.law, sight), Vector3d::Zero(), Vector3d::Zero()};
  if (spec_.observer)
    wish.estimate_N_m = estimated_disturbance<double>(*spec_.observer, q_of(x), wish.law.surface_rad_s)[0];
  wish.torque_N_m = wish.law.torque_N_m - wish.estimate_N_m;
  return wish;
}

void SundialsAttitudeRun::allocate(double t_s, const Vector3d& torque_N_m, std::span<double> demands) const {
  if (const auto* law = std::get_if<PlannedTorque>(&spec_.law); law && law->planned) {
    for (std::size_t c = 0; c < lines_.size(); ++c)
      demands[c] = lines_[c].level * law->planned->control(static_cast<Eigen::Index>(c), t_s, began_s_);
    return;
  }
  if (allocation_) return allocation_->allocate(torque_N_m, demands);
  const Vector3d demand = std::get<AxisThrusters>(spec_.actuator).axes.partialPivLu().solve(torque_N_m);
  std::copy_n(demand.data(), 3, demands.begin());
}

Vector3d SundialsAttitudeRun::limited(const Vector3d& torque_N_m) const {
  Vector3d torque = torque_N_m;
  if (ideal_->influence_N_m) {
    Vector3d u = ideal_->influence_N_m->partialPivLu().solve(torque_N_m);
    for (double& one : u) one = std::clamp(one, -1.0, 1.0);
    return *ideal_->influence_N_m * u;
  }
  if (ideal_->maximum_N_m)
    for (int axis = 0; axis < 3; ++axis) {
      const double most = (*ideal_->maximum_N_m)[axis];
      torque[axis] = std::clamp(torque[axis], -most, most);
    }
  return torque;
}

double SundialsAttitudeRun::gas_m3_s(const Vector3d& torque_N_m) const {
  if (!ideal_ || !ideal_->gas_flow_m3_s) return 0;
  const Matrix3d influence =
      ideal_->influence_N_m.value_or(ideal_->maximum_N_m.value_or(Vector3d::Ones()).asDiagonal());
  const Vector3d u = influence.partialPivLu().solve(torque_N_m);
  return ideal_->gas_flow_m3_s->dot(u.cwiseAbs());
}

// The body relative to the frame of reference.
Eigen::Vector4d SundialsAttitudeRun::attitude_of(const double* x) const {
  const Eigen::Vector4d q = euler_parameters<double>(mrp_of(x));
  return euler_parameter_product<double>(spec_.maneuver.final_attitude, q);
}

Vector3d SundialsAttitudeRun::torque(double t_s, const Wish& wish) const {
  if (ideal_ && !is_sampled()) return limited(wish.torque_N_m);
  return torque_N_m_ + (t_s - began_s_) * slope_N_m_s_;
}

Vector3d SundialsAttitudeRun::disturbance(double t_s) const {
  Vector3d torque = constant_N_m_;
  for (const BodySinusoid& one : spec_.disturbances.sinusoids)
    torque += one.amplitude_N_m * std::sin(one.frequency_rad_s * t_s + one.phase_rad);
  return torque;
}

// K_m (demand - U level), in the three ways of Modulator::input.
double SundialsAttitudeRun::filter_limit(const Line& line, double demand) const {
  if (pwpf_->input == ModulatorInput::scaled) return pwpf_->gain * (demand / line.level - line.output);
  if (pwpf_->input == ModulatorInput::clipped) demand = std::max(-line.level, std::min(line.level, demand));
  return pwpf_->gain * (demand - line.output * line.level);
}

int SundialsAttitudeRun::right_hand_side(sunrealtype t, N_Vector state, N_Vector slope, void* self) {
  const auto& run = *static_cast<const SundialsAttitudeRun*>(self);
  const AttitudeSpecification& spec = run.spec_;
  const double* x = NV_DATA_S(state);
  double* dx = NV_DATA_S(slope);
  const Vector3d w = run.rate_of(x);
  if (run.has_quaternion())
    Eigen::Map<Eigen::Vector4d>{dx} = euler_parameter_rate<double>(Eigen::Map<const Eigen::Vector4d>(x), w);
  else
    Vector{dx} = mrp_rate<double>(ConstVector(x), w);

  const bool is_sampled = run.is_sampled();
  Wish wish;
  if (!is_sampled && (run.ideal_ || run.pwpf_ || spec.observer)) wish = run.wish(t, x);
  const Vector3d torque = run.torque(t, wish);
  Vector3d outer = torque + run.disturbance(t);
  if (!spec.plant.is_free())
    outer += pedestal_moment<double>(spec.plant.weight, spec.plant.springs, run.attitude_of(x));
  Vector(dx + run.rate_at()) =
      angular_acceleration<double>(spec.plant.inertia_kg_m2, run.inverse_inertia_, w, outer);
  if (run.pwpf_) {
    std::array<double, kMaxThrusters> demands;
    if (!is_sampled) run.allocate(t, wish.torque_N_m, std::span(demands).first(run.lines_.size()));
    for (std::size_t c = 0; c < run.lines_.size(); ++c) {
      const Line& line = run.lines_[c];
      const std::size_t at = run.filters_at() + c;
      dx[at] = (run.filter_limit(line, is_sampled ? line.demand : demands[c]) - x[at]) /
               run.pwpf_->time_constant_s;
    }
  }
  if (is_sampled) return 0;
  if (spec.observer) {
    Vector3d input = spec.observer->feeding == ObserverFeeding::commanded ? wish.torque_N_m : torque;
    if (spec.observer->feeding != ObserverFeeding::applied_total) input -= wish.law.equivalent_N_m;
    const auto z = estimated_disturbance<double>(*spec.observer, run.q_of(x), wish.law.surface_rad_s);
    const auto moves = observer_slope<double>(*spec.observer, z, input);
    for (std::size_t i = 0; i < 3; ++i) Vector(dx + run.observer_at() + 3 * i) = moves[i];
  }
  if (run.ideal_) {
    dx[run.integrals_at()] = torque.cwiseAbs().sum();
    dx[run.integrals_at() + 1] = torque.squaredNorm();
    dx[run.integrals_at() + 2] = run.gas_m3_s(torque);
  }
  return 0;
}

// What the triggers look at.
void SundialsAttitudeRun::looks(double t_s, const double* x, std::span<double> values) const {
  if (pwpf_) {
    std::copy_n(x + filters_at(), lines_.size(), values.begin());
    return;
  }
  if (!is_sampled()) allocate(t_s, wish(t_s, x).torque_N_m, values);
  for (std::size_t c = 0; c < lines_.size(); ++c)
    values[c] = (is_sampled() ? lines_[c].demand : values[c]) / lines_[c].level;
}

// Used up at h after the beginning of the segment.
double SundialsAttitudeRun::propellant_kg(double h) const {
  const Propellant& propellant = *propellant_of(spec_.actuator);
  double used_kg = 0;
  for (const Valve& valve : valves_) {
    const double impulse_s = valve.impulse_s + h * valve.level + 0.5 * h * h * valve.slope_1_s;
    used_kg += valve.thruster.thrust_N * impulse_s / (*propellant.specific_impulse_s * kStandardGravity_m_s2);
  }
  return used_kg;
}

// Positive outside the tolerance of settling.
double SundialsAttitudeRun::outside(const Vector3d& mrp) const {
  const double square = mrp.squaredNorm();
  switch (spec_.settling.quantity) {
    case AttitudeQuantity::angle: {
      const double most = std::tan(tolerance_ / 4);
      return std::min(square, 1 / square) - most * most;
    }
    case AttitudeQuantity::mrp_norm:
      return square - tolerance_ * tolerance_;
    default: {
      const double p = mrp[static_cast<int>(spec_.settling.quantity)];
      return p * p - tolerance_ * tolerance_;
    }
  }
}

int SundialsAttitudeRun::root_functions(sunrealtype t, N_Vector state, sunrealtype* values, void* self) {
  const auto& run = *static_cast<const SundialsAttitudeRun*>(self);
  const double* x = NV_DATA_S(state);
  std::fill_n(values, run.roots(), -1.0);
  if (run.modulator_ && !run.pulse_width_ && (run.pwpf_ || !run.is_sampled())) {
    std::array<double, kMaxThrusters> looks;
    run.looks(t, x, std::span(looks).first(run.lines_.size()));
    for (std::size_t c = 0; c < run.lines_.size(); ++c) {
      const Line& line = run.lines_[c];
      if (line.free_from_s > run.began_s_) continue;
      if (line.output != 0) {
        values[2 * c] = run.off_ - line.output * looks[c];
      } else {
        values[2 * c] = looks[c] - run.on_;
        if (line.is_signed) values[2 * c + 1] = -looks[c] - run.on_;
      }
    }
  }
  const Vector3d mrp = run.mrp_of(x);
  if (const auto& most = run.spec_.plant.shadow_switch_norm; most && !run.is_sampled())
    values[run.shadow_root()] = mrp.norm() - *most;
  if (const Propellant* propellant = propellant_of(run.spec_.actuator))
    if (propellant->tank_kg && !run.is_empty_)
      values[run.tank_root()] = run.propellant_kg(t - run.began_s_) / *propellant->tank_kg - 1;
  values[run.settling_root()] = run.outside(mrp);
  return 0;
}

RunStatus SundialsAttitudeRun::advance(double, std::int64_t max_steps, SampleSink&) {
  while (!is_over_) {
    if (max_steps-- <= 0) return RunStatus::running;
    if (!is_under_way_) {
      if (t_s_ >= spec_.duration_s) {
        finish("duration");
        break;
      }
      change_what_is_due();
      if (is_over_) break;
      begin_segment();
    }
    step();
  }
  return report_.failure ? RunStatus::failed : RunStatus::finished;
}

void SundialsAttitudeRun::fail(const char* code, const char* sentence) {
  report_.failure = RunFailure{code, sentence};
  is_over_ = true;
}

void SundialsAttitudeRun::finish(const char* reason) {
  report_.stop_reason = reason;
  is_over_ = true;
}

void SundialsAttitudeRun::note(std::uint32_t channel, int mode) {
  const SwitchEvent event{t_s_, channel, mode};
  digester_.event(event);
  ++report_.events_total;
  ++report_.propagator.events;
  if (report_.events.size() < kReportedEvents) report_.events.push_back(event);
  if (++changes_at_this_instant_ > kChangesAtOneInstant)
    fail("event_cascade", "more changes at one instant than a loop that makes sense can have");
}

// In the order of server/doc/step.md.
void SundialsAttitudeRun::change_what_is_due() {
  began_s_ = t_s_;
  if (found_[tank_root()] != 0) {
    is_empty_ = true;
    for (Valve& valve : valves_) head_for(valve, 0);
  }
  move_valves();
  const auto& steps = spec_.disturbances.steps;
  for (; next_disturbance_ < steps.size() && steps[next_disturbance_].from_s <= t_s_; ++next_disturbance_)
    constant_N_m_ += steps[next_disturbance_].torque_N_m;
  if (program_changes_s_ <= t_s_) {
    program_changes_s_ = next_change_s(spec_.law, t_s_);
    note(events_.program, std::isfinite(program_changes_s_) ? 1 : 0);
  }
  if (reference_changes_s_ <= t_s_) reference_changes_s_ = spec_.maneuver.reference.next_change_s(t_s_);
  if (is_sampled() && static_cast<double>(sample_) * *spec_.sample_period_s <= t_s_) take_sample();
  if (found_[shadow_root()] != 0) take_shadow();
  if (modulator_) {
    set_outputs();
    tell_valves();
  }
  std::fill(found_.begin(), found_.end(), 0);
}

// The parameters jump, and so does s, but not what the observer has estimated: Q + K1 s.
void SundialsAttitudeRun::take_shadow() {
  const auto surface = [&] {
    return command(spec_.law, AttitudeSight<double>{mrp_of(state()), rate_of(state()),
                                                    spec_.maneuver.reference.at(t_s_), began_s_, t_s_})
        .surface_rad_s;
  };
  const Vector3d before_rad_s = surface();
  if (has_quaternion())
    std::transform(state(), state() + 4, state(), std::negate<>());
  else
    Vector{state()} = mrp_shadow<double>(mrp_of(state()));
  if (spec_.observer) {
    const Vector3d jump_rad_s = surface() - before_rad_s;
    const ObserverState<double> none{Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
    const ObserverState<double> jump = estimated_disturbance<double>(*spec_.observer, none, jump_rad_s);
    for (std::size_t i = 0; i < 3; ++i)
      if (is_sampled())
        q_[i] -= jump[i];
      else
        Vector(state() + observer_at() + 3 * i) -= jump[i];
    held_.law.surface_rad_s += jump_rad_s;
  }
  note(events_.shadow, 1);
}

void SundialsAttitudeRun::take_sample() {
  if (const auto& most = spec_.plant.shadow_switch_norm; most && mrp_of(state()).norm() > *most)
    take_shadow();
  AttitudeSight<double> sight{mrp_of(state()), rate_of(state()), spec_.maneuver.reference.at(t_s_), t_s_,
                              t_s_};
  if (sensor_) {
    const AttitudeReading reading = sensor_->read(sight.mrp, sight.rate_rad_s);
    sight.mrp = reading.mrp;
    sight.rate_rad_s = reading.rate_rad_s;
  }
  const Vector3d s = held_.law.surface_rad_s;
  held_.law = command(spec_.law, sight);
  held_.torque_N_m = held_.law.torque_N_m;
  if (observer_) {
    const bool is_applied = spec_.observer->feeding != ObserverFeeding::commanded;
    if (sample_ == 0)
      q_ = initial_observer_state<double>(*spec_.observer, held_.law.surface_rad_s);
    else
      q_ = observer_->step(q_, s, held_.law.surface_rad_s,
                           is_applied ? Vector3d(known_input_N_m_ + impulse_N_m_s_ / *spec_.sample_period_s)
                                      : known_input_N_m_);
    impulse_N_m_s_.setZero();
    held_.estimate_N_m = observer_->estimate(q_, held_.law.surface_rad_s)[0];
    held_.torque_N_m -= held_.estimate_N_m;
    known_input_N_m_ = is_applied ? Vector3d::Zero() : held_.torque_N_m;
    if (spec_.observer->feeding != ObserverFeeding::applied_total)
      known_input_N_m_ -= held_.law.equivalent_N_m;
  }
  ++sample_;
  if (modulator_)
    tell_modulators(held_.torque_N_m);
  else
    torque_N_m_ = limited(held_.torque_N_m);
}

void SundialsAttitudeRun::tell_modulators(const Vector3d& torque_N_m) {
  std::array<double, kMaxThrusters> demands;
  allocate(t_s_, torque_N_m, std::span(demands).first(lines_.size()));
  for (std::size_t c = 0; c < lines_.size(); ++c) {
    Line& line = lines_[c];
    line.demand = demands[c];
    if (!pulse_width_) continue;
    const double period_s = *spec_.sample_period_s;
    const double length_s = std::min(1.0, std::abs(demands[c]) / line.level) * period_s;
    const bool fires = demands[c] != 0 && length_s >= pulse_width_->minimum_on_time_s;
    line.pulse_end_s = fires && length_s < period_s ? t_s_ + length_s : kNever;
    set_output(c, fires ? (demands[c] > 0 ? 1 : -1) : 0);
  }
}

int SundialsAttitudeRun::wanted(const Line& line, double look) const {
  if (line.output != 0) return line.output * look > off_ ? line.output : 0;
  return look >= on_ ? 1 : line.is_signed && look <= -on_ ? -1 : 0;
}

void SundialsAttitudeRun::set_outputs() {
  std::array<double, kMaxThrusters> values;
  if (!pulse_width_) looks(t_s_, state(), std::span(values).first(lines_.size()));
  for (std::size_t c = 0; c < lines_.size(); ++c) {
    Line& line = lines_[c];
    if (pulse_width_) {
      if (line.pulse_end_s > t_s_) continue;
      line.pulse_end_s = kNever;
      set_output(c, 0);
    } else if (found_[2 * c] != 0 || found_[2 * c + 1] != 0) {
      set_output(c, line.output != 0 ? 0 : found_[2 * c] != 0 ? 1 : -1);
    } else {
      // From on to off, and at once to the other side.
      if (line.free_from_s <= t_s_) set_output(c, wanted(line, values[c]));
      if (line.free_from_s <= t_s_) set_output(c, wanted(line, values[c]));
    }
  }
}

std::size_t SundialsAttitudeRun::thruster_of(std::size_t c, int output) const {
  if (!lines_[c].is_signed) return c;
  return output > 0 ? 2 * c : 2 * c + 1;
}

void SundialsAttitudeRun::set_output(std::size_t c, int output) {
  Line& line = lines_[c];
  if (output == line.output) return;
  const auto tell = [&](int which, bool is_open) {
    Valve& valve = valves_[thruster_of(c, which)];
    const double at_s = t_s_ + (is_open ? valve.thruster.on_delay_s : valve.thruster.off_delay_s);
    // What would come before an earlier order takes that one back.
    if (!valve.under_way.empty() && at_s <= valve.under_way.back().first)
      valve.under_way.pop_back();
    else
      valve.under_way.emplace_back(at_s, is_open);
    return valve.under_way.size() <= 16;
  };
  bool is_taken = true;
  if (line.output != 0) is_taken = tell(line.output, false);
  if (output != 0) is_taken = tell(output, true) && is_taken;
  if (!is_taken) fail("too_many_commands", "a thruster is commanded faster than its valve can follow");
  if (output != 0) {
    const Thruster& one = valves_[thruster_of(c, output)].thruster;
    line.free_from_s = t_s_ + one.minimum_on_time_s;
    if (one.minimum_on_time_of == MinimumOnTimeOf::effective_thrust)
      line.free_from_s = t_s_ + std::max(0.0, one.minimum_on_time_s + 0.5 * (one.rise_s - one.fall_s));
  } else {
    line.free_from_s = t_s_ + valves_[thruster_of(c, line.output)].thruster.minimum_off_time_s;
  }
  line.output = output;
  note(static_cast<std::uint32_t>(c), output);
  move_valves();
}

// Orders that arrive, faults, the end of a rise or fall.
void SundialsAttitudeRun::move_valves() {
  for (std::size_t j = 0; j < valves_.size(); ++j) {
    Valve& valve = valves_[j];
    const Thruster& one = valve.thruster;
    if (valve.level_changes_until_s <= t_s_) {
      valve.level = valve.level_after;
      valve.slope_1_s = 0;
      valve.level_changes_until_s = kNever;
    }
    while (!valve.under_way.empty() && valve.under_way.front().first <= t_s_) {
      valve.is_told_open = valve.under_way.front().second;
      valve.under_way.pop_front();
    }
    bool is_open = valve.is_told_open;
    const bool opens_first = one.stuck_open_from_s < one.stuck_closed_from_s;
    if (opens_first && one.stuck_open_from_s <= t_s_) is_open = true;
    if (!opens_first && one.stuck_closed_from_s <= t_s_) is_open = false;
    if (is_empty_) is_open = false;
    if (is_open && !valve.is_open) {
      valve.full = 1;
      if (one.noise > 0) {
        const RandomStream draws(spec_.seed, RandomUse::thruster_noise, static_cast<std::uint32_t>(j));
        valve.full = std::max(0.0, 1 + one.noise * draws.normal(valve.firings));
      }
      ++valve.firings;
    }
    const bool turns = is_open != valve.is_open;
    valve.is_open = is_open;
    if (turns) head_for(valve, is_open ? valve.full : 0);
  }
}

void SundialsAttitudeRun::head_for(Valve& valve, double target) {
  const double distance = target - valve.level;
  const double whole_s = is_empty_ ? 0 : distance > 0 ? valve.thruster.rise_s : valve.thruster.fall_s;
  const double takes_s = distance == 0 ? 0 : whole_s * std::abs(distance) / valve.full;
  valve.level_after = target;
  valve.level_changes_until_s = kNever;
  valve.slope_1_s = 0;
  if (takes_s > 0 && valve.full > 0) {
    valve.slope_1_s = distance / takes_s;
    valve.level_changes_until_s = t_s_ + takes_s;
  } else {
    valve.level = target;
  }
}

void SundialsAttitudeRun::tell_valves() {
  if (is_empty_ && !std::exchange(empty_is_told_, true)) note(events_.tank, 1);
  if (!valves_have_events_) return;
  for (std::size_t j = 0; j < valves_.size(); ++j) {
    if (valves_[j].is_open == told_open_[j]) continue;
    told_open_[j] = valves_[j].is_open;
    note(events_.valves + static_cast<std::uint32_t>(j), told_open_[j] ? 1 : 0);
  }
}

double SundialsAttitudeRun::next_timer_s() const {
  double next = kNever;
  const auto consider = [&](double at_s) {
    if (at_s > t_s_) next = std::min(next, at_s);
  };
  consider(spec_.duration_s);
  consider(program_changes_s_);
  consider(reference_changes_s_);
  for (const BodyStepDisturbance& step : spec_.disturbances.steps) consider(step.from_s);
  if (is_sampled()) consider(static_cast<double>(sample_) * *spec_.sample_period_s);
  for (const Line& line : lines_) {
    consider(line.free_from_s);
    consider(line.pulse_end_s);
  }
  for (const Valve& valve : valves_) {
    if (!valve.under_way.empty()) consider(valve.under_way.front().first);
    consider(valve.level_changes_until_s);
    consider(valve.thruster.stuck_open_from_s);
    consider(valve.thruster.stuck_closed_from_s);
  }
  return next;
}

void SundialsAttitudeRun::begin_segment() {
  if (modulator_) {
    torque_N_m_.setZero();
    slope_N_m_s_.setZero();
    for (const Valve& valve : valves_) {
      torque_N_m_ += valve.level * valve.torque_N_m;
      slope_N_m_s_ += valve.slope_1_s * valve.torque_N_m;
    }
  }
  // A change may have carried it in or out.
  const bool was_outside = std::exchange(is_outside_, outside(mrp_of(state())) > 0);
  if (was_outside || is_outside_) last_outside_s_ = t_s_;
  stop_s_ = next_timer_s();
  // Never go on across a change: the integrator has already stepped past it with the old torque.
  check_sundials(ERKStepReset(solver_.memory, t_s_, solver_.state), "ERKStepReset");
  check_sundials(ERKStepSetInitStep(solver_.memory, 0), "ERKStepSetInitStep");
  check_sundials(ERKStepSetStopTime(solver_.memory, stop_s_), "ERKStepSetStopTime");
  peak_rate_rad_s_ = std::max(peak_rate_rad_s_, rate_of(state()).norm());
  is_under_way_ = true;
}

// One step of the integrator: to a root or to the stop, if they are as near.
void SundialsAttitudeRun::step() {
  const double from_s = t_s_;
  // Times that only rounding keeps apart: the integrator does not move for less.
  if (stop_s_ - began_s_ <= 1e-14 * std::max(1.0, began_s_)) {
    t_s_ = stop_s_;
    return end_segment();
  }
  sunrealtype reached = t_s_;
  const int flag = ERKStepEvolve(solver_.memory, stop_s_, solver_.state, &reached, ARK_ONE_STEP);
  check_sundials(flag, "ERKStepEvolve");
  t_s_ = reached;
  ++report_.propagator.steps;
  watch(from_s);
  digester_.real(t_s_);
  for (std::size_t i = 0; i < size(); ++i) digester_.real(state()[i]);
  if (flag == ARK_TSTOP_RETURN) return end_segment();
  if (flag != ARK_ROOT_RETURN) return;
  check_sundials(ERKStepGetRootInfo(solver_.memory, found_.data()), "ERKStepGetRootInfo");
  if (const int direction = std::exchange(found_[settling_root()], 0); direction != 0) {
    is_outside_ = direction > 0;
    last_outside_s_ = t_s_;
  }
  if (std::any_of(found_.begin(), found_.end(), [](int root) { return root != 0; })) end_segment();
}

void SundialsAttitudeRun::end_segment() {
  const double h = t_s_ - began_s_;
  if (h > 0) changes_at_this_instant_ = 0;
  for (Valve& valve : valves_) {
    valve.impulse_s += h * (valve.level + 0.5 * h * valve.slope_1_s);
    valve.level += h * valve.slope_1_s;
    if (valve.is_open) valve.on_time_s += h;
  }
  if (modulator_ || is_sampled()) {
    for (int axis = 0; axis < 3; ++axis) {
      const double a = torque_N_m_[axis], b = slope_N_m_s_[axis];
      impulse_sum_N_m_s_ += absolute_integral(a, b, h);
      effort_N2_m2_s_ += h * (a * a + h * b * (a + h * b / 3));
    }
    gas_m3_ += h * gas_m3_s(torque_N_m_);
    impulse_N_m_s_ += h * (torque_N_m_ + 0.5 * h * slope_N_m_s_);
  }
  is_under_way_ = false;
}

// |w| within the latest step.
void SundialsAttitudeRun::watch(double from_s) {
  constexpr int kParts = 8;
  peak_rate_rad_s_ = std::max(peak_rate_rad_s_, rate_of(state()).norm());
  for (int i = 1; i < kParts; ++i) {
    const double at_s = from_s + (t_s_ - from_s) * i / kParts;
    if (ERKStepGetDky(solver_.memory, at_s, 0, between_.get()) < 0) return;
    peak_rate_rad_s_ = std::max(peak_rate_rad_s_, rate_of(NV_DATA_S(between_.get())).norm());
  }
}

RunReport SundialsAttitudeRun::report() const {
  RunReport report = report_;
  long evaluations = 0;
  ERKStepGetNumRhsEvals(solver_.memory, &evaluations);
  report.propagator.rhs_evaluations = static_cast<std::uint64_t>(evaluations);
  Metrics& metrics = report.metrics;
  const Vector3d p = mrp_of(state()), w = rate_of(state());
  metrics.end_time_s = t_s_;
  metrics.final_error_rad = rotation_angle_rad(p);
  metrics.residual_rate_rad_s = w.norm();
  metrics.kinetic_energy_J = 0.5 * (w.transpose() * spec_.plant.inertia_kg_m2 * w).value();
  metrics.peak_rate_rad_s = peak_rate_rad_s_;
  if (!is_outside_) metrics.settling_time_s = last_outside_s_;
  metrics.angular_impulse_N_m_s = impulse_sum_N_m_s_;
  metrics.control_effort_N2_m2_s = effort_N2_m2_s_;
  if (ideal_ && !is_sampled()) {
    metrics.angular_impulse_N_m_s = state()[integrals_at()];
    metrics.control_effort_N2_m2_s = state()[integrals_at() + 1];
  }
  if (ideal_ && ideal_->gas_flow_m3_s)
    metrics.gas_volume_m3 = is_sampled() ? gas_m3_ : state()[integrals_at() + 2];
  for (std::size_t j = 0; j < valves_.size(); ++j) {
    const Valve& valve = valves_[j];
    auto& on = metrics.thruster_on_time_s;
    auto& firings = metrics.firings;
    on.per_thruster.push_back(valve.on_time_s);
    firings.per_thruster.push_back(valve.firings);
    on.total += valve.on_time_s;
    firings.total += valve.firings;
    if (!valve.thruster.couple_N_m) continue;
    const bool is_positive = j % 2 == 0;
    (is_positive ? on.by_sign.positive : on.by_sign.negative) += valve.on_time_s;
    (is_positive ? firings.by_sign.positive : firings.by_sign.negative) += valve.firings;
  }
  if (const Propellant* propellant = propellant_of(spec_.actuator))
    if (propellant->specific_impulse_s) {
      metrics.propellant_kg = propellant_kg(is_under_way_ ? t_s_ - began_s_ : 0);
      if (propellant->gas_density_kg_m3)
        metrics.gas_volume_m3 = *metrics.propellant_kg / *propellant->gas_density_kg_m3;
    }

  if (const auto* pairs = std::get_if<AxisThrusters>(&spec_.actuator); pairs && pairs->gas_flow_m3_s) {
    double used_m3 = 0;
    for (std::size_t j = 0; j < valves_.size(); ++j)
      used_m3 += valves_[j].on_time_s * (*pairs->gas_flow_m3_s)[static_cast<Eigen::Index>(j) / 2];
    metrics.gas_volume_m3 = used_m3;
  }

  std::vector<double>& row = metrics.final_state;
  row.assign(p.begin(), p.end());
  if (has_quaternion()) row.insert(row.end(), state(), state() + 4);
  row.insert(row.end(), w.begin(), w.end());
  if (spec_.maneuver.tells_euler_angles) {
    const Vector3d angles = euler_angles_123<double>(attitude_of(state()));
    row.insert(row.end(), angles.begin(), angles.end());
  }
  const Wish now = is_sampled() ? held_ : wish(t_s_, state());
  if (has_surface(spec_.law))
    row.insert(row.end(), now.law.surface_rad_s.begin(), now.law.surface_rad_s.end());
  if (spec_.observer) row.insert(row.end(), now.estimate_N_m.begin(), now.estimate_N_m.end());
  if (pwpf_) row.insert(row.end(), state() + filters_at(), state() + filters_at() + lines_.size());
  report.digest = digester_.digest();
  return report;
}

}  // namespace

std::unique_ptr<Run> make_attitude_verification(const AttitudeSpecification& specification) {
  return std::make_unique<SundialsAttitudeRun>(specification);
}

}  // namespace slew
