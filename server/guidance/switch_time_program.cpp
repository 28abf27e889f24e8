#include "server/guidance/switch_time_program.hpp"

#include <algorithm>
#include <limits>

namespace slew {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// Of the maneuver's time: lengths that differ by less are one length.
constexpr double kSameLength = 1e-9;

// What the terminal error, in units of t_ref, does with (phi, dw) at the end.
Matrix6 error_of_change(const TerminalError& error, double reference_s) {
  Matrix6 slope = Matrix6::Zero();
  slope.topLeftCorner<3, 3>() = error.attitude;
  slope.bottomRightCorner<3, 3>() = reference_s * Eigen::Matrix3d::Identity();
  return slope;
}

// Among the parameters the end comes after all switches, how many these may be.
constexpr Eigen::Index kEnd = -2;

// The forced response until a point, as a change of the start that does the same there.
Eigen::Matrix<double, 6, 3> response_at_start(const OnOffFlight& flight, std::size_t point, bool is_free) {
  return inverse_transition(flight.points()[point].transition, is_free) * flight.response(point);
}

double begin_of(const OnOffProgram& program, std::size_t control, std::size_t segment) {
  return segment == 0 ? 0 : program.switch_times_s[control][segment - 1];
}

double end_of(const OnOffProgram& program, std::size_t control, std::size_t segment) {
  const std::vector<double>& times = program.switch_times_s[control];
  return segment == times.size() ? program.end_s : times[segment];
}

}  // namespace

bool is_throttled(const RigidManeuverPlant& plant, std::size_t control, double u) {
  const auto i = static_cast<Eigen::Index>(control);
  return u > plant.least_control[i] && u < plant.most_control[i] && u != 0;
}

SwitchTimeProgram::SwitchTimeProgram(const ManeuverProblem& problem, const ManeuverBody& body,
                                     const OnOffProgram& program)
    : problem_(&problem),
      body_(&body),
      shape_(program),
      reference_s_(program.end_s),
      limits_consumption_(problem.most_consumption.has_value()),
      flight_(body) {
  find_arcs();
  const auto controls = static_cast<Eigen::Index>(program.controls.size());
  const Eigen::Index n = parameter_count();
  if (limits_consumption_) consumption_scale_ = std::max(*problem.most_consumption, 1e-12);
  nonlinear_.least = Eigen::VectorXd::Zero(n);
  nonlinear_.most = Eigen::VectorXd::Constant(n, std::numeric_limits<double>::infinity());
  nonlinear_.least[switches_] = 0.02;
  nonlinear_.most[switches_] = std::min(2.0, problem.longest_s.value_or(1e9) / reference_s_);
  for (Eigen::Index k = 0; k < levels(); ++k) {
    const Level& level = levels_[static_cast<std::size_t>(k)];
    const auto i = static_cast<Eigen::Index>(level.control);
    nonlinear_.least[switches_ + 1 + k] = body.plant.least_control[i];
    nonlinear_.most[switches_ + 1 + k] = body.plant.most_control[i];
    // |u| bends at zero.
    if (limits_consumption_ && body.plant.consumption(i) > 0)
      (program.controls[level.control][level.segment] > 0 ? nonlinear_.least
                                                          : nonlinear_.most)[switches_ + 1 + k] = 0;
  }
  nonlinear_.equals = 6;
  nonlinear_.positives = controls + (limits_consumption_ ? 1 : 0);
  if (problem.most_rate_rad_s)
    nonlinear_.positives += 3 * (2 * static_cast<Eigen::Index>(program.switches()) + 1);
  nonlinear_.evaluate = [this](const Eigen::VectorXd& variables, NonlinearValues& values) {
    evaluate(variables, values);
  };
}

