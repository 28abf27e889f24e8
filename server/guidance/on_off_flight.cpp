#define EIGEN_NO_DEBUG  // the innermost loop of a plan
#include "server/guidance/on_off_flight.hpp"

#include <algorithm>

#include "server/propagation/cooper_verner.hpp"

namespace slew {

namespace {

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

// A sphere under a constant torque: its rate is linear in time and changes of it stay what they are, so that
// of Y only the integral of C^T is left. x = (q, w, that integral).
struct SphereVariation {
  static constexpr bool kHasResponse = false;
  using State = Eigen::Matrix<double, 16, 1>;

  explicit SphereVariation(const ManeuverBody& given) : body(given) {}

  const ManeuverBody& body;
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();

  void operator()(int, const State& x, State& dx) const {
    const double a = x[0], b = x[1], c = x[2], d = x[3], u = 0.5 * x[4], v = 0.5 * x[5], w = 0.5 * x[6];
    dx[0] = -(b * u + c * v + d * w);
    dx[1] = a * u + c * w - d * v;
    dx[2] = a * v + d * u - b * w;
    dx[3] = a * w + b * v - c * u;
    dx.segment<3>(4) = acceleration;
    const double aa = a * a, bb = b * b, cc = c * c, dd = d * d;
    const double bc = b * c, ad = a * d, bd = b * d, ac = a * c, cd = c * d, ab = a * b;
    dx[7] = aa + bb - cc - dd, dx[8] = 2 * (bc + ad), dx[9] = 2 * (bd - ac);
    dx[10] = 2 * (bc - ad), dx[11] = aa - bb + cc - dd, dx[12] = 2 * (cd + ab);
    dx[13] = 2 * (bd + ac), dx[14] = 2 * (cd - ab), dx[15] = aa - bb - cc + dd;
  }

  void set_torque(const Eigen::Vector3d& given) {
    torque = given;
    acceleration = body.inverse(0, 0) * given;
  }

  State start(const RigidState& given) const {
    State x = State::Zero();
    x.head<4>() = given.attitude;
    x.segment<3>(4) = given.rate_rad_s;
    return x;
  }

  static FlownPoint point(double time_s, const State& x) {
    FlownPoint point;
    point.time_s = time_s;
    point.attitude = x.head<4>();
    point.rate_rad_s = x.segment<3>(4);
    point.transition.setIdentity();
    point.transition.topRightCorner<3, 3>() = Eigen::Map<const Eigen::Matrix3d>(x.data() + 7);
    return point;
  }

  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
};

// The body turns by at most this in a step, rad: then a step of order 8 errs by about 1e-11.
constexpr double kTurnInStep = 0.35;
// Between switches, where signs are looked at.
constexpr int kLeastFineSteps = 8;

}  // namespace

double consumption_of(const OnOffProgram& program, const RigidManeuverPlant& plant) {
  double consumed = 0;
  for (std::size_t i = 0; i < program.controls.size(); ++i) {
    const std::vector<double>&values = program.controls[i], &times_s = program.switch_times_s[i];
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double from = k == 0 ? 0 : times_s[k - 1];
      const double to = k + 1 == values.size() ? program.end_s : times_s[k];
      consumed += plant.consumption(static_cast<Eigen::Index>(i)) * std::abs(values[k]) * (to - from);
    }
  }
  return consumed;
}

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

void OnOffFlight::fly(const OnOffProgram& program, const RigidState& start, double finest_s,
                      bool with_middles) {
  if (body_->is_sphere)
    fly_as<SphereVariation>(program, start, finest_s, with_middles);
  else if (body_->plant.is_free())
    fly_as<Variation<3>>(program, start, finest_s, with_middles);
  else
    fly_as<Variation<6>>(program, start, finest_s, with_middles);
}

void OnOffFlight::fly(const OnOffProgram& program, const RigidState& start, bool with_middles) {
  fly(program, start, 0, with_middles);
}

void OnOffFlight::fly_with_response(const OnOffProgram& program, const RigidState& start, bool with_middles) {
  if (body_->plant.is_free())
    fly_as<Variation<3, 3>>(program, start, 0, with_middles);
  else
    fly_as<Variation<6, 3>>(program, start, 0, with_middles);
}

void OnOffFlight::fly_finely(const OnOffProgram& program, const RigidState& start, double finest_s) {
  fly(program, start, finest_s, false);
}

Eigen::Matrix<double, 6, 1> OnOffFlight::drift_at(const FlownPoint& point,
                                                  const Eigen::VectorXd& control) const {
  Eigen::Matrix<double, 6, 1> drift;
  drift.head<3>() = rotation_matrix_of<double>(point.attitude).transpose() * point.rate_rad_s;
  drift.tail<3>() = rigid_rate<double>(body_->plant, body_->inverse, point.attitude, point.rate_rad_s,
                                       body_->plant.influence_N_m * control)
                        .acceleration_rad_s2;
  return drift;
}

Eigen::Matrix<double, 6, 6> inverse_transition(const Eigen::Matrix<double, 6, 6>& transition, bool is_free) {
  if (!is_free) return transition.inverse();
  Eigen::Matrix<double, 6, 6> inverse = Eigen::Matrix<double, 6, 6>::Identity();
  const Eigen::Matrix3d rate = transition.bottomRightCorner<3, 3>().inverse();
  inverse.bottomRightCorner<3, 3>() = rate;
  inverse.topRightCorner<3, 3>() = -transition.topRightCorner<3, 3>() * rate;
  return inverse;
}

}  // namespace slew
