#include "server/actuator/thruster_bank.hpp"

#include <algorithm>
#include <cmath>

#include "server/actuator/propellant.hpp"

namespace slew {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// A direction turned by two small rotations about axes across it.
Eigen::Vector3d misaligned(const Thruster& thruster, std::uint64_t seed, std::uint32_t index) {
  if (thruster.misalignment_rad == 0) return thruster.direction;
  const RandomStream stream(seed, RandomUse::misalignment, index);
  const Eigen::Vector3d across = thruster.direction.unitOrthogonal();
  const Eigen::Vector3d other = thruster.direction.cross(across);
  return (thruster.direction +
          thruster.misalignment_rad * (stream.normal(0) * across + stream.normal(1) * other))
      .normalized();
}

Eigen::Vector3d true_torque_N_m(const Thruster& thruster, std::uint64_t seed, std::uint32_t index) {
  if (thruster.couple_N_m) return *thruster.couple_N_m;
  return thruster.thrust_N * thruster.position_m.cross(misaligned(thruster, seed, index));
}

}  // namespace

ThrusterBank::ThrusterBank(std::vector<Thruster> thrusters, const Propellant& propellant,
                           std::uint64_t seed) {
  auto model = std::make_shared<Model>();
  model->propellant = propellant;
  for (std::uint32_t j = 0; j < thrusters.size(); ++j) {
    model->torque_N_m.push_back(true_torque_N_m(thrusters[j], seed, j));
    model->noise.emplace_back(seed, RandomUse::thruster_noise, j);
  }
  model->thrusters = std::move(thrusters);
  model_ = std::move(model);
  arrive(0);
}

double ThrusterBank::shortest_command_s(std::size_t j) const {
  const Thruster& thruster = model_->thrusters[j];
  if (thruster.minimum_on_time_of == MinimumOnTimeOf::valve_command) return thruster.minimum_on_time_s;
  return std::max(0.0, thruster.minimum_on_time_s - 0.5 * (thruster.fall_s - thruster.rise_s));
}

bool ThrusterBank::command(double t_s, std::size_t j, bool is_open) {
  State& state = states_[j];
  const Thruster& thruster = model_->thrusters[j];
  const double at_s = t_s + (is_open ? thruster.on_delay_s : thruster.off_delay_s);
  if (state.count > 0 && at_s <= state.arrivals[(state.first + state.count - 1) % kOnTheirWay].at_s) {
    --state.count;
  } else {
    if (state.count == kOnTheirWay) return false;
    state.arrivals[(state.first + state.count++) % kOnTheirWay] = {at_s, is_open};
  }
  arrive(t_s);
  return true;
}

void ThrusterBank::arrive(double t_s) {
  // The last of the gas leaves where rounding puts it.
  if (model_->propellant.tank_kg && !is_empty_ && empty_s(t_s) <= t_s) {
    is_empty_ = true;
    for (std::size_t j = 0; j < size(); ++j) move_to(t_s, j, 0);
  }
  for (std::size_t j = 0; j < size(); ++j) {
    State& state = states_[j];
    if (state.until_s <= t_s && state.slope_1_s != 0) move_to(t_s, j, state.is_open ? state.full : 0);
    while (state.count > 0 && state.arrivals[state.first].at_s <= t_s) {
      state.is_told_open = state.arrivals[state.first].is_open;
      state.first = (state.first + 1) % kOnTheirWay;
      --state.count;
    }
    set_valve(t_s, j);
  }
  begin_piece(t_s);
}

void ThrusterBank::set_valve(double t_s, std::size_t j) {
  State& state = states_[j];
  const Thruster& thruster = model_->thrusters[j];
  bool is_open = state.is_told_open;
  // What broke first stays.
  if (t_s >= std::min(thruster.stuck_open_from_s, thruster.stuck_closed_from_s))
    is_open = thruster.stuck_open_from_s < thruster.stuck_closed_from_s;
  if (is_empty_) is_open = false;
  if (is_open == state.is_open) return;
  state.is_open = is_open;
  if (is_open) {
    state.full = 1;
    if (thruster.noise > 0)
      state.full = std::max(0.0, 1 + thruster.noise * model_->noise[j].normal(state.firings));
    ++state.firings;
    state.opened_s = t_s;
  } else {
    state.on_time_s += t_s - state.opened_s;
  }
  move_to(t_s, j, is_open ? state.full : 0);
}