void SwitchTimeProgram::find_arcs() {
  const double apart = kSameLength * shape_.end_s;
  for (std::size_t i = 0; i < shape_.controls.size(); ++i) {
    const std::vector<double>& values = shape_.controls[i];
    const auto length = [&](std::size_t k) { return end_of(shape_, i, k) - begin_of(shape_, i, k); };
    std::vector<Arc> arcs;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const bool is_free = is_throttled(body_->plant, i, values[k]);
      if (is_free) levels_.push_back({i, k});
      const bool goes_on = is_free && k > 0 && is_throttled(body_->plant, i, values[k - 1]) &&
                           std::abs(length(k) - length(k - 1)) <= apart;
      if (goes_on)
        ++arcs.back().pieces;
      else
        arcs.push_back({k, 1});
    }
    first_.push_back(switches_);
    count_.push_back(static_cast<Eigen::Index>(arcs.size()) - 1);
    std::vector<Place> places;
    for (std::size_t a = 0; a < arcs.size(); ++a) {
      const bool is_last = a + 1 == arcs.size();
      const auto at = static_cast<Eigen::Index>(a);
      const Eigen::Index before = a == 0 ? -1 : switches_ + at - 1;
      const Eigen::Index after = is_last ? kEnd : switches_ + at;
      for (std::size_t k = 1; k < arcs[a].pieces; ++k)
        places.push_back({before, after, static_cast<double>(k) / static_cast<double>(arcs[a].pieces)});
      if (!is_last) places.push_back({before, after, 1});
    }
    switches_ += count_.back();
    arcs_.push_back(std::move(arcs));
    places_.push_back(std::move(places));
  }
  for (auto& places : places_)
    for (Place& place : places)
      if (place.after == kEnd) place.after = switches_;
}

// Pieces of an arc that are not its ends: equal parts of it.
void SwitchTimeProgram::place_pieces(OnOffProgram& program) const {
  for (std::size_t i = 0; i < arcs_.size(); ++i)
    for (const Arc& arc : arcs_[i]) {
      if (arc.pieces == 1) continue;
      const double from = begin_of(program, i, arc.first);
      const double to = end_of(program, i, arc.first + arc.pieces - 1);
      for (std::size_t k = 1; k < arc.pieces; ++k)
        program.switch_times_s[i][arc.first + k - 1] =
            from + (to - from) * (static_cast<double>(k) / static_cast<double>(arc.pieces));
    }
}

Eigen::VectorXd SwitchTimeProgram::variables(const OnOffProgram& program) const {
  Eigen::VectorXd variables(parameter_count());
  for (std::size_t i = 0; i < arcs_.size(); ++i) {
    double before = 0;
    for (Eigen::Index k = 0; k < count_[i]; ++k) {
      const double time = begin_of(program, i, arcs_[i][static_cast<std::size_t>(k) + 1].first);
      variables[first_[i] + k] = (time - before) / reference_s_;
      before = time;
    }
  }
  variables[switches_] = program.end_s / reference_s_;
  for (std::size_t k = 0; k < levels_.size(); ++k)
    variables[switches_ + 1 + static_cast<Eigen::Index>(k)] =
        program.controls[levels_[k].control][levels_[k].segment];
  return variables;
}

OnOffProgram SwitchTimeProgram::program(const Eigen::VectorXd& variables) const {
  OnOffProgram program = shape_;
  program.end_s = reference_s_ * variables[switches_];
  for (std::size_t i = 0; i < arcs_.size(); ++i) {
    double time = 0;
    for (Eigen::Index k = 0; k < count_[i]; ++k) {
      time += reference_s_ * variables[first_[i] + k];
      program.switch_times_s[i][arcs_[i][static_cast<std::size_t>(k) + 1].first - 1] = time;
    }
  }
  for (std::size_t k = 0; k < levels_.size(); ++k)
    program.controls[levels_[k].control][levels_[k].segment] =
        variables[switches_ + 1 + static_cast<Eigen::Index>(k)];
  place_pieces(program);
  return program;
}

Eigen::VectorXd SwitchTimeProgram::parameters(const OnOffProgram& program) const {
  Eigen::VectorXd parameters = variables(program);
  for (std::size_t i = 0; i < arcs_.size(); ++i)
    for (Eigen::Index k = 0; k < count_[i]; ++k)
      parameters[first_[i] + k] =
          begin_of(program, i, arcs_[i][static_cast<std::size_t>(k) + 1].first) / reference_s_;
  return parameters;
}

OnOffProgram SwitchTimeProgram::program_of_parameters(const Eigen::VectorXd& parameters) const {
  OnOffProgram program = shape_;
  program.end_s = reference_s_ * parameters[switches_];
  for (std::size_t i = 0; i < arcs_.size(); ++i)
    for (Eigen::Index k = 0; k < count_[i]; ++k)
      program.switch_times_s[i][arcs_[i][static_cast<std::size_t>(k) + 1].first - 1] =
          reference_s_ * parameters[first_[i] + k];
  for (std::size_t k = 0; k < levels_.size(); ++k)
    program.controls[levels_[k].control][levels_[k].segment] =
        parameters[switches_ + 1 + static_cast<Eigen::Index>(k)];
  place_pieces(program);
  return program;
}

