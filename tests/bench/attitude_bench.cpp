// Three-axis slews by the library, by SUNDIALS at its plainest (no metrics, no samples, no digest), and by a
// loop written by hand: medians of the thread's processor time, all in one run. The ratios count.
#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include "server/propagation/erk_solver.hpp"
#include "tests/unit/attitude_cases.hpp"

namespace {

using namespace slew;
using Eigen::Vector3d;
using ConstVector = Eigen::Map<const Vector3d>;
using Vector = Eigen::Map<Vector3d>;

double processor_time_s() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// By turns, so that whatever slows the machine down slows both.
std::array<double, 2> medians_s(const std::array<std::function<void()>, 2>& flights) {
  constexpr std::size_t kRounds = 15;
  std::array<std::array<double, kRounds>, 2> times;
  for (std::size_t round = 0; round < kRounds; ++round)
    for (std::size_t i = 0; i < 2; ++i) {
      const double begin = processor_time_s();
      flights[i]();
      times[i][round] = processor_time_s() - begin;
    }
  for (auto& of : times) std::nth_element(of.begin(), of.begin() + kRounds / 2, of.end());
  return {times[0][kRounds / 2], times[1][kRounds / 2]};
}

class Discard final : public SampleSink {
 public:
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

RunReport fly_to_the_end(const AttitudeSpecification& spec) {
  const auto run = make_attitude_run(spec);
  Discard discard;
  run->advance(std::numeric_limits<double>::infinity(), std::numeric_limits<std::int64_t>::max(), discard);
  return run->report();
}

/// ERKStep, Dormand & Prince 5(4), Reset at every switching and at every sample: p, w and three filters.
class PlainSundials {
 public:
  PlainSundials(const AttitudeSpecification& spec, double tolerance) : spec_(spec) {
    if (const auto* pairs = std::get_if<AxisThrusters>(&spec.actuator)) {
      pwpf_ = std::get_if<PwpfModulator>(&pairs->modulator);
      level_ = pairs->torque_N_m;
    } else {
      most_ = std::get<IdealTorque>(spec.actuator).maximum_N_m;
    }
    inverse_ = spec.plant.inertia_kg_m2.inverse();
    solver_.state = N_VNew_Serial(pwpf_ ? 9 : 6, solver_.context);
    N_VConst(0, solver_.state);
    Vector{state()} = spec.maneuver.initial_mrp;
    solver_.memory = ERKStepCreate(&slope, 0, solver_.state, solver_.context);
    check_sundials(ERKStepSetUserData(solver_.memory, this), "ERKStepSetUserData");
    check_sundials(ERKStepSetTableNum(solver_.memory, ARKODE_DORMAND_PRINCE_7_4_5), "ERKStepSetTableNum");
    check_sundials(ERKStepSStolerances(solver_.memory, tolerance, 1e-3 * tolerance), "ERKStepSStolerances");
    check_sundials(ERKStepSetMaxNumSteps(solver_.memory, 1000000), "ERKStepSetMaxNumSteps");
    if (!pwpf_) return;
    check_sundials(ERKStepRootInit(solver_.memory, 6, &guards), "ERKStepRootInit");
    check_sundials(ERKStepSetNoInactiveRootWarn(solver_.memory), "ERKStepSetNoInactiveRootWarn");
  }

  /// Where it ends, and how often it has switched.
  std::pair<std::array<double, 6>, int> fly() {
    double t_s = 0;
    int switchings = 0;
    std::int64_t sample = 0;
    while (t_s < spec_.duration_s) {
      double until_s = spec_.duration_s;
      if (spec_.sample_period_s) {
        if (t_s >= static_cast<double>(sample) * *spec_.sample_period_s) {
          held_ = asked(state());
          ++sample;
        }
        until_s = std::min(until_s, static_cast<double>(sample) * *spec_.sample_period_s);
      }
      check_sundials(ERKStepReset(solver_.memory, t_s, solver_.state), "ERKStepReset");
      check_sundials(ERKStepSetInitStep(solver_.memory, 0), "ERKStepSetInitStep");
      check_sundials(ERKStepSetStopTime(solver_.memory, until_s), "ERKStepSetStopTime");
      const int flag = ERKStepEvolve(solver_.memory, until_s, solver_.state, &t_s, ARK_NORMAL);
      check_sundials(flag, "ERKStepEvolve");
      if (flag != ARK_ROOT_RETURN) continue;
      std::array<int, 6> found{};
      check_sundials(ERKStepGetRootInfo(solver_.memory, found.data()), "ERKStepGetRootInfo");
      for (int axis = 0; axis < 3; ++axis) {
        if (found[2 * axis] == 0 && found[2 * axis + 1] == 0) continue;
        outputs_[axis] = outputs_[axis] != 0 ? 0 : found[2 * axis] != 0 ? 1 : -1;
        ++switchings;
      }
    }
    std::array<double, 6> end;
    std::copy_n(state(), 6, end.begin());
    return {end, switchings};
  }

