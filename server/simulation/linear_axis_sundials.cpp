// The second opinion on a linear loop: ARKODE's explicit Runge-Kutta. Shares the plant's right-hand side with
// the first one and nothing else: laws and estimators are written again here, as Bryson 1994, section 3.2
// prints them.
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "server/propagation/erk_solver.hpp"
#include "server/simulation/axis.hpp"
#include "server/simulation/axis_channels.hpp"
#include "server/simulation/digest.hpp"

namespace slew {
namespace {

class SundialsLinearRun final : public Run {
 public:
  explicit SundialsLinearRun(const LinearAxisSpecification& specification);

  const ChannelTable& channels() const override { return channels_; }
  const std::vector<std::string>& event_channels() const override {
    return linear_axis_event_channels(!spec_.impulses.empty());
  }
  RunStatus advance(double until_s, std::int64_t max_steps, SampleSink& sink) override;
  double t_s() const override { return t_s_; }
  double duration_s() const override { return spec_.duration_s; }
  RunReport report() const override;
  std::unique_ptr<Run> clone() const override {
    throw std::logic_error("a verification is flown once, from its beginning");
  }

 private:
  // theta, omega, q, q', then q^ and theta^, or q*, or xi.
  std::size_t inside() const { return 2 + 2 * spec_.plant.modes.size(); }
  double at(std::size_t i) const { return NV_Ith_S(solver_.state, static_cast<sunindextype>(i)); }
  static int right_hand_side(sunrealtype t, N_Vector state, N_Vector slope, void* self);
  static int root_functions(sunrealtype t, N_Vector state, sunrealtype* values, void* self);
  double law(const double* state, double* inner_slope) const;
  double disturbance(double t_s) const;
  void command();
  void fly_to(double stop_s);

