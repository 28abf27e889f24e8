// The linear closed loop of a single-axis slew (Bryson 1994, section 3.2) by power series. A step is one of
// the system's own length, cut short by a disturbance that begins, an impulse of a shaped command, the end of
// the run, or the rest that stops it. The order of a step is server/doc/step.md's; no law decides anything in
// between.
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "server/propagation/taylor_arc.hpp"
#include "server/simulation/axis.hpp"
#include "server/simulation/axis_channels.hpp"
#include "server/simulation/axis_dynamics.hpp"
#include "server/simulation/axis_metrics.hpp"
#include "server/simulation/stepped_run.hpp"

namespace slew {
namespace {

using Eigen::Index;

// The loop with each sinusoidal disturbance as an oscillator of its own behind it:
// s = A sin(W t + phi), c = A cos(W t + phi), s' = W c, c' = -W s.
std::shared_ptr<const LinearSystem> disturbed(const ControlLoop& loop, const Disturbances& disturbances) {
  const Index n = loop.size(), all = n + 2 * static_cast<Index>(disturbances.sinusoids.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(all, all);
  matrix.topLeftCorner(n, n) = loop.matrix(loop.compensator().loop_gain);
  Index s = n;
  for (const Sinusoid& sinusoid : disturbances.sinusoids) {
    matrix.col(s).head(n) = loop.torque_input();
    matrix(s, s + 1) = sinusoid.frequency_rad_s;
    matrix(s + 1, s) = -sinusoid.frequency_rad_s;
    s += 2;
  }
  Eigen::VectorXd input = Eigen::VectorXd::Zero(all);
  input.head(n) = loop.torque_input();
  return std::make_shared<const LinearSystem>(matrix, input);
}

Eigen::VectorXd start(const ControlLoop& loop, const LinearAxisSpecification& spec) {
  Eigen::VectorXd state =
      Eigen::VectorXd::Zero(loop.size() + 2 * static_cast<Index>(spec.disturbances.sinusoids.size()));
  double error = spec.maneuver.initial_angle_rad - spec.maneuver.final_angle_rad;
  InitialEstimate estimate = spec.estimate;
  // Before the first impulse of a shaped command nothing is commanded: the error is from the initial angle.
  if (!spec.impulses.empty()) {
    if (estimate.error_rad) *estimate.error_rad -= error;
    error = 0;
  }
  state[0] = error;
  state[1] = spec.maneuver.initial_rate_rad_s;
  const Eigen::VectorXd inside = initial_state(spec.feedback, spec.estimator, error, estimate);
  state.segment(loop.size() - inside.size(), inside.size()) = inside;
  Index s = loop.size();
  for (const Sinusoid& sinusoid : spec.disturbances.sinusoids) {
    state[s++] = sinusoid.amplitude_N_m * std::sin(sinusoid.phase_rad);
    state[s++] = sinusoid.amplitude_N_m * std::cos(sinusoid.phase_rad);
  }
  return state;
}

// What a step of the commanded angle does to the state, of an error that grows by 1: an estimator is told of
// it, lead compensation is not.
Eigen::VectorXd command_step(const ControlLoop& loop, const LinearAxisSpecification& spec) {
  Eigen::VectorXd step =
      Eigen::VectorXd::Zero(loop.size() + 2 * static_cast<Index>(spec.disturbances.sinusoids.size()));
  step[0] = 1;
  const Eigen::VectorXd inside = initial_state(spec.feedback, spec.estimator, 1, {});
  step.segment(loop.size() - inside.size(), inside.size()) = inside;
  return step;
}

// How far the commanded angle has to go yet, before the first impulse and after each: nothing after the last.
std::vector<double> still_to_go(const LinearAxisSpecification& spec) {
  if (spec.impulses.empty()) return {0};
  const double angle = spec.maneuver.final_angle_rad - spec.maneuver.initial_angle_rad;
  std::vector<double> to_go(spec.impulses.size() + 1, 0);
  double part = 0;
  for (std::size_t i = spec.impulses.size(); i-- > 1;)
    to_go[i] = angle * (part += spec.impulses[i].amplitude);
  to_go[0] = angle;
  return to_go;
}

// Of the angle in each pair of the loop's modes, about where a constant torque holds it. Nothing where the
// modes are no basis, or where sinusoids drive them.
std::vector<ModeVibration> vibration_of(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& input,
                                        double torque_N_m, const Eigen::VectorXd& state) {
  constexpr double kLeastCondition = 1e-10;
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(matrix);
  const Eigen::MatrixXcd shapes = solver.eigenvectors();
  const Eigen::PartialPivLU<Eigen::MatrixXcd> lu(shapes);
  if (solver.info() != Eigen::Success || !(lu.rcond() > kLeastCondition)) return {};
  Eigen::VectorXd from_rest = state;
  if (torque_N_m != 0) from_rest += Eigen::PartialPivLU<Eigen::MatrixXd>(matrix).solve(input * torque_N_m);
  const Eigen::VectorXcd parts = lu.solve(from_rest.cast<std::complex<double>>());
  std::vector<ModeVibration> modes;
  for (Index k = 0; k < parts.size(); ++k) {
    const std::complex<double> pole = solver.eigenvalues()[k];
    if (pole.imag() > 0)
      modes.push_back({std::abs(pole), damping_ratio(pole), 2 * std::abs(shapes(0, k) * parts[k])});
  }
  std::sort(modes.begin(), modes.end(),
            [](const auto& a, const auto& b) { return a.frequency_rad_s < b.frequency_rad_s; });
  return modes;
}

// The metrics are taken from the error: near a final angle that is not 0 it would be lost in the angle's
// rounding.
LinearAxisSpecification with_error_as_angle(LinearAxisSpecification spec) {
  spec.maneuver.initial_angle_rad -= spec.maneuver.final_angle_rad;
  spec.maneuver.final_angle_rad = 0;
  return spec;
}

Eigen::RowVectorXd torque_row(const ControlLoop& loop, std::size_t size) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(static_cast<Index>(size));
  row.head(loop.size()) = loop.compensator().loop_gain * loop.torque();
  return row;
}

class LinearAxisRun final : public SteppedRun {
 public:
  explicit LinearAxisRun(const LinearAxisSpecification& specification);

