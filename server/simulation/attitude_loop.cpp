#include "server/simulation/attitude_loop.hpp"

#include <algorithm>
#include <cmath>

#include "server/actuator/pwpf_filter.hpp"

namespace slew {
namespace {

using Eigen::Vector3d;
using Vector = Eigen::Map<Vector3d>;
using ConstVector = Eigen::Map<const Vector3d>;

// What channels or controls are asked for by a torque, where they are not about the body's axes.
std::optional<Eigen::Matrix3d> inverse_influence(const AttitudeActuator& actuator) {
  if (const auto* pairs = std::get_if<AxisThrusters>(&actuator))
    if (!pairs->axes.isIdentity(0)) return pairs->axes.inverse();
  if (const auto* ideal = std::get_if<IdealTorque>(&actuator))
    if (ideal->influence_N_m) return ideal->influence_N_m->inverse();
  return std::nullopt;
}

}  // namespace

std::vector<Thruster> thrusters_of(const AttitudeActuator& actuator) {
  if (const auto* mounted = std::get_if<MountedThrusters>(&actuator)) return mounted->thrusters;
  std::vector<Thruster> thrusters;
  if (const auto* pairs = std::get_if<AxisThrusters>(&actuator))
    for (int axis = 0; axis < 3; ++axis)
      for (const int sign : {1, -1}) {
        Thruster thruster = pairs->valve;
        thruster.couple_N_m = sign * pairs->torque_N_m[axis] * pairs->axes.col(axis);
        thruster.thrust_N = pairs->torque_N_m[axis] / pairs->lever_arm_m.value_or(1);
        thrusters.push_back(thruster);
      }
  return thrusters;
}

const Propellant* propellant_of(const AttitudeActuator& actuator) {
  if (const auto* mounted = std::get_if<MountedThrusters>(&actuator)) return &mounted->propellant;
  if (const auto* pairs = std::get_if<AxisThrusters>(&actuator)) return &pairs->propellant;
  return nullptr;
}

AttitudeLoop::AttitudeLoop(const AttitudeSpecification& specification)
    : spec_(specification),
      inverse_inertia_(specification.plant.inertia_kg_m2.inverse()),
      demand_of_torque_(inverse_influence(spec_.actuator)),
      ideal_(std::get_if<IdealTorque>(&spec_.actuator)),
      attitude_size_(spec_.plant.attitude == AttitudeParameters::mrp ? 3 : 4) {
  if (const auto* pairs = std::get_if<AxisThrusters>(&spec_.actuator)) {
    modulator_ = &pairs->modulator;
    for (int axis = 0; axis < 3; ++axis) channels_.push_back({pairs->torque_N_m[axis], true});
  }
  if (const auto* mounted = std::get_if<MountedThrusters>(&spec_.actuator)) {
    modulator_ = &mounted->modulator;
    allocation_.emplace(mounted->thrusters, mounted->allocation);
    for (const Thruster& thruster : mounted->thrusters) channels_.push_back({thruster.thrust_N, false});
  }
  acts_within_steps_ = !is_sampled();
  if (acts_within_steps_) {
    if (pwpf()) filters_ = channels_.size();
    observes_ = spec_.observer.has_value();
  }
  needs_law_ = acts_within_steps_ && (ideal_ || observes_);
}

const PwpfModulator* AttitudeLoop::pwpf() const {
  return modulator_ ? std::get_if<PwpfModulator>(modulator_) : nullptr;
}

AttitudeState AttitudeLoop::initial_state() const {
  AttitudeState state{};
  const AttitudeManeuver& maneuver = spec_.maneuver;
  if (attitude_size_ == 3)
    Vector(state.data()) = maneuver.initial_mrp;
  else
    Eigen::Map<Eigen::Vector4d>(state.data()) = euler_parameters<double>(maneuver.initial_mrp);
  Vector(state.data() + rate_at()) = maneuver.initial_rate_rad_s;
  if (!observes_) return state;
  const AttitudeSight<double> sight{maneuver.initial_mrp, maneuver.initial_rate_rad_s,
                                    maneuver.reference.at(0), 0, 0};
  const ObserverState<double> q =
      initial_observer_state<double>(*spec_.observer, command(spec_.law, sight).surface_rad_s);
  for (std::size_t i = 0; i < 3; ++i) Vector(state.data() + observer_at() + 3 * i) = q[i];
  return state;
}

AttitudeState AttitudeLoop::absolute_tolerances(double relative) const {
  AttitudeState absolute{};
  std::fill_n(absolute.begin(), observer_at(), relative);
  if (!observes_) return absolute;
  // Q holds K1 s with the other sign: no better than the rates times K1.
  const std::array<double, 3> gains = observer_gains(spec_.observer->pole_rad_s);
  const double inertia = spec_.observer->inertia_kg_m2.cwiseAbs().maxCoeff();
  for (std::size_t i = 0; i < 9; ++i) absolute[observer_at() + i] = relative * gains[i / 3] * inertia;
  return absolute;
}

Vector3d AttitudeLoop::mrp_of(const double* state) const {
  if (attitude_size_ == 3) return ConstVector(state);
  return mrp<double>(Eigen::Map<const Eigen::Vector4d>(state));
}

[[gnu::flatten]] AttitudeDemand AttitudeLoop::demand(const AttitudeHold& hold, double t_s,
                                                     const double* state) const {
  AttitudeSight<double> sight{mrp_of(state), rate_of(state), {}, hold.began_s, t_s};
  if (!spec_.maneuver.reference.is_fixed()) sight.reference = spec_.maneuver.reference.at(t_s, hold.began_s);
  AttitudeDemand demand;
  demand.law = command(spec_.law, sight);
  demand.torque_N_m = demand.law.torque_N_m;
  if (!observes_) return demand;
  const double* q = state + observer_at();
  demand.estimate_N_m = estimated_disturbance<double>(
      *spec_.observer, {ConstVector(q), ConstVector(q + 3), ConstVector(q + 6)}, demand.law.surface_rad_s)[0];
  demand.torque_N_m -= demand.estimate_N_m;
  return demand;
}

void AttitudeLoop::allocate(const AttitudeHold& hold, double t_s, const Vector3d& torque_N_m,
                            std::span<double> demands) const {
  // A plan says what each channel does; its torque alone does not where there is more than one way.
  if (const auto* law = std::get_if<PlannedTorque>(&spec_.law); law && law->planned) {
    for (std::size_t c = 0; c < demands.size(); ++c)
      demands[c] =
          channels_[c].level * law->planned->control(static_cast<Eigen::Index>(c), t_s, hold.began_s);
    return;
  }
  if (allocation_) return allocation_->allocate(torque_N_m, demands);
  const Vector3d demand = demand_of_torque_ ? *demand_of_torque_ * torque_N_m : torque_N_m;
  for (int axis = 0; axis < 3; ++axis) demands[axis] = demand[axis];
}

double AttitudeLoop::filter_limit(std::size_t channel, double demand, int output) const {
  return pwpf_target(*pwpf(), channels_[channel].level, demand, output);
}

Vector3d AttitudeLoop::limited(const Vector3d& torque_N_m) const {
  if (ideal_ && ideal_->influence_N_m)
    return *ideal_->influence_N_m * controls(torque_N_m).cwiseMax(-1).cwiseMin(1);
  if (!ideal_ || !ideal_->maximum_N_m) return torque_N_m;
  return torque_N_m.cwiseMax(-*ideal_->maximum_N_m).cwiseMin(*ideal_->maximum_N_m);
}

Vector3d AttitudeLoop::controls(const Vector3d& torque_N_m) const {
  if (demand_of_torque_) return *demand_of_torque_ * torque_N_m;
  return ideal_ && ideal_->maximum_N_m ? Vector3d(torque_N_m.cwiseQuotient(*ideal_->maximum_N_m))
                                       : torque_N_m;
}

Vector4<double> AttitudeLoop::attitude_of(const double* state) const {
  const Vector4<double> relative =
      attitude_size_ == 3 ? euler_parameters<double>(ConstVector(state))
                          : Vector4<double>(Eigen::Map<const Eigen::Vector4d>(state).normalized());
  return euler_parameter_product<double>(spec_.maneuver.final_attitude, relative);
}

Vector3d AttitudeLoop::torque(const AttitudeHold& hold, double t_s, const AttitudeDemand& demand) const {
  if (ideal_ && acts_within_steps_) return limited(demand.torque_N_m);
  return held_torque(hold, t_s);
}

// Of attitude and rate.
[[gnu::always_inline]] inline void AttitudeLoop::move_body(const AttitudeHold& hold, double t_s,
                                                           const Vector3d& torque_N_m,
                                                           const AttitudeState& state,
                                                           AttitudeState& slope) const {
  const Vector3d w = rate_of(state.data());
  if (attitude_size_ == 3)
    Vector(slope.data()) = mrp_rate<double>(ConstVector(state.data()), w);
  else
    Eigen::Map<Eigen::Vector4d>(slope.data()) =
        euler_parameter_rate<double>(Eigen::Map<const Eigen::Vector4d>(state.data()), w);
  Vector3d outer = torque_N_m + hold.disturbance_N_m;
  if (!spec_.plant.is_free())
    outer += pedestal_moment<double>(spec_.plant.weight, spec_.plant.springs, attitude_of(state.data()));
  for (const BodySinusoid& one : spec_.disturbances.sinusoids)
    outer += std::sin(one.frequency_rad_s * t_s + one.phase_rad) * one.amplitude_N_m;
  Vector(slope.data() + rate_at()) =
      angular_acceleration<double>(spec_.plant.inertia_kg_m2, inverse_inertia_, w, outer);
}

[[gnu::flatten]] void AttitudeLoop::slope(const AttitudeHold& hold, double t_s, const AttitudeState& state,
                                          AttitudeState& slope) const {
  if (!needs_law_) return move_body(hold, t_s, held_torque(hold, t_s), state, slope);
  const AttitudeDemand demand = this->demand(hold, t_s, state.data());
  const Vector3d torque = this->torque(hold, t_s, demand);
  move_body(hold, t_s, torque, state, slope);

  if (filters_ > 0) {
    std::array<double, kMaxThrusters> demands;
    allocate(hold, t_s, demand.torque_N_m, std::span(demands).first(channels_.size()));
    const double time_constant = pwpf()->time_constant_s;
    for (std::size_t c = 0; c < filters_; ++c)
      slope[filters_at() + c] =
          (filter_limit(c, demands[c], hold.outputs[c]) - state[filters_at() + c]) / time_constant;
  }
  if (!observes_) return;
  Vector3d input = torque;
  if (spec_.observer->feeding == ObserverFeeding::applied_minus_equivalent)
    input -= demand.law.equivalent_N_m;
  if (spec_.observer->feeding == ObserverFeeding::commanded)
    input = demand.torque_N_m - demand.law.equivalent_N_m;
  const double* q = state.data() + observer_at();
  const ObserverState<double> z = estimated_disturbance<double>(
      *spec_.observer, {ConstVector(q), ConstVector(q + 3), ConstVector(q + 6)}, demand.law.surface_rad_s);
  const ObserverState<double> moves = observer_slope<double>(*spec_.observer, z, input);
  for (std::size_t i = 0; i < 3; ++i) Vector(slope.data() + observer_at() + 3 * i) = moves[i];
}

void AttitudeLoop::switch_to_shadow(AttitudeState& state) const {
  if (attitude_size_ == 3)
    Vector(state.data()) = mrp_shadow<double>(ConstVector(state.data()));
  else
    for (std::size_t i = 0; i < 4; ++i) state[i] = -state[i];
}

Vector3d AttitudeLoop::surface(const AttitudeHold& hold, double t_s, const double* state) const {
  return demand(hold, t_s, state).law.surface_rad_s;
}

void AttitudeLoop::jump(AttitudeState& state, const Vector3d& surface_jump_rad_s) const {
  if (!observes_) return;
  const std::array<double, 3> gains = observer_gains(spec_.observer->pole_rad_s);
  for (std::size_t i = 0; i < 3; ++i)
    Vector(state.data() + observer_at() + 3 * i) -=
        gains[i] * spec_.observer->inertia_kg_m2 * surface_jump_rad_s;
}

}  // namespace slew
