#include "server/guidance/switch_time_program.hpp"

#include <algorithm>
#include <limits>

namespace slew {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// What the terminal error, in units of t_ref, does with (phi, dw) at the end.
Matrix6 error_of_change(const TerminalError& error, double reference_s) {
  Matrix6 slope = Matrix6::Zero();
  slope.topLeftCorner<3, 3>() = error.attitude;
  slope.bottomRightCorner<3, 3>() = reference_s * Eigen::Matrix3d::Identity();
  return slope;
}

}  // namespace

SwitchTimeProgram::SwitchTimeProgram(const ManeuverProblem& problem, const ManeuverBody& body,
                                     const OnOffProgram& program)
    : problem_(&problem),
      body_(&body),
      shape_(program),
      reference_s_(program.end_s),
      limits_consumption_(problem.most_consumption.has_value()),
      switches_(static_cast<Eigen::Index>(program.switches())),
      flight_(body) {
  Eigen::Index next = 0;
  for (const auto& times : program.switch_times_s) {
    first_.push_back(next);
    next += static_cast<Eigen::Index>(times.size());
  }
  const auto controls = static_cast<Eigen::Index>(program.controls.size());
  if (limits_consumption_) consumption_scale_ = std::max(*problem.most_consumption, 1e-12);
  nonlinear_.least = Eigen::VectorXd::Zero(switches_ + 1);
  nonlinear_.most = Eigen::VectorXd::Constant(switches_ + 1, std::numeric_limits<double>::infinity());
  nonlinear_.least[switches_] = 0.02;
  nonlinear_.most[switches_] = std::min(2.0, problem.longest_s.value_or(1e9) / reference_s_);
  nonlinear_.equals = 6;
  nonlinear_.positives = controls + (limits_consumption_ ? 1 : 0);
  if (problem.most_rate_rad_s) nonlinear_.positives += 3 * (2 * switches_ + 1);
  nonlinear_.evaluate = [this](const Eigen::VectorXd& variables, NonlinearValues& values) {
    evaluate(variables, values);
  };
}

Eigen::VectorXd SwitchTimeProgram::variables(const OnOffProgram& program) const {
  Eigen::VectorXd variables(switches_ + 1);
  for (std::size_t i = 0; i < program.controls.size(); ++i) {
    double before = 0;
    for (std::size_t k = 0; k < program.switch_times_s[i].size(); ++k) {
      const double time = program.switch_times_s[i][k];
      variables[first_[i] + static_cast<Eigen::Index>(k)] = (time - before) / reference_s_;
      before = time;
    }
  }
  variables[switches_] = program.end_s / reference_s_;
  return variables;
}

OnOffProgram SwitchTimeProgram::program(const Eigen::VectorXd& variables) const {
  OnOffProgram program = shape_;
  program.end_s = reference_s_ * variables[switches_];
  for (std::size_t i = 0; i < program.controls.size(); ++i) {
    double time = 0;
    for (std::size_t k = 0; k < program.switch_times_s[i].size(); ++k) {
      time += reference_s_ * variables[first_[i] + static_cast<Eigen::Index>(k)];
      program.switch_times_s[i][k] = time;
    }
  }
  return program;
}

SwitchTimeProgram::Slopes SwitchTimeProgram::slopes(const OnOffProgram& program) const {
  flight_.fly(program, problem_->initial);
  const FlownPoint& end = flight_.end();
  const TerminalError error({end.attitude, end.rate_rad_s}, problem_->final);
  const Matrix6 change = error_of_change(error, reference_s_);
  const Matrix6 to_end = change * end.transition;
  Slopes slopes;
  slopes.error = error.value;
  slopes.error.tail<3>() *= reference_s_;
  slopes.error_slope.resize(6, switches_ + 1);
  slopes.consumption_slope.resize(switches_ + 1);
  for (std::size_t k = 0; k < flight_.switches().size(); ++k) {
    const FlownSwitch& flown = flight_.switches()[k];
    const Eigen::Index column = first_[static_cast<std::size_t>(flown.control)] + flown.index;
    const Matrix6 inverse = inverse_transition(flight_.at_switch(k).transition, body_->plant.is_free());
    const Eigen::Vector3d jump = (flown.before - flown.after) * body_->acceleration_rad_s2.col(flown.control);
    const Vector6 at_start = inverse.rightCols<3>() * jump;
    slopes.error_slope.col(column) = reference_s_ * (to_end * at_start);
    slopes.consumption_slope[column] =
        body_->plant.consumption(flown.control) * (std::abs(flown.before) - std::abs(flown.after));
  }
  slopes.error_slope.col(switches_) =
      reference_s_ * (change * flight_.drift_at(end, flight_.controls_at_end()));
  double consumption = 0;
  for (Eigen::Index i = 0; i < body_->plant.controls(); ++i)
    consumption += body_->plant.consumption(i) * std::abs(flight_.controls_at_end()[i]);
  slopes.consumption_slope[switches_] = consumption;
  return slopes;
}