 private:
  double* state() { return NV_DATA_S(solver_.state); }

  Vector3d asked(const double* x) const {
    const Vector3d torque =
        command(spec_.law, AttitudeSight<double>{ConstVector(x), ConstVector(x + 3), {}, 0}).torque_N_m;
    return most_ ? Vector3d(torque.cwiseMax(-*most_).cwiseMin(*most_)) : torque;
  }

  static int slope(sunrealtype, N_Vector state, N_Vector slope, void* self) {
    const auto& run = *static_cast<const PlainSundials*>(self);
    const double* x = NV_DATA_S(state);
    double* dx = NV_DATA_S(slope);
    const Vector3d w = ConstVector(x + 3);
    const Vector3d torque = run.spec_.sample_period_s ? run.held_ : run.asked(x);
    Vector{dx} = mrp_rate<double>(ConstVector(x), w);
    const Vector3d acts = run.pwpf_ ? Vector3d(run.outputs_.cwiseProduct(run.level_)) : torque;
    Vector(dx + 3) = angular_acceleration<double>(run.spec_.plant.inertia_kg_m2, run.inverse_, w, acts);
    if (run.pwpf_)
      Vector(dx + 6) = (run.pwpf_->gain * (torque - acts) - ConstVector(x + 6)) / run.pwpf_->time_constant_s;
    return 0;
  }

  static int guards(sunrealtype, N_Vector state, sunrealtype* values, void* self) {
    const auto& run = *static_cast<const PlainSundials*>(self);
    for (int axis = 0; axis < 3; ++axis) {
      const double f = NV_Ith_S(state, 6 + axis), u = run.outputs_[axis];
      values[2 * axis] = u != 0 ? run.pwpf_->off - u * f : f - run.pwpf_->on;
      values[2 * axis + 1] = u != 0 ? -1 : -f - run.pwpf_->on;
    }
    return 0;
  }

  const AttitudeSpecification& spec_;
  const PwpfModulator* pwpf_ = nullptr;
  std::optional<Vector3d> most_;
  Vector3d level_ = Vector3d::Zero(), outputs_ = Vector3d::Zero(), held_ = Vector3d::Zero();
  Eigen::Matrix3d inverse_;
  ErkSolver solver_;
};

void against_sundials(const char* name, AttitudeSpecification spec, double tolerance, double target) {
  spec.relative_tolerance = tolerance;
  spec.telemetry_period_s = spec.duration_s;
  RunReport mine;
  std::pair<std::array<double, 6>, int> other;
  const auto [library_s, sundials_s] = medians_s(
      {[&] { mine = fly_to_the_end(spec); }, [&] { other = PlainSundials(spec, tolerance).fly(); }});
  double difference = 0;
  for (std::size_t i = 0; i < 6; ++i)
    difference = std::max(difference, std::abs(mine.metrics.final_state[i] - other.first[i]));
  std::printf("%-34s library %9.1f us  SUNDIALS %9.1f us  ratio %5.1f (at least %g)\n", name, 1e6 * library_s,
              1e6 * sundials_s, sundials_s / library_s, target);
  std::printf("%-34s %zu and %d switchings, %zu steps, %zu slopes, ends differ by %.1g\n", "",
              static_cast<std::size_t>(mine.events_total), other.second,
              static_cast<std::size_t>(mine.propagator.steps),
              static_cast<std::size_t>(mine.propagator.rhs_evaluations), difference);
}

// The 13 numbers of a step: t, p, w, u, s.
using Row = std::array<double, 13>;

class Keep final : public SampleSink {
 public:
  explicit Keep(std::vector<Row>& rows) : rows_(rows) {}
  void sample(double t_s, std::span<const double> state, std::span<const double> thrusters) override {
    Row& row = rows_.emplace_back();
    row[0] = t_s;
    std::copy_n(state.begin(), 6, row.begin() + 1);
    std::copy_n(thrusters.begin(), 3, row.begin() + 7);
    std::copy_n(state.begin() + 6, 3, row.begin() + 10);
  }
  void event(const SwitchEvent&) override {}