  const std::vector<std::string>& event_channels() const override {
    return linear_axis_event_channels(!spec_->impulses.empty());
  }
  double duration_s() const override { return spec_->duration_s; }
  RunReport report() const override;
  std::unique_ptr<Run> clone() const override { return std::make_unique<LinearAxisRun>(*this); }

 private:
  // A part of the open step in which neither torque nor rate changes its sign.
  struct Part {
    double from, to;
    bool ends_at_rest;
    int torque_sign, rate_sign;
  };

  void open_step(SampleSink& sink) override;
  void close_step() override;
  void command(SampleSink& sink);
  Part part_from(double from, double h) const;
  std::optional<double> first_rest(double h) const;
  void fill_row(double t_s, std::span<double> state, std::span<double> thrusters) override;
  void finish(const char* reason, SampleSink& sink);
  void digest_state() override;

  const std::shared_ptr<const LinearAxisSpecification> spec_;
  const ControlLoop loop_;
  const int direction_;
  const Eigen::RowVectorXd torque_row_;    ///< of the whole state
  const Eigen::VectorXd command_step_;     ///< of the whole state
  const std::vector<double> still_to_go_;  ///< rad, before the first impulse and after each

  TaylorArc arc_;
  double constant_N_m_ = 0;  ///< of the disturbances
  std::size_t next_disturbance_ = 0;
  std::size_t next_impulse_ = 0;
  double to_go_rad_ = 0;  ///< of the commanded angle: what the loop takes for the error is this much more
  // Steps are counted from the last disturbance or impulse, so that their times are no long sums.
  double counted_from_s_ = 0;
  std::int64_t counted_ = 0;

  // The step that is open, from t_s_ to end_s_: error, rate and torque on it.
  bool is_at_rest_ = false;  ///< ends at the rest that stops the run
  TaylorMotion motion_;
  TaylorPolynomial torque_;
  bool is_still_ = false;     ///< the rate is rounding throughout
  double largest_rad_s_ = 0;  ///< what the rate was made of so far

  std::vector<double> whole_;  ///< scratch for a state

