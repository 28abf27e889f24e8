#include "server/guidance/plan_certificate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "server/guidance/maneuver_bounds.hpp"
#include "server/propagation/erk_solver.hpp"

namespace slew {

namespace {

constexpr double kTolerance = 1e-12;
// Far more than a maneuver of hundreds of switches takes.
constexpr int kMostSteps = 20000;

// q, w, and what is consumed.
constexpr sunindextype kSize = 8;

struct Flown {
  const RigidManeuverPlant& plant;
  const ControlHistory& history;
  Eigen::Matrix3d inverse;
  double begin_s = 0, end_s = 0;  // of the segment between breaks

  // Controls are those of the segment, also at its ends.
  Eigen::VectorXd control(double t) const {
    if (history.family != ProfileFamily::on_off) return control_at(history, plant, t);
    return control_at(history, plant, 0.5 * (begin_s + end_s));
  }
};

int slope(sunrealtype t, N_Vector x, N_Vector dx, void* context) {
  const Flown& flown = *static_cast<const Flown*>(context);
  const Eigen::Map<const Eigen::Matrix<double, 8, 1>> state(N_VGetArrayPointer(x));
  Eigen::Map<Eigen::Matrix<double, 8, 1>> rate(N_VGetArrayPointer(dx));
  const Eigen::VectorXd u = flown.control(t);
  const RigidRate<double> moved = rigid_rate<double>(flown.plant, flown.inverse, state.head<4>(),
                                                     state.segment<3>(4), flown.plant.influence_N_m * u);
  rate.head<4>() = moved.attitude_1_s;
  rate.segment<3>(4) = moved.acceleration_rad_s2;
  rate[7] = 0;
  for (Eigen::Index i = 0; i < u.size(); ++i) rate[7] += flown.plant.consumption(i) * std::abs(u[i]);
  return 0;
}

// `seen(t, x)` at every step's end and at the times asked for.
template <typename Seen>
void fly(const ManeuverProblem& problem, const ControlHistory& history, const std::vector<double>& times_s,
         const Seen& seen) {
  Flown flown{problem.plant, history, problem.plant.inertia_kg_m2.inverse()};
  ErkSolver solver;
  solver.state = N_VNew_Serial(kSize, solver.context);
  Eigen::Map<Eigen::Matrix<double, 8, 1>> x(N_VGetArrayPointer(solver.state));
  x << problem.initial.attitude, problem.initial.rate_rad_s, 0;
  solver.memory = ERKStepCreate(slope, 0, solver.state, solver.context);
  check_sundials(ERKStepSStolerances(solver.memory, kTolerance, kTolerance), "ERKStepSStolerances");
  check_sundials(ERKStepSetTableNum(solver.memory, ARKODE_VERNER_8_5_6), "ERKStepSetTableNum");
  check_sundials(ERKStepSetUserData(solver.memory, &flown), "ERKStepSetUserData");
  check_sundials(ERKStepSetMaxNumSteps(solver.memory, 200000), "ERKStepSetMaxNumSteps");
  check_sundials(ERKStepSetMaxStep(solver.memory, history.time_s / 100), "ERKStepSetMaxStep");
  std::vector<double> stops = breaks_of(history);
  const std::vector<double> jumps = stops;
  stops.insert(stops.end(), times_s.begin(), times_s.end());
  std::sort(stops.begin(), stops.end());
  seen(0.0, x);
  double t = 0;
  int steps = 0;
  for (const double stop : stops) {
    if (stop > history.time_s) break;
    // What only rounding keeps apart has one state: the integrator does not move for less.
    if (!(stop - t > 1e-14 * history.time_s)) {
      t = std::max(t, stop);
      seen(t, x);
      continue;
    }
    const auto after = std::upper_bound(jumps.begin(), jumps.end(), t);
    flown.begin_s = *(after - 1);
    flown.end_s = after == jumps.end() ? history.time_s : *after;
    check_sundials(ERKStepReset(solver.memory, t, solver.state), "ERKStepReset");
    check_sundials(ERKStepSetStopTime(solver.memory, stop), "ERKStepSetStopTime");
    while (t < stop) {
      sunrealtype reached = t;
      check_sundials(ERKStepEvolve(solver.memory, stop, solver.state, &reached, ARK_ONE_STEP),
                     "ERKStepEvolve");
      t = reached;
      if (++steps > kMostSteps)
        throw MotionTooLong("the motion takes more than " + std::to_string(kMostSteps) +
                            " steps to follow; at t = " + std::to_string(t) + " s the body turns at " +
                            std::to_string(x.segment<3>(4).norm() * 180 / std::numbers::pi) + " deg/s");
      seen(t, x);
    }
    t = stop;
  }
}

}  // namespace

void certify_flight(const ManeuverProblem& problem, const Plan& plan, double met,
                    PlanCertificate& certificate) {
  RigidState end;
  certificate.peak_rate_rad_s.setZero();
  fly(problem, plan, {}, [&](double, const Eigen::Matrix<double, 8, 1>& x) {
    end.attitude = x.head<4>();
    end.rate_rad_s = x.segment<3>(4);
    certificate.consumption = x[7];
    certificate.peak_rate_rad_s = certificate.peak_rate_rad_s.cwiseMax(end.rate_rad_s.cwiseAbs());
  });
  end.attitude.normalize();
  certificate.attitude_error_rad = eigenaxis(end.attitude, problem.final.attitude).angle_rad;
  if (certificate.attitude_error_rad == 0)
    certificate.attitude_error_rad = TerminalError(end, problem.final).value.head<3>().norm();
  certificate.rate_error_rad_s = (end.rate_rad_s - problem.final.rate_rad_s).norm();
  certificate.meets_all =
      certificate.attitude_error_rad <= met && certificate.rate_error_rad_s * plan.time_s <= met;
  if (problem.most_consumption) {
    certificate.consumption_margin = *problem.most_consumption - certificate.consumption;
    certificate.meets_all =
        certificate.meets_all && certificate.consumption_margin >= -1e-6 * *problem.most_consumption;
  }
  if (problem.most_rate_rad_s) {
    certificate.rate_margin_rad_s = (*problem.most_rate_rad_s - certificate.peak_rate_rad_s).minCoeff();
    certificate.meets_all =
        certificate.meets_all && certificate.rate_margin_rad_s >= -1e-6 * problem.most_rate_rad_s->minCoeff();
  }
}

std::vector<RigidState> fly_controls(const ManeuverProblem& problem, const ControlHistory& history,
                                     const std::vector<double>& times_s) {
  std::vector<RigidState> states;
  fly(problem, history, times_s, [&](double t, const Eigen::Matrix<double, 8, 1>& x) {
    while (states.size() < times_s.size() && times_s[states.size()] <= t)
      states.push_back({x.head<4>(), x.segment<3>(4)});
    return;
  });
  while (!states.empty() && states.size() < times_s.size()) states.push_back(states.back());
  return states;
}

}  // namespace slew