void SwitchTimeProgram::fly(const OnOffProgram& program, bool with_middles) const {
  if (levels_.empty())
    flight_.fly(program, problem_->initial, with_middles);
  else
    flight_.fly_with_response(program, problem_->initial, with_middles);
}

std::vector<SwitchTimeProgram::Span> SwitchTimeProgram::level_spans() const {
  if (levels_.empty()) return {};
  std::vector<std::vector<std::size_t>> begins(arcs_.size());
  for (std::size_t i = 0; i < arcs_.size(); ++i)
    begins[i].assign(shape_.controls[i].size() + 1, flight_.points().size() - 1);
  for (auto& of_control : begins) of_control.front() = 0;
  for (std::size_t k = 0; k < flight_.switches().size(); ++k) {
    const FlownSwitch& flown = flight_.switches()[k];
    begins[static_cast<std::size_t>(flown.control)][static_cast<std::size_t>(flown.index) + 1] =
        flight_.switch_point(k);
  }
  std::vector<Span> spans;
  for (const Level& level : levels_)
    spans.push_back({begins[level.control][level.segment], begins[level.control][level.segment + 1]});
  return spans;
}

// What a switch that comes later changes, as part of the slopes with the parameters that it moves with.
template <typename Column>
void SwitchTimeProgram::add_switch(const FlownSwitch& flown, const Column& change,
                                   Eigen::MatrixXd& slope) const {
  const Place& place =
      places_[static_cast<std::size_t>(flown.control)][static_cast<std::size_t>(flown.index)];
  slope.col(place.after) += place.part * change;
  if (place.part < 1 && place.before >= 0) slope.col(place.before) += (1 - place.part) * change;
}

SwitchTimeProgram::Slopes SwitchTimeProgram::slopes(const OnOffProgram& program) const {
  fly(program, false);
  const FlownPoint& end = flight_.end();
  const bool is_free = body_->plant.is_free();
  const TerminalError error({end.attitude, end.rate_rad_s}, problem_->final);
  const Matrix6 change = error_of_change(error, reference_s_);
  const Matrix6 to_end = change * end.transition;
  Slopes slopes;
  slopes.error = error.value;
  slopes.error.tail<3>() *= reference_s_;
  slopes.error_slope.setZero(6, parameter_count());
  for (std::size_t k = 0; k < flight_.switches().size(); ++k) {
    const FlownSwitch& flown = flight_.switches()[k];
    const Matrix6 inverse = inverse_transition(flight_.at_switch(k).transition, is_free);
    const Eigen::Vector3d jump = (flown.before - flown.after) * body_->acceleration_rad_s2.col(flown.control);
    const Vector6 at_start = inverse.rightCols<3>() * jump;
    add_switch(flown, Vector6(reference_s_ * (to_end * at_start)), slopes.error_slope);
  }
  slopes.error_slope.col(switches_) +=
      reference_s_ * (change * flight_.drift_at(end, flight_.controls_at_end()));
  const std::vector<Span> spans = level_spans();
  for (std::size_t k = 0; k < levels_.size(); ++k)
    slopes.error_slope.col(switches_ + 1 + static_cast<Eigen::Index>(k)) =
        to_end * ((response_at_start(flight_, spans[k].end, is_free) -
                   response_at_start(flight_, spans[k].begin, is_free)) *
                  body_->acceleration_rad_s2.col(static_cast<Eigen::Index>(levels_[k].control)));
  if (limits_consumption_) slopes.consumption_slope = consumption_slope(program);
  return slopes;
}

// After a flight.
Eigen::VectorXd SwitchTimeProgram::consumption_slope(const OnOffProgram& program) const {
  using Scalar = Eigen::Matrix<double, 1, 1>;
  Eigen::MatrixXd slope = Eigen::MatrixXd::Zero(1, parameter_count());
  for (const FlownSwitch& flown : flight_.switches())
    add_switch(
        flown,
        Scalar(body_->plant.consumption(flown.control) * (std::abs(flown.before) - std::abs(flown.after))),
        slope);
  for (Eigen::Index i = 0; i < body_->plant.controls(); ++i)
    slope(0, switches_) += body_->plant.consumption(i) * std::abs(flight_.controls_at_end()[i]);
  for (std::size_t k = 0; k < levels_.size(); ++k) {
    const auto& [control, segment] = levels_[k];
    const double length_s = end_of(program, control, segment) - begin_of(program, control, segment);
    slope(0, switches_ + 1 + static_cast<Eigen::Index>(k)) =
        std::copysign(body_->plant.consumption(static_cast<Eigen::Index>(control)),
                      program.controls[control][segment]) *
        length_s / reference_s_;
  }
  return slope.transpose();
}

