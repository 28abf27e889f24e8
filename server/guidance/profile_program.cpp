#include "server/guidance/profile_program.hpp"

#include <algorithm>
#include <limits>

namespace slew {

namespace {

// In each of so many parts of the maneuver the largest rate is held under its limit.
constexpr Eigen::Index kRateWindows = 16;

}  // namespace

ProfileLayout profile_layout(const ManeuverProblem& problem) {
  ProfileLayout layout;
  layout.family = problem.family;
  layout.controls = static_cast<std::size_t>(problem.plant.controls());
  layout.switches = problem.switches.empty() ? std::vector<int>(layout.controls, 1) : problem.switches;
  return layout;
}

std::vector<ProfileParameter> profile_parameters(const ManeuverProblem& problem,
                                                 const ProfileLayout& layout) {
  std::vector<ProfileParameter> parameters(layout.size());
  for (std::size_t i = 0; i < layout.controls; ++i) {
    parameters[layout.amplitude(i)] = {0.5, -1, 1, false};
    if (layout.family == ProfileFamily::impulses) {
      parameters[layout.last_peak(i)] = {-0.5, -1, 1, false};
      const bool is_given = !problem.t1.empty();
      parameters[layout.t1(i)] = {is_given ? problem.t1[i] : 0.05, problem.least_t1, problem.most_t1,
                                  is_given};
      continue;
    }
    const int count = layout.switches[i];
    for (int j = 0; j < count; ++j)
      parameters[layout.first_switch(i) + static_cast<std::size_t>(j)] = {(j + 0.5) / count, 0, 1, false};
    const double alpha = !problem.smoothness.empty() ? problem.smoothness[i] : count > 1 ? 0.005 : 0.01;
    parameters[layout.smoothness(i)] = {alpha, problem.least_smoothness, problem.most_smoothness,
                                        !problem.smoothness_is_free};
  }
  if (layout.family == ProfileFamily::smooth_switches)
    parameters[layout.rise()] = {problem.rise, problem.least_rise, problem.most_rise, !problem.rise_is_free};
  for (std::size_t k = 0; k < std::min(parameters.size(), problem.parameters.size()); ++k)
    parameters[k] = problem.parameters[k];
  return parameters;
}

ProfileProgram::ProfileProgram(const ManeuverProblem& problem, const ManeuverBody& body,
                               const ProfileLayout& layout, std::vector<ProfileParameter> parameters,
                               double reference_s)
    : problem_(&problem),
      parameters_(std::move(parameters)),
      reference_s_(reference_s),
      flight_(body, layout) {
  for (std::size_t k = 0; k < parameters_.size(); ++k)
    if (!parameters_[k].is_fixed) free_.push_back(k);
  const auto n = static_cast<Eigen::Index>(free_.size()) + 1;
  nonlinear_.least.resize(n);
  nonlinear_.most.resize(n);
  for (std::size_t k = 0; k < free_.size(); ++k) {
    nonlinear_.least[static_cast<Eigen::Index>(k)] = parameters_[free_[k]].least;
    nonlinear_.most[static_cast<Eigen::Index>(k)] = parameters_[free_[k]].most;
  }
  nonlinear_.least[n - 1] = 0.1;
  nonlinear_.most[n - 1] = std::min(4.0, problem.longest_s.value_or(1e9) / reference_s);
  nonlinear_.equals = 6;
  nonlinear_.positives =
      (problem.most_consumption ? 1 : 0) + (problem.most_rate_rad_s ? 3 * kRateWindows : 0);
  nonlinear_.evaluate = [this](const Eigen::VectorXd& variables, NonlinearValues& values) {
    evaluate(variables, values);
  };
}

Eigen::VectorXd ProfileProgram::start() const {
  Eigen::VectorXd variables(static_cast<Eigen::Index>(free_.size()) + 1);
  for (std::size_t k = 0; k < free_.size(); ++k)
    variables[static_cast<Eigen::Index>(k)] = parameters_[free_[k]].start;
  variables[variables.size() - 1] = 1;
  return variables;
}

std::vector<double> ProfileProgram::parameters(const Eigen::VectorXd& variables) const {
  std::vector<double> parameters(parameters_.size());
  for (std::size_t k = 0; k < parameters.size(); ++k) parameters[k] = parameters_[k].start;
  for (std::size_t k = 0; k < free_.size(); ++k)
    parameters[free_[k]] = variables[static_cast<Eigen::Index>(k)];
  return parameters;
}

void ProfileProgram::evaluate(const Eigen::VectorXd& variables, NonlinearValues& values) {
  const Eigen::Index n = variables.size();
  flight_.fly(parameters(variables), time_s(variables), problem_->initial, free_,
              problem_->most_rate_rad_s.has_value());
  const ProfilePoint& end = flight_.end();
  const TerminalError error({end.attitude, end.rate_rad_s}, problem_->final);
  // The time's column is per second.
  const auto scaled = [&](Eigen::MatrixXd rows) {
    rows.col(n - 1) *= reference_s_;
    return rows;
  };
  values.objective = 0.5 * variables[n - 1] * variables[n - 1];
  values.slope = variables[n - 1] * Eigen::VectorXd::Unit(n, n - 1);
  values.equal.resize(6);
  values.equal.head<3>() = error.value.head<3>();
  values.equal.tail<3>() = reference_s_ * error.value.tail<3>();
  values.equal_slope.resize(6, n);
  values.equal_slope.topRows(3) = error.attitude * end.sensitivity.topRows<3>();
  values.equal_slope.bottomRows(3) = reference_s_ * end.sensitivity.bottomRows<3>();
  values.equal_slope = scaled(values.equal_slope);
  values.positive.setOnes(nonlinear_.positives);
  values.positive_slope.setZero(nonlinear_.positives, n);
  Eigen::Index row = 0;
  if (problem_->most_consumption) {
    const double most = std::max(*problem_->most_consumption, 1e-12);
    values.positive[row] = (most - flight_.consumption()) / most;
    values.positive_slope.row(row) = scaled(flight_.consumption_slope().transpose()) / -most;
    ++row;
  }
  if (!problem_->most_rate_rad_s) return;
  for (const ProfilePoint& point : flight_.points()) {
    const Eigen::Index window = std::min(kRateWindows - 1, static_cast<Eigen::Index>(point.t * kRateWindows));
    for (int axis = 0; axis < 3; ++axis) {
      const double part = point.rate_rad_s[axis] / (*problem_->most_rate_rad_s)[axis];
      const Eigen::Index at = row + 3 * window + axis;
      if (1 - part * part >= values.positive[at]) continue;
      values.positive[at] = 1 - part * part;
      values.positive_slope.row(at) =
          scaled(point.sensitivity.row(3 + axis)) * (-2 * part / (*problem_->most_rate_rad_s)[axis]);
    }
  }
}

}  // namespace slew