  AxisMetrics metrics_;
};

LinearAxisRun::LinearAxisRun(const LinearAxisSpecification& specification)
    : spec_(std::make_shared<const LinearAxisSpecification>(specification)),
      loop_(control_loop(*spec_)),
      direction_(slew_direction(specification.maneuver)),
      torque_row_(torque_row(
          loop_, static_cast<std::size_t>(loop_.size()) + 2 * spec_->disturbances.sinusoids.size())),
      command_step_(command_step(loop_, *spec_)),
      still_to_go_(still_to_go(*spec_)),
      arc_(disturbed(loop_, spec_->disturbances), start(loop_, *spec_)),
      constant_N_m_(specification.disturbances.constant_N_m),
      to_go_rad_(still_to_go_.front()),
      whole_(static_cast<std::size_t>(torque_row_.size())),
      metrics_(with_error_as_angle(specification), direction_) {
  report_.propagator.name = "power_series";
  lay_out(linear_axis_channels(spec_->plant.modes.size(), spec_->estimator,
                               std::holds_alternative<LeadCompensation>(spec_->feedback.law),
                               !spec_->impulses.empty()),
          spec_->telemetry_period_s, spec_->output_times_s);
  arc_.expand(0);
  digest_state();
}

void LinearAxisRun::digest_state() {
  arc_.state_at(0, whole_);
  digester_.real(t_s_);
  for (const double value : whole_) digester_.real(value);
}

// Impulses that are due: the commanded angle goes on, and the steps are counted anew.
void LinearAxisRun::command(SampleSink& sink) {
  const auto& impulses = spec_->impulses;
  for (; next_impulse_ < impulses.size() && impulses[next_impulse_].time_s <= t_s_; ++next_impulse_) {
    const double to_go_rad = still_to_go_[next_impulse_ + 1];
    arc_.jump(command_step_, to_go_rad - to_go_rad_);
    to_go_rad_ = to_go_rad;
    counted_from_s_ = t_s_;
    counted_ = 0;
    note(kImpulseEvent, static_cast<std::int32_t>(next_impulse_ + 1), sink);
  }
}

void LinearAxisRun::open_step(SampleSink& sink) {
  if (t_s_ >= spec_->duration_s) return finish("duration", sink);
  if (is_at_rest_) return finish("first_rest", sink);
  const auto& steps = spec_->disturbances.steps;
  for (; next_disturbance_ < steps.size() && steps[next_disturbance_].from_s <= t_s_; ++next_disturbance_) {
    constant_N_m_ += steps[next_disturbance_].torque_N_m;
    counted_from_s_ = t_s_;
    counted_ = 0;
  }
  command(sink);
  arc_.expand(constant_N_m_);
  motion_ = {arc_.component(0), arc_.component(1)};
  motion_.angle.c[0] -= to_go_rad_;
  torque_ = arc_.combination(torque_row_);
  ++counted_;
  end_s_ = std::min(counted_from_s_ + static_cast<double>(counted_) * arc_.step_s(), spec_->duration_s);
  if (next_disturbance_ < steps.size()) end_s_ = std::min(end_s_, steps[next_disturbance_].from_s);
  if (next_impulse_ < spec_->impulses.size())
    end_s_ = std::min(end_s_, spec_->impulses[next_impulse_].time_s);
  const double h = end_s_ - t_s_;
  // Nothing can be said of a step on which something overflows, the effort's square being the first to.
  const double size = motion_.angle.slope_bound(h) + motion_.rate.curvature_bound(h) +
                      std::abs(torque_.value(0)) + torque_.slope_bound(h) + torque_.curvature_bound(h);
  if (!std::isfinite(size * size * spec_->duration_s)) {
    report_.failure = RunFailure{"diverged", "the state has grown beyond what can be calculated with"};
    status_ = RunStatus::failed;
    return;
  }
  largest_rad_s_ = std::max(
      largest_rad_s_, std::abs(motion_.rate.value(0)) + std::abs(motion_.angle.value(0)) / arc_.step_s());
  constexpr double kRounding = 64 * std::numeric_limits<double>::epsilon();
  is_still_ = std::abs(motion_.rate.value(0)) + h * motion_.rate.slope_bound(h) <= kRounding * largest_rad_s_;
  if (spec_->stop == StopCondition::first_rest)
    if (const auto tau = first_rest(h)) {
      end_s_ = t_s_ + *tau;
      is_at_rest_ = true;
    }
  step_is_open_ = true;
}

LinearAxisRun::Part LinearAxisRun::part_from(double from, double h) const {
  Part part{from, h, false, 0, 0};
  if (const auto tau = next_sign_change(torque_, from, h)) part.to = *tau;
  if (!is_still_)
    if (const auto tau = next_rest(motion_, from, h); tau && *tau <= part.to) {
      part.to = *tau;
      part.ends_at_rest = true;
    }
  const double middle = 0.5 * (part.from + part.to);
  const auto sign = [](double value) { return value > 0 ? 1 : value < 0 ? -1 : 0; };
  part.torque_sign = sign(torque_.value(middle));
  part.rate_sign = is_still_ ? 0 : sign(motion_.rate_at(middle));
  return part;
}

// The first time after the torque has turned against the slew at which the rate along it changes its sign.
std::optional<double> LinearAxisRun::first_rest(double h) const {
  bool brakes = metrics_.braking_has_begun();
  for (double from = 0; from < h;) {
    const Part part = part_from(from, h);
    brakes = brakes || part.torque_sign == -direction_;
    if (brakes && part.ends_at_rest && part.rate_sign == direction_) return part.to;
    from = part.to;
  }
  return std::nullopt;
}

void LinearAxisRun::close_step() {
  const double h = end_s_ - t_s_;
  for (double from = 0; from < h;) {
    const Part part = part_from(from, h);
    const double length = part.to - part.from;
    if (part.torque_sign == -direction_) metrics_.brake(t_s_ + part.from);
    metrics_.thrust(std::abs(torque_.integral(part.from, part.to)),
                    torque_.integral_of_square(part.from, part.to));
    TaylorPiece piece(motion_, part.from, length, part.ends_at_rest);
    if (is_still_) piece.stand_still();
    metrics_.arc(t_s_ + part.from, piece, {}, length);
    if (part.ends_at_rest && part.rate_sign == direction_ && metrics_.braking_has_begun())
      metrics_.first_rest(t_s_ + part.to, motion_.angle_at(part.to));
    from = part.to;
  }
  arc_.move(h);
  t_s_ = end_s_;
  ++report_.propagator.steps;
  digest_state();
  step_is_open_ = false;
}

void LinearAxisRun::fill_row(double t_s, std::span<double> state, std::span<double> thrusters) {
  arc_.state_at(t_s - t_s_, whole_);
  const std::size_t n = spec_->plant.modes.size();
  const std::span<const double> moving = std::span(whole_).first(2 + 2 * n);
  const std::span<const double> inside =
      std::span(whole_).subspan(moving.size(), static_cast<std::size_t>(loop_.compensator().size()));
  const double commanded_rad = spec_->maneuver.final_angle_rad - to_go_rad_;
  std::size_t at = 0;
  state[at++] = commanded_rad + whole_[0];
  state[at++] = whole_[1];
  state[at++] = whole_[0] - to_go_rad_;
  if (n > 0) {
    state[at++] = momentum_N_m_s(spec_->plant, moving);
    for (const double elastic : moving.subspan(2)) state[at++] = elastic;
  }
  if (std::holds_alternative<LeadCompensation>(spec_->feedback.law)) state[at++] = inside[0];
  if (const auto rate = estimated_rate_rad_s(spec_->estimator, inside, whole_[0])) state[at++] = *rate;
  if (const auto error = estimated_error_rad(spec_->estimator, inside)) state[at++] = commanded_rad + *error;
  if (!spec_->impulses.empty()) state[at++] = commanded_rad;
  double torque = 0;
  for (std::size_t i = 0; i < whole_.size(); ++i) torque += torque_row_[static_cast<Index>(i)] * whole_[i];
  thrusters[0] = torque;
}

void LinearAxisRun::finish(const char* reason, SampleSink& sink) {
  arc_.expand(constant_N_m_);
  SteppedRun::finish(reason, sink);
}

RunReport LinearAxisRun::report() const {
  RunReport report = report_;
  std::vector<double> state(channels().state.size()), thrusters(channels().thrusters.size());
  // A copy, since a row needs room to be made in.
  LinearAxisRun copy(*this);
  copy.fill_row(t_s_, state, thrusters);
  report.metrics = metrics_.finish(t_s_, state[2], state[1]);
  if (spec_->disturbances.sinusoids.empty())
    report.metrics.vibration =
        vibration_of(loop_.matrix(spec_->feedback.loop_gain), loop_.torque_input(), constant_N_m_,
                     Eigen::Map<const Eigen::VectorXd>(copy.whole_.data(), loop_.size()));
  report.metrics.final_state = std::move(state);
  report.digest = digester_.digest();
  return report;
}

}  // namespace

ControlLoop control_loop(const LinearAxisSpecification& specification) {
  return {specification.plant, specification.feedback, specification.estimator};
}

double propagator_steps(const LinearAxisSpecification& specification) {
  return std::ceil(specification.duration_s /
                   disturbed(control_loop(specification), specification.disturbances)->step_s());
}

std::unique_ptr<Run> make_linear_axis_run(const LinearAxisSpecification& specification) {
  return std::make_unique<LinearAxisRun>(specification);
}

}  // namespace slew