// From slopes with the switch times: a length moves all later switches of its control.
Eigen::MatrixXd SwitchTimeProgram::in_lengths(Eigen::MatrixXd rows) const {
  for (std::size_t i = 0; i < first_.size(); ++i)
    for (Eigen::Index k = count_[i] - 2; k >= 0; --k) rows.col(first_[i] + k) += rows.col(first_[i] + k + 1);
  return rows;
}

void SwitchTimeProgram::evaluate(const Eigen::VectorXd& variables, NonlinearValues& values) {
  const OnOffProgram flown = program(variables);
  const Eigen::Index n = parameter_count();
  const Slopes slope = slopes(flown);
  values.objective = variables[switches_];
  values.slope = Eigen::VectorXd::Unit(n, switches_);
  values.equal = slope.error;
  values.equal_slope = in_lengths(slope.error_slope);
  values.positive.setZero(nonlinear_.positives);
  values.positive_slope.setZero(nonlinear_.positives, n);
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < flown.controls.size(); ++i, ++row) {
    values.positive[row] = variables[switches_] - variables.segment(first_[i], count_[i]).sum();
    values.positive_slope(row, switches_) = 1;
    values.positive_slope.row(row).segment(first_[i], count_[i]).setConstant(-1);
  }
  if (limits_consumption_) {
    values.positive[row] =
        (*problem_->most_consumption - consumption_of(flown, body_->plant)) / consumption_scale_;
    values.positive_slope.row(row) =
        -reference_s_ / consumption_scale_ * in_lengths(slope.consumption_slope.transpose());
    ++row;
  }
  if (problem_->most_rate_rad_s) limit_rates(flown, row, values);
}

// Of |w_i| the square, at the switches and in the middles of long arcs.
void SwitchTimeProgram::limit_rates(const OnOffProgram& flown, Eigen::Index row, NonlinearValues& values) {
  fly(flown, true);
  const Eigen::Index n = parameter_count();
  const bool is_free = body_->plant.is_free();
  const auto& switches = flight_.switches();
  const Eigen::Index rows = nonlinear_.positives;
  std::vector<Matrix6> inverses;
  for (std::size_t k = 0; k < switches.size(); ++k)
    inverses.push_back(inverse_transition(flight_.at_switch(k).transition, is_free));
  Eigen::VectorXd control(body_->plant.controls());
  for (Eigen::Index i = 0; i < control.size(); ++i) control[i] = flown.controls[i].front();
  const std::vector<Span> spans = level_spans();
  std::size_t passed = 0;
  values.positive.tail(rows - row).setOnes();
  for (std::size_t p = 1; p + 1 < flight_.points().size() && row + 3 <= rows; ++p) {
    const FlownPoint& point = flight_.points()[p];
    const bool is_switch = passed < switches.size() && flight_.switch_point(passed) == p;
    Eigen::MatrixXd w_slope = Eigen::MatrixXd::Zero(3, n);
    for (std::size_t k = 0; k < passed; ++k) {
      const FlownSwitch& before = switches[k];
      const Eigen::Vector3d jump =
          (before.before - before.after) * body_->acceleration_rad_s2.col(before.control);
      add_switch(before,
                 Eigen::Vector3d(point.transition.bottomRows<3>() * (inverses[k].rightCols<3>() * jump)),
                 w_slope);
    }
    // A point moves with its switch; a middle with the switches (or the end) on both sides of it.
    const Eigen::Vector3d drift = flight_.drift_at(point, control).tail<3>();
    const auto moves_with = [&](std::size_t k, double part) {
      if (k == switches.size())
        w_slope.col(switches_) += part * drift;
      else
        add_switch(switches[k], Eigen::Vector3d(part * drift), w_slope);
    };
    if (is_switch) {
      moves_with(passed, 1);
    } else {
      moves_with(passed, 0.5);
      if (passed > 0) moves_with(passed - 1, 0.5);
    }
    w_slope = reference_s_ * in_lengths(w_slope);
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      if (p <= spans[k].begin) continue;
      const Eigen::Matrix<double, 6, 3> response =
          response_at_start(flight_, std::min(p, spans[k].end), is_free) -
          response_at_start(flight_, spans[k].begin, is_free);
      w_slope.col(switches_ + 1 + static_cast<Eigen::Index>(k)) =
          point.transition.bottomRows<3>() *
          (response * body_->acceleration_rad_s2.col(static_cast<Eigen::Index>(levels_[k].control)));
    }
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