// The level goes to the target at the rate of rise or fall; with no gas left it is gone at once.
void ThrusterBank::move_to(double t_s, std::size_t j, double target) {
  State& state = states_[j];
  const Thruster& thruster = model_->thrusters[j];
  state.impulse_s = impulse_s(j, t_s);
  state.level = t_s >= state.until_s && state.slope_1_s != 0 ? target : level_at(j, t_s);
  state.since_s = t_s;
  const double whole_s = is_empty_ ? 0 : target > state.level ? thruster.rise_s : thruster.fall_s;
  if (whole_s > 0 && state.level != target && state.full > 0) {
    state.slope_1_s = (target > state.level ? state.full : -state.full) / whole_s;
    state.until_s = t_s + (target - state.level) / state.slope_1_s;
  } else {
    state.level = target;
    state.slope_1_s = 0;
    state.until_s = kNever;
  }
}

double ThrusterBank::level_at(std::size_t j, double t_s) const {
  const State& state = states_[j];
  return state.level + state.slope_1_s * (t_s - state.since_s);
}

double ThrusterBank::impulse_s(std::size_t j, double t_s) const {
  const State& state = states_[j];
  const double h = t_s - state.since_s;
  return state.impulse_s + h * (state.level + 0.5 * h * state.slope_1_s);
}

double ThrusterBank::on_time_s(std::size_t j, double t_s) const {
  const State& state = states_[j];
  return state.on_time_s + (state.is_open ? t_s - state.opened_s : 0);
}

double ThrusterBank::mass_flow_kg_s(std::size_t j) const {
  return model_->thrusters[j].thrust_N / (*model_->propellant.specific_impulse_s * kStandardGravity_m_s2);
}

std::optional<double> ThrusterBank::propellant_kg(double t_s) const {
  if (!model_->propellant.specific_impulse_s) return std::nullopt;
  double sum_kg = 0;
  for (std::size_t j = 0; j < size(); ++j) sum_kg += mass_flow_kg_s(j) * impulse_s(j, t_s);
  return sum_kg;
}

// When what is flowing at t will have used up the tank: flow + change h/2 per second on the average.
double ThrusterBank::empty_s(double t_s) const {
  const double left_kg = *model_->propellant.tank_kg - propellant_kg(t_s).value_or(0);
  double flow = 0, change = 0;
  for (std::size_t j = 0; j < size(); ++j) {
    flow += mass_flow_kg_s(j) * level_at(j, t_s);
    change += mass_flow_kg_s(j) * states_[j].slope_1_s;
  }
  constexpr double kRounding = 1e-13;
  if (left_kg <= kRounding * *model_->propellant.tank_kg) return t_s;
  const double square = flow * flow + 2 * change * left_kg;
  if (square < 0 || (flow <= 0 && change <= 0)) return kNever;
  return t_s + 2 * left_kg / (flow + std::sqrt(square));
}

void ThrusterBank::begin_piece(double t_s) {
  began_s_ = t_s;
  torque_N_m_.setZero();
  slope_N_m_s_.setZero();
  next_s_ = kNever;
  for (std::size_t j = 0; j < size(); ++j) {
    const State& state = states_[j];
    const double level = level_at(j, t_s);
    if (level != 0) torque_N_m_ += level * model_->torque_N_m[j];
    if (state.slope_1_s != 0) {
      slope_N_m_s_ += state.slope_1_s * model_->torque_N_m[j];
      next_s_ = std::min(next_s_, state.until_s);
    }
    if (state.count > 0) next_s_ = std::min(next_s_, state.arrivals[state.first].at_s);
    const Thruster& thruster = model_->thrusters[j];
    const double stuck_s = std::min(thruster.stuck_open_from_s, thruster.stuck_closed_from_s);
    if (stuck_s > t_s) next_s_ = std::min(next_s_, stuck_s);
  }
  if (model_->propellant.tank_kg && !is_empty_) next_s_ = std::min(next_s_, empty_s(t_s));
}

}  // namespace slew