void SwitchTimeProgram::evaluate(const Eigen::VectorXd& variables, NonlinearValues& values) {
  const OnOffProgram flown = program(variables);
  const bool limits_rate = problem_->most_rate_rad_s.has_value();
  const Eigen::Index n = switches_ + 1;
  // Slopes with the switch times; then lengths: a length moves all later switches of its control.
  const Slopes slope = slopes(flown);
  const auto in_lengths = [&](Eigen::MatrixXd rows) {
    for (std::size_t i = 0; i < flown.controls.size(); ++i)
      for (Eigen::Index k = static_cast<Eigen::Index>(flown.switch_times_s[i].size()) - 2; k >= 0; --k)
        rows.col(first_[i] + k) += rows.col(first_[i] + k + 1);
    return rows;
  };
  values.objective = variables[switches_];
  values.slope = Eigen::VectorXd::Unit(n, switches_);
  values.equal = slope.error;
  values.equal_slope = in_lengths(slope.error_slope);
  values.positive.setZero(nonlinear_.positives);
  values.positive_slope.setZero(nonlinear_.positives, n);
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < flown.controls.size(); ++i, ++row) {
    const auto count = static_cast<Eigen::Index>(flown.switch_times_s[i].size());
    values.positive[row] = variables[switches_] - variables.segment(first_[i], count).sum();
    values.positive_slope(row, switches_) = 1;
    values.positive_slope.row(row).segment(first_[i], count).setConstant(-1);
  }
  if (limits_consumption_) {
    values.positive[row] =
        (*problem_->most_consumption - consumption_of(flown, body_->plant)) / consumption_scale_;
    values.positive_slope.row(row) =
        -reference_s_ / consumption_scale_ * in_lengths(slope.consumption_slope.transpose());
    ++row;
  }
  if (!limits_rate) return;
  // Of |w_i| the square, at the switches and in the middles of long arcs.
  flight_.fly(flown, problem_->initial, true);
  const auto& switches = flight_.switches();
  const Eigen::Index rows = nonlinear_.positives;
  std::vector<Matrix6> inverses;
  for (std::size_t k = 0; k < switches.size(); ++k)
    inverses.push_back(inverse_transition(flight_.at_switch(k).transition, body_->plant.is_free()));
  Eigen::VectorXd control(body_->plant.controls());
  for (Eigen::Index i = 0; i < control.size(); ++i) control[i] = flown.controls[i].front();
  std::size_t passed = 0;
  const Eigen::Index begin = row;
  values.positive.tail(rows - begin).setOnes();
  for (std::size_t p = 1; p + 1 < flight_.points().size() && row + 3 <= rows; ++p) {
    const FlownPoint& point = flight_.points()[p];
    const bool is_switch = passed < switches.size() && flight_.switch_point(passed) == p;
    Eigen::MatrixXd w_slope = Eigen::MatrixXd::Zero(3, n);
    for (std::size_t k = 0; k < passed; ++k) {
      const FlownSwitch& before = switches[k];
      const Eigen::Vector3d jump =
          (before.before - before.after) * body_->acceleration_rad_s2.col(before.control);
      w_slope.col(first_[static_cast<std::size_t>(before.control)] + before.index) =
          point.transition.bottomRows<3>() * (inverses[k].rightCols<3>() * jump);
    }
    // A point moves with its switch; a middle with the switches (or the end) on both sides of it.
    const Eigen::Vector3d drift = flight_.drift_at(point, control).tail<3>();
    const auto moves_with = [&](std::size_t k, double part) {
      const Eigen::Index column =
          k == switches.size() ? switches_
                               : first_[static_cast<std::size_t>(switches[k].control)] + switches[k].index;
      w_slope.col(column) += part * drift;
    };
    if (is_switch) {
      moves_with(passed, 1);
    } else {
      moves_with(passed, 0.5);
      if (passed > 0) moves_with(passed - 1, 0.5);
    }
    w_slope = reference_s_ * in_lengths(w_slope);
    for (int i = 0; i < 3; ++i, ++row) {
      const double most = (*problem_->most_rate_rad_s)[i];
      const double part = point.rate_rad_s[i] / most;
      values.positive[row] = 1 - part * part;
      values.positive_slope.row(row) = -2 * part / most * w_slope.row(i);
    }
    if (is_switch) {
      control[switches[passed].control] = switches[passed].after;
      ++passed;
    }
  }
}

}  // namespace slew
