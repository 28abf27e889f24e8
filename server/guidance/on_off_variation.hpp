// The variational equations of a flight under controls that are constant between switches, and the loop that
// follows them from switch to switch. Everything is inlined into it: a file has no more of these loops than a
// compiler is willing to inline.
#pragma once

#include <algorithm>

#include "server/guidance/on_off_flight.hpp"
#include "server/propagation/cooper_verner.hpp"

namespace slew {

// x = (q, w, Y): Y holds kColumns columns of (phi, dw), and kForced of the forced response. A free body needs
// three, the changes of the rate.
template <int kColumns, int kForced = 0>
struct Variation {
  static constexpr int kSize = 7 + 6 * (kColumns + kForced);
  static constexpr bool kHasResponse = kForced > 0;
  using State = Eigen::Matrix<double, kSize, 1>;

  explicit Variation(const ManeuverBody& given) : body(given) {}

  const ManeuverBody& body;
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();

  void set_torque(const Eigen::Vector3d& given) { torque = given; }

  void operator()(int, const State& x, State& dx) const {
    const Vector4<double> q = x.template head<4>();
    const Eigen::Vector3d w = x.template segment<3>(4);
    const RigidRate<double> rate = rigid_rate<double>(body.plant, body.inverse, q, w, torque);
    dx.template head<4>() = rate.attitude_1_s;
    dx.template segment<3>(4) = rate.acceleration_rad_s2;
    const VariationalRate change = variational_rate(body, q, w);
    for (int column = 0; column < kColumns + kForced; ++column) {
      const auto y = x.template segment<6>(7 + 6 * column);
      auto dy = dx.template segment<6>(7 + 6 * column);
      dy.template head<3>() = change.turn * y.template tail<3>();
      dy.template tail<3>() = change.rate * y.template tail<3>();
      if constexpr (kColumns == 6) dy.template tail<3>() += change.attitude * y.template head<3>();
    }
    for (int forced = 0; forced < kForced; ++forced) dx[7 + 6 * (kColumns + forced) + 3 + forced] += 1;
  }

  State start(const RigidState& given) const {
    State x = State::Zero();
    x.template head<4>() = given.attitude;
    x.template segment<3>(4) = given.rate_rad_s;
    for (int column = 0; column < kColumns; ++column) x[7 + 6 * column + column + 6 - kColumns] = 1;
    return x;
  }

  static FlownPoint point(double time_s, const State& x) {
    FlownPoint point;
    point.time_s = time_s;
    point.attitude = x.template head<4>();
    point.rate_rad_s = x.template segment<3>(4);
    point.transition.setIdentity();
    for (int column = 0; column < kColumns; ++column)
      point.transition.col(column + 6 - kColumns) = x.template segment<6>(7 + 6 * column);
    return point;
  }

  static Eigen::Matrix<double, 6, 3> response(const State& x) {
    return Eigen::Map<const Eigen::Matrix<double, 6, 3>>(x.data() + 7 + 6 * kColumns);
  }
};

// The body turns by at most this in a step, rad: then a step of order 8 errs by about 1e-11.
inline constexpr double kTurnInStep = 0.35;
// Between switches, where signs are looked at.
inline constexpr int kLeastFineSteps = 8;

template <typename Moving>
void OnOffFlight::fly_as(const OnOffProgram& program, const RigidState& start, double finest_s,
                         bool with_middles) {
  switches_.clear();
  points_.clear();
  responses_.clear();
  switch_points_.clear();
  control_.resize(static_cast<Eigen::Index>(program.controls.size()));
  for (std::size_t i = 0; i < program.controls.size(); ++i) {
    control_[static_cast<Eigen::Index>(i)] = program.controls[i].front();
    for (std::size_t k = 0; k < program.switch_times_s[i].size(); ++k)
      switches_.push_back({program.switch_times_s[i][k], static_cast<int>(i), static_cast<int>(k),
                           program.controls[i][k], program.controls[i][k + 1]});
  }
  std::stable_sort(switches_.begin(), switches_.end(),
                   [](const FlownSwitch& a, const FlownSwitch& b) { return a.time_s < b.time_s; });

  Moving variation(*body_);
  typename Moving::State x = variation.start(start);
  double t = 0;
  const auto see = [&](double at_s) {
    points_.push_back(Moving::point(at_s, x));
    if constexpr (Moving::kHasResponse) responses_.push_back(Moving::response(x));
  };
  see(t);
  for (std::size_t k = 0; k <= switches_.size(); ++k) {
    const double to = k == switches_.size() ? program.end_s : switches_[k].time_s;
    const double length = to - t;
    if (length != 0) {
      variation.set_torque(body_->plant.influence_N_m * control_);
      const double acceleration = (body_->inverse * variation.torque).norm();
      const double turn = std::abs(length) * (x.template segment<3>(4).norm() +
                                              acceleration * std::abs(length) + body_->fastest_swing_1_s);
      int steps = 1 + static_cast<int>(std::min(turn / kTurnInStep, 50.0));
      if (finest_s > 0)
        steps = std::max({steps, kLeastFineSteps, 1 + static_cast<int>(std::abs(length) / finest_s)});
      if (with_middles && steps % 2 == 1 && std::abs(length) > 0.05 * program.end_s) ++steps;
      const double h = length / steps;
      for (int i = 0; i < steps; ++i) {
        cooper_verner_step(variation, h, x);
        const bool is_last = i + 1 == steps;
        const bool is_middle = with_middles && 2 * (i + 1) == steps;
        if (!is_last && (finest_s > 0 || is_middle)) see(t + (i + 1) * h);
      }
    }
    t = to;
    see(t);
    if (k == switches_.size()) break;
    switch_points_.push_back(points_.size() - 1);
    control_[switches_[k].control] = switches_[k].after;
  }
}

}  // namespace slew