 private:
  std::vector<Row>& rows_;
};

// The common slew as one writes it who needs nothing else.
void slope_by_hand(const double x[6], const double u[3], double dx[6]) {
  constexpr double kInertia[3] = {100, 80, 60};
  const double p0 = x[0], p1 = x[1], p2 = x[2], w0 = x[3], w1 = x[4], w2 = x[5];
  const double square = p0 * p0 + p1 * p1 + p2 * p2, along = p0 * w0 + p1 * w1 + p2 * w2;
  dx[0] = 0.25 * ((1 - square) * w0 + 2 * (p1 * w2 - p2 * w1 + along * p0));
  dx[1] = 0.25 * ((1 - square) * w1 + 2 * (p2 * w0 - p0 * w2 + along * p1));
  dx[2] = 0.25 * ((1 - square) * w2 + 2 * (p0 * w1 - p1 * w0 + along * p2));
  dx[3] = (u[0] - (kInertia[2] - kInertia[1]) * w1 * w2) / kInertia[0];
  dx[4] = (u[1] - (kInertia[0] - kInertia[2]) * w2 * w0) / kInertia[1];
  dx[5] = (u[2] - (kInertia[1] - kInertia[0]) * w0 * w1) / kInertia[2];
}

void law_by_hand(const double x[6], double u[3], double s[3]) {
  constexpr double kInertia[3] = {100, 80, 60}, kSlope = 0.4, kGain = 2, kLayer = 0.02, kMost = 4;
  double none[3] = {0, 0, 0}, dx[6];
  slope_by_hand(x, none, dx);
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    s[i] = x[3 + i] + kSlope * x[i];
    const double gyroscopic = (kInertia[k] - kInertia[j]) * x[3 + j] * x[3 + k];
    const double saturated = std::max(-1.0, std::min(1.0, s[i] / kLayer));
    const double asked = gyroscopic - kInertia[i] * kSlope * dx[i] - kGain * saturated;
    u[i] = std::max(-kMost, std::min(kMost, asked));
  }
}

void fly_by_hand(std::vector<Row>& rows) {
  constexpr double h = 0.01;
  const double p = std::tan(std::numbers::pi / 6) / std::sqrt(14.0);
  double x[6] = {p, 2 * p, 3 * p, 0, 0, 0};
  for (int step = 0; step <= 6000; ++step) {
    double u[3], s[3];
    law_by_hand(x, u, s);
    rows.push_back({step * h, x[0], x[1], x[2], x[3], x[4], x[5], u[0], u[1], u[2], s[0], s[1], s[2]});
    if (step == 6000) break;
    double k1[6], k2[6], k3[6], k4[6], y[6];
    slope_by_hand(x, u, k1);
    for (int i = 0; i < 6; ++i) y[i] = x[i] + 0.5 * h * k1[i];
    slope_by_hand(y, u, k2);
    for (int i = 0; i < 6; ++i) y[i] = x[i] + 0.5 * h * k2[i];
    slope_by_hand(y, u, k3);
    for (int i = 0; i < 6; ++i) y[i] = x[i] + h * k3[i];
    slope_by_hand(y, u, k4);
    for (int i = 0; i < 6; ++i) x[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  }
}

void common_slew() {
  const AttitudeSpecification spec = test::common_slew();
  std::vector<Row> mine, by_hand;
  mine.reserve(7000);
  by_hand.reserve(7000);
  const auto [library_s, hand_s] = medians_s({[&] {
                                                mine.clear();
                                                Keep keep(mine);
                                                make_attitude_run(spec)->advance(1e9, 1 << 30, keep);
                                              },
                                              [&] {
                                                by_hand.clear();
                                                fly_by_hand(by_hand);
                                              }});
  double difference = 0;
  for (std::size_t i = 1; i < 7; ++i)
    difference = std::max(difference, std::abs(mine.back()[i] - by_hand.back()[i]));
  std::printf("%-34s library %9.1f us  by hand  %9.1f us  ratio %5.2f (at least 0.5)\n",
              "common slew, 13 numbers a step", 1e6 * library_s, 1e6 * hand_s, hand_s / library_s);
  std::printf("%-34s %zu and %zu rows, ends differ by %.1g\n", "", mine.size(), by_hand.size(), difference);
}

AttitudeSpecification slew_about_all_axes() {
  AttitudeSpecification spec = test::yaw_half_turn(true, false);
  spec.maneuver.initial_mrp = {0.3, -0.2, 0.8};
  spec.duration_s = 60;
  return spec;
}

}  // namespace

int main() {
  AttitudeSpecification spec = slew_about_all_axes();
  against_sundials("PWPF, at every instant", spec, 1e-9, 10);
  AttitudeSpecification lighter = spec;
  lighter.plant.inertia_kg_m2 *= 0.1;
  std::get<SlidingMode>(lighter.law).inertia_kg_m2 *= 0.1;
  against_sundials("PWPF, a tenth of the inertia", lighter, 1e-9, 10);
  spec.sample_period_s = 0.05;
  against_sundials("PWPF, sampled every 50 ms", spec, 1e-9, 15);
  AttitudeSpecification wheels = test::common_slew();
  against_sundials("any torque, sampled every 10 ms", wheels, 1e-9, 15);
  common_slew();
}