  const LinearAxisSpecification spec_;
  const ChannelTable channels_;
  const int direction_;
  ErkSolver solver_;
  double t_s_ = 0;
  double held_N_m_ = 0;  ///< of the disturbances, what is constant now
  double commanded_rad_;
  std::size_t impulses_ = 0;  ///< that have come
  bool is_fresh_ = true;
  bool has_braked_ = false;
  bool is_over_ = false;
  RunReport report_;
  Digester digester_;
  Metrics metrics_;
};

SundialsLinearRun::SundialsLinearRun(const LinearAxisSpecification& specification)
    : spec_(specification),
      channels_(linear_axis_channels(specification.plant.modes.size(), specification.estimator,
                                     std::holds_alternative<LeadCompensation>(specification.feedback.law),
                                     !specification.impulses.empty())),
      direction_(specification.maneuver.final_angle_rad < specification.maneuver.initial_angle_rad ? -1 : 1),
      commanded_rad_(specification.impulses.empty() ? specification.maneuver.final_angle_rad
                                                    : specification.maneuver.initial_angle_rad) {
  const double error = spec_.maneuver.initial_angle_rad - commanded_rad_;
  std::vector<double> inner;
  if (std::holds_alternative<LeadCompensation>(spec_.feedback.law))
    inner = {0};
  else if (std::holds_alternative<SecondOrderAngleEstimator>(spec_.estimator))
    inner = {spec_.estimate.rate_rad_s,
             spec_.estimate.error_rad
                 ? *spec_.estimate.error_rad + (spec_.maneuver.final_angle_rad - commanded_rad_)
                 : error};
  else if (const auto* first = std::get_if<FirstOrderAngleEstimator>(&spec_.estimator))
    inner = {spec_.estimate.rate_rad_s - first->gain_1_s * error};

  solver_.state = N_VNew_Serial(static_cast<sunindextype>(inside() + inner.size()), solver_.context);
  if (!solver_.state) throw std::bad_alloc();
  N_VConst(0, solver_.state);
  NV_Ith_S(solver_.state, 0) = spec_.maneuver.initial_angle_rad;
  NV_Ith_S(solver_.state, 1) = spec_.maneuver.initial_rate_rad_s;
  for (std::size_t i = 0; i < inner.size(); ++i)
    NV_Ith_S(solver_.state, static_cast<sunindextype>(inside() + i)) = inner[i];
  command();
  has_braked_ = direction_ * law(NV_DATA_S(solver_.state), nullptr) < 0;

  solver_.memory = ERKStepCreate(&right_hand_side, 0.0, solver_.state, solver_.context);
  if (!solver_.memory) throw std::bad_alloc();
  check_sundials(ERKStepSetUserData(solver_.memory, this), "ERKStepSetUserData");
  check_sundials(ERKStepSetTableNum(solver_.memory, ARKODE_DORMAND_PRINCE_7_4_5), "ERKStepSetTableNum");
  const double tolerance = spec_.verification_tolerance;
  check_sundials(ERKStepSStolerances(solver_.memory, tolerance, tolerance * 1e-3), "ERKStepSStolerances");
  check_sundials(ERKStepRootInit(solver_.memory, 2, &root_functions), "ERKStepRootInit");
  check_sundials(ERKStepSetNoInactiveRootWarn(solver_.memory), "ERKStepSetNoInactiveRootWarn");
  check_sundials(ERKStepSetMaxNumSteps(solver_.memory, 10000000), "ERKStepSetMaxNumSteps");
  report_.propagator.name = "sundials_erkstep_dormand_prince";
  metrics_.thruster_on_time_s.per_thruster.assign(2, 0);
  metrics_.firings.per_thruster.assign(2, 0);
}

// The torque, and where asked for the derivatives of what is inside the compensator.
double SundialsLinearRun::law(const double* state, double* inner_slope) const {
  const double z = state[0] - commanded_rad_, omega = state[1];
  const double* inner = state + inside();
  double commanded = 0, slope[2] = {0, 0};
  if (const auto* lead = std::get_if<LeadCompensation>(&spec_.feedback.law)) {
    commanded = -lead->gain_N_m_rad * (z - inner[0]);                                     // (3.3)
    slope[0] = -lead->pole_rad_s * inner[0] + (lead->pole_rad_s - lead->zero_rad_s) * z;  // (3.4)
  } else {
    const auto& law = std::get<AttitudeRateFeedback>(spec_.feedback.law);
    if (const auto* second = std::get_if<SecondOrderAngleEstimator>(&spec_.estimator)) {
      const double q = inner[0], theta = inner[1];
      commanded = -law.rate_gain_N_m_s_rad * q - law.attitude_gain_N_m_rad * theta;         // 3.2.2(a)
      slope[0] = commanded / second->inertia_kg_m2 + second->rate_gain_1_s2 * (z - theta);  // 3.2.1
      slope[1] = q + second->attitude_gain_1_s * (z - theta);
    } else if (const auto* first = std::get_if<FirstOrderAngleEstimator>(&spec_.estimator)) {
      const double q = inner[0] + first->gain_1_s * z;                           // 3.2.3
      commanded = -law.rate_gain_N_m_s_rad * q - law.attitude_gain_N_m_rad * z;  // 3.2.4(a)
      slope[0] = -first->gain_1_s * q + commanded / first->inertia_kg_m2;
    } else {
      commanded = -law.rate_gain_N_m_s_rad * omega - law.attitude_gain_N_m_rad * z;  // (3.1)
    }
  }
  const auto size = static_cast<std::size_t>(NV_LENGTH_S(solver_.state)) - inside();
  if (inner_slope) std::copy_n(slope, size, inner_slope);
  return spec_.feedback.loop_gain * commanded;
}

// Each impulse moves the commanded angle on by its part. Who estimates is told: the estimated angle stays
// where it is, and so does the estimated rate.
void SundialsLinearRun::command() {
  const double change_rad = spec_.maneuver.final_angle_rad - spec_.maneuver.initial_angle_rad;
  for (; impulses_ < spec_.impulses.size() && spec_.impulses[impulses_].time_s <= t_s_; ++impulses_) {
    const double step_rad = spec_.impulses[impulses_].amplitude * change_rad;
    commanded_rad_ += step_rad;
    if (std::holds_alternative<SecondOrderAngleEstimator>(spec_.estimator))
      NV_Ith_S(solver_.state, static_cast<sunindextype>(inside() + 1)) -= step_rad;
    if (const auto* first = std::get_if<FirstOrderAngleEstimator>(&spec_.estimator))
      NV_Ith_S(solver_.state, static_cast<sunindextype>(inside())) += first->gain_1_s * step_rad;
    is_fresh_ = true;
    const SwitchEvent event{t_s_, kImpulseEvent, static_cast<std::int32_t>(impulses_ + 1)};
    if (report_.events.size() < kReportedEvents) report_.events.push_back(event);
    ++report_.events_total;
    ++report_.propagator.events;
  }
}

double SundialsLinearRun::disturbance(double t_s) const {
  double torque = held_N_m_;
  for (const Sinusoid& one : spec_.disturbances.sinusoids)
    torque += one.amplitude_N_m * std::sin(one.frequency_rad_s * t_s + one.phase_rad);
  return torque;
}

int SundialsLinearRun::right_hand_side(sunrealtype t, N_Vector state, N_Vector slope, void* self) {
  const auto& run = *static_cast<const SundialsLinearRun*>(self);
  const std::size_t n = run.inside();
  const double torque = run.law(NV_DATA_S(state), NV_DATA_S(slope) + n) + run.disturbance(t);
  derivative<double>(run.spec_.plant, std::span<const double>(NV_DATA_S(state), n), torque,
                     std::span<double>(NV_DATA_S(slope), n));
  return 0;
}

int SundialsLinearRun::root_functions(sunrealtype, N_Vector state, sunrealtype* values, void* self) {
  const auto& run = *static_cast<const SundialsLinearRun*>(self);
  values[0] = NV_Ith_S(state, 1);
  values[1] = run.law(NV_DATA_S(state), nullptr);
  return 0;
}

void SundialsLinearRun::fly_to(double stop_s) {
  if (is_fresh_) {
    check_sundials(ERKStepReset(solver_.memory, t_s_, solver_.state), "ERKStepReset");
    check_sundials(ERKStepSetInitStep(solver_.memory, 0), "ERKStepSetInitStep");
    is_fresh_ = false;
  }
  check_sundials(ERKStepSetStopTime(solver_.memory, stop_s), "ERKStepSetStopTime");
  const double before = at(1);
  sunrealtype reached = t_s_;
  const int flag = ERKStepEvolve(solver_.memory, stop_s, solver_.state, &reached, ARK_ONE_STEP);
  check_sundials(flag, "ERKStepEvolve");
  t_s_ = reached;
  ++report_.propagator.steps;
  metrics_.peak_rate_rad_s = std::max({metrics_.peak_rate_rad_s, std::abs(before), std::abs(at(1))});
  digester_.real(t_s_);
  digester_.real(at(0));
  digester_.real(at(1));
  if (flag != ARK_ROOT_RETURN) return;
  std::array<int, 2> found{};
  check_sundials(ERKStepGetRootInfo(solver_.memory, found.data()), "ERKStepGetRootInfo");
  if (found[1] == -direction_) has_braked_ = true;
  if (found[0] != -direction_ || !has_braked_) return;
  if (!metrics_.first_rest_s) metrics_.first_rest_s = t_s_;
  if (spec_.stop != StopCondition::first_rest) return;
  report_.stop_reason = "first_rest";
  is_over_ = true;
}

RunStatus SundialsLinearRun::advance(double, std::int64_t max_steps, SampleSink&) {
  while (!is_over_) {
    if (max_steps-- <= 0) return RunStatus::running;
    if (t_s_ >= spec_.duration_s) {
      report_.stop_reason = "duration";
      is_over_ = true;
      break;
    }
    double stop_s = spec_.duration_s;
    double held = spec_.disturbances.constant_N_m;
    for (const StepDisturbance& step : spec_.disturbances.steps)
      if (step.from_s <= t_s_)
        held += step.torque_N_m;
      else
        stop_s = std::min(stop_s, step.from_s);
    command();
    if (impulses_ < spec_.impulses.size()) stop_s = std::min(stop_s, spec_.impulses[impulses_].time_s);
    is_fresh_ = is_fresh_ || held != held_N_m_;
    held_N_m_ = held;
    fly_to(stop_s);
  }
  return RunStatus::finished;
}

RunReport SundialsLinearRun::report() const {
  RunReport report = report_;
  long evaluations = 0;
  ERKStepGetNumRhsEvals(solver_.memory, &evaluations);
  report.propagator.rhs_evaluations = static_cast<std::uint64_t>(evaluations);
  report.metrics = metrics_;
  report.metrics.end_time_s = t_s_;
  const double error = at(0) - spec_.maneuver.final_angle_rad;
  report.metrics.final_error_rad = error;
  report.metrics.residual_rate_rad_s = at(1);
  auto& state = report.metrics.final_state;
  state = {at(0), at(1), error};
  const double* begin = NV_DATA_S(solver_.state);
  if (!spec_.plant.modes.empty()) {
    state.push_back(momentum_N_m_s(spec_.plant, std::span<const double>(begin, inside())));
    state.insert(state.end(), begin + 2, begin + inside());
  }
  if (std::holds_alternative<LeadCompensation>(spec_.feedback.law)) state.push_back(at(inside()));
  if (const auto* first = std::get_if<FirstOrderAngleEstimator>(&spec_.estimator))
    state.push_back(at(inside()) + first->gain_1_s * (at(0) - commanded_rad_));
  if (std::holds_alternative<SecondOrderAngleEstimator>(spec_.estimator)) {
    state.push_back(at(inside()));
    state.push_back(commanded_rad_ + at(inside() + 1));
  }
  if (!spec_.impulses.empty()) state.push_back(commanded_rad_);
  report.digest = digester_.digest();
  return report;
}

}  // namespace

std::unique_ptr<Run> make_linear_axis_verification(const LinearAxisSpecification& specification) {
  return std::make_unique<SundialsLinearRun>(specification);
}

}  // namespace slew
