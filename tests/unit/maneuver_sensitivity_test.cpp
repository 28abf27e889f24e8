// Vadali, Singh & Carter 1993, Eqs. 19 and 20: how the end of a maneuver moves with its parameters; against
// central differences, and against the forward sensitivities of CVODES.
#include <cvodes/cvodes.h>
#include <gtest/gtest.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <cstdio>
#include <functional>

#include "maneuver_cases.hpp"
#include "server/guidance/maneuver_bounds.hpp"
#include "server/guidance/planner.hpp"
#include "server/guidance/profile_program.hpp"
#include "server/guidance/switch_time_program.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using Eigen::Vector3d;

TEST(ControlProfile, ShapesAreThePublishedOnes) {
  EXPECT_NEAR(rise_and_fall(.03, .1), .216, 1e-12);
  EXPECT_NEAR(rise_and_fall(.5, .1), 1, 1e-12);
  EXPECT_NEAR(rise_and_fall(.95, .1), .5, 1e-12);
  EXPECT_NEAR(impulse_control(.05, 1.0, -1.0, .1), .5, 1e-12);
  EXPECT_NEAR(impulse_control(.13, 1.0, -1.0, .1), .784, 1e-12);
  EXPECT_NEAR(impulse_control(.5, 1.0, -1.0, .1), 0, 1e-12);
  EXPECT_NEAR(impulse_control(.87, 1.0, -1.0, .1), -.784, 1e-12);
  EXPECT_NEAR(impulse_control(.95, 1.0, -1.0, .1), -.5, 1e-12);
}

void expect_end(const ManeuverProblem& problem, const std::vector<double>& parameters, double time_s,
                const Vector3d& euler, const Vector3d& rate, double consumption) {
  const ManeuverBody body(problem.plant);
  ProfileFlight flight(body, profile_layout(problem));
  flight.fly(parameters, time_s, problem.initial, {});
  const Vector3d angles = euler_angles_123<double>(flight.end().attitude);
  EXPECT_LE((angles / kRadian - euler).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LE((flight.end().rate_rad_s - rate).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_NEAR(flight.consumption(), consumption, 1e-3);
}

TEST(ProfileFlight, PublishedNumbersFlown) {
  expect_end(smooth(floating(AstrexThrusters::two_hundred_lbf), {1, 1, 1}),
             {.1077, .1096, 1, .5053, .4946, .4980, .01, .01, .01, .1}, 17.97,
             {150.01404089895627, -9.996995407524166, 4.985403907261726},
             {4.337362562217427e-05, -8.89309794141834e-06, 6.577604398382865e-07}, 361.9852815365028);
  auto impulses = on_pedestal(AstrexThrusters::two_hundred_lbf);
  impulses.family = ProfileFamily::impulses;
  expect_end(impulses, {.64, 1, .69, -.75, -.93, .16, .03, .03, .1}, 16.86,
             {152.00003206900234, -29.991604250504167, 5.012768701881099},
             {-4.662556787353748e-05, -0.00037415084758658454, -6.736445623127421e-05}, 162.0808);
  expect_end(smooth(on_pedestal(AstrexThrusters::eight_lbf), {1, 1, 1}),
             {.84, -.18, .104, .57, .9, .44, .01, .01, .01, .1}, 45.2,
             {163.02537983937304, -30.169712070451233, 5.147122656514083},
             {0.007889042368743032, -0.0011123019857099713, -0.003027574936176028}, 159.44759500689685);
}

// Of a program at `at`, the worst difference of its slopes from central differences.
double worst_slope(const NonlinearProgram& program, const Eigen::VectorXd& at) {
  NonlinearValues values, more, less;
  program.evaluate(at, values);
  double worst = 0;
  for (Eigen::Index j = 0; j < at.size(); ++j) {
    const double step = 1e-6;
    program.evaluate(at + step * Eigen::VectorXd::Unit(at.size(), j), more);
    program.evaluate(at - step * Eigen::VectorXd::Unit(at.size(), j), less);
    const double scale = std::max(1.0, values.equal_slope.col(j).norm());
    worst =
        std::max(worst, ((more.equal - less.equal) / (2 * step) - values.equal_slope.col(j)).norm() / scale);
    if (values.positive.size() == 0) continue;
    worst = std::max(worst, ((more.positive - less.positive) / (2 * step) - values.positive_slope.col(j))
                                    .lpNorm<Eigen::Infinity>() /
                                scale);
  }
  return worst;
}

TEST(Sensitivity, OfOnOffManeuversAgainstDifferences) {
  for (auto problem : {floating(AstrexThrusters::two_hundred_lbf), on_pedestal(AstrexThrusters::eight_lbf)}) {
    problem.most_consumption = 160;
    problem.most_rate_rad_s = Vector3d::Constant(0.3);
    const ManeuverBody body(problem.plant);
    OnOffProgram maneuver;
    maneuver.end_s = 9;
    maneuver.controls = {{1, 0, -1}, {-1, 1, 0, -1}, {1, -1, 0}};
    maneuver.switch_times_s = {{2, 6.5}, {.7, 3.1, 8}, {4.1, 7}};
    const SwitchTimeProgram program(problem, body, maneuver);
    EXPECT_LE(worst_slope(program.nonlinear(), program.variables(maneuver)), 1e-6);
  }
}

// Arcs at the beginning, in the middle and at the end, one piece alone, and others across them.
OnOffProgram with_levels() {
  OnOffProgram maneuver;
  maneuver.end_s = 9;
  maneuver.controls = {{.3, -.2, .5, 1}, {-1, .4, 0, .3, -.6, .2, -1}, {1, -.6, -.3}};
  maneuver.switch_times_s = {{1.5, 3, 4.5}, {.7, 3.1, 4, 5.2, 6.4, 7.6}, {5, 7}};
  return maneuver;
}

TEST(Sensitivity, OfLevelsAgainstDifferences) {
  for (auto problem : {floating(AstrexThrusters::two_hundred_lbf), on_pedestal(AstrexThrusters::eight_lbf)}) {
    problem.most_consumption = 160;
    problem.most_rate_rad_s = Vector3d::Constant(0.3);
    const ManeuverBody body(problem.plant);
    const OnOffProgram maneuver = with_levels();
    const SwitchTimeProgram program(problem, body, maneuver);
    // Switches of each control that are not within an arc, the end, levels.
    EXPECT_EQ(program.parameter_count(), (1 + 4 + 1) + 1 + 9);
    const Eigen::VectorXd variables = program.variables(maneuver);
    EXPECT_LE(worst_slope(program.nonlinear(), variables), 1e-6);
    EXPECT_LE((program.variables(program.program(variables)) - variables).norm(), 1e-13);
    const Eigen::VectorXd parameters = program.parameters(maneuver);
    EXPECT_LE((program.parameters(program.program_of_parameters(parameters)) - parameters).norm(), 1e-13);
  }
}

TEST(Sensitivity, OfSmoothManeuversAgainstDifferences) {
  auto problem = with_air(smooth(on_pedestal(AstrexThrusters::two_hundred_lbf), {1, 2, 3}));
  problem.smoothness_is_free = problem.rise_is_free = true;
  problem.smoothness = {.02, .01, .02};
  const ManeuverBody body(problem.plant);
  const ProfileLayout layout = profile_layout(problem);
  ProfileProgram smoothly(problem, body, layout, profile_parameters(problem, layout), 8);
  EXPECT_LE(worst_slope(smoothly.nonlinear(), smoothly.start()), 2e-5);
  problem.family = ProfileFamily::impulses;
  const ProfileLayout bumps = profile_layout(problem);
  const ProfileProgram impulses(problem, body, bumps, profile_parameters(problem, bumps), 12);
  EXPECT_LE(worst_slope(impulses.nonlinear(), impulses.start()), 2e-5);
}

struct Flown {
  const ManeuverProblem* problem;
  ProfileLayout layout;
  std::vector<double> parameters;  // the last is the maneuver's time
};

int slope(sunrealtype t, N_Vector x, N_Vector dx, void* context) {
  const Flown& flown = *static_cast<const Flown*>(context);
  const RigidManeuverPlant& plant = flown.problem->plant;
  const Eigen::Map<const Eigen::Matrix<double, 7, 1>> state(N_VGetArrayPointer(x));
  Eigen::Map<Eigen::Matrix<double, 7, 1>> rate(N_VGetArrayPointer(dx));
  Vector3d torque = Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i)
    torque += profile_control(flown.layout, flown.parameters, i, t) *
              plant.influence_N_m.col(static_cast<Eigen::Index>(i));
  const auto moved =
      rigid_rate<double>(plant, plant.inertia_kg_m2.inverse(), state.head<4>(), state.tail<3>(), torque);
  rate << moved.attitude_1_s, moved.acceleration_rad_s2;
  rate *= flown.parameters.back();
  return 0;
}

// What CVODES makes of x' = f(t, x, parameters): the state at the last stop, and how it moves with each
// parameter, as columns of (phi, dw).
struct Sensitivities {
  Eigen::Matrix<double, 7, 1> end;
  std::vector<Eigen::Matrix<double, 6, 1>> by;
};

Sensitivities by_cvodes(
    CVRhsFn f, void* user, std::vector<double>& parameters, const RigidState& start,
    const std::vector<double>& stops, const std::function<void(std::size_t)>& entering = [](std::size_t) {}) {
  const int count = static_cast<int>(parameters.size());
  SUNContext context;
  SUNContext_Create(nullptr, &context);
  N_Vector x = N_VNew_Serial(7, context);
  Eigen::Map<Eigen::Matrix<double, 7, 1>> state(N_VGetArrayPointer(x));
  state << start.attitude, start.rate_rad_s;
  N_Vector* moved = N_VCloneVectorArray(count, x);
  for (int k = 0; k < count; ++k) N_VConst(0, moved[k]);
  void* memory = CVodeCreate(CV_BDF, context);
  CVodeInit(memory, f, 0, x);
  CVodeSStolerances(memory, 1e-9, 1e-11);
  CVodeSetUserData(memory, user);
  CVodeSetMaxNumSteps(memory, 100000);
  SUNMatrix matrix = SUNDenseMatrix(7, 7, context);
  SUNLinearSolver solver = SUNLinSol_Dense(x, matrix, context);
  CVodeSetLinearSolver(memory, solver, matrix);
  CVodeSensInit1(memory, count, CV_SIMULTANEOUS, nullptr, moved);
  std::vector<double> sizes;
  for (const double parameter : parameters) sizes.push_back(std::abs(parameter));
  CVodeSetSensParams(memory, parameters.data(), sizes.data(), nullptr);
  CVodeSensEEtolerances(memory);
  CVodeSetSensErrCon(memory, 0);
  sunrealtype t = 0;
  for (std::size_t k = 0; k < stops.size(); ++k) {
    const double stop = stops[k];
    entering(k);
    CVodeSetStopTime(memory, stop);
    EXPECT_GE(CVode(memory, stop, x, &t, CV_NORMAL), 0);
    EXPECT_GE(CVodeGetSens(memory, &t, moved), 0);
    // What follows is another equation: nothing of the past may be believed.
    CVodeReInit(memory, t, x);
    CVodeSensReInit(memory, CV_SIMULTANEOUS, moved);
  }
  Sensitivities found;
  found.end = state;
  for (int k = 0; k < count; ++k) {
    const Eigen::Map<const Eigen::Matrix<double, 7, 1>> by(N_VGetArrayPointer(moved[k]));
    const Vector4<double> turned =
        euler_parameter_product<double>(by.head<4>(), euler_parameter_conjugate<double>(state.head<4>()));
    found.by.emplace_back() << 2 * turned.tail<3>(), by.tail<3>();
  }
  CVodeFree(&memory);
  SUNLinSolFree(solver);
  SUNMatDestroy(matrix);
  N_VDestroyVectorArray(moved, count);
  N_VDestroy(x);
  SUNContext_Free(&context);
  return found;
}

TEST(Sensitivity, OfSmoothManeuversAgainstCvodes) {
  const auto problem = smooth(floating(AstrexThrusters::two_hundred_lbf), {1, 1, 1});
  Flown flown{&problem, profile_layout(problem), {.3, -.4, .9, .45, .55, .5, .05, .05, .05, .1, 9}};
  const ManeuverBody body(problem.plant);
  ProfileFlight flight(body, flown.layout);
  std::vector<std::size_t> all(flown.parameters.size() - 1);
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = k;
  flight.fly(std::span(flown.parameters).first(all.size()), 9, problem.initial, all);
  const Sensitivities oracle =
      by_cvodes(slope, &flown, flown.parameters, problem.initial, {.1, .5, .9, 1.0});  // the rise bends there
  EXPECT_LE((oracle.end.head<4>() - flight.end().attitude).norm(), 1e-7);
  for (std::size_t k = 0; k < oracle.by.size(); ++k)
    EXPECT_LE((oracle.by[k] - flight.end().sensitivity.col(static_cast<Eigen::Index>(k))).norm(),
              1e-4 * std::max(1.0, oracle.by[k].norm()))
        << k;
}

// Over the segments between switches one after the other, each of length 1: then the times of the switches
// are parameters of a right-hand side that is smooth in them.
struct FlownOnOff {
  const ManeuverProblem* problem;
  std::vector<Vector3d> controls;  // of each segment
  std::vector<double> times;       // switches and the end
  std::size_t segment = 0;
};

int on_off_slope(sunrealtype, N_Vector x, N_Vector dx, void* context) {
  const auto& flown = *static_cast<const FlownOnOff*>(context);
  const RigidManeuverPlant& plant = flown.problem->plant;
  const std::size_t k = flown.segment;
  const Eigen::Map<const Eigen::Matrix<double, 7, 1>> state(N_VGetArrayPointer(x));
  Eigen::Map<Eigen::Matrix<double, 7, 1>> rate(N_VGetArrayPointer(dx));
  const auto moved = rigid_rate<double>(plant, plant.inertia_kg_m2.inverse(), state.head<4>(),
                                        state.tail<3>(), plant.influence_N_m * flown.controls[k]);
  rate << moved.attitude_1_s, moved.acceleration_rad_s2;
  rate *= flown.times[k] - (k > 0 ? flown.times[k - 1] : 0);
  return 0;
}

TEST(Sensitivity, OfOnOffManeuversAgainstCvodes) {
  for (const auto& problem :
       {floating(AstrexThrusters::two_hundred_lbf), on_pedestal(AstrexThrusters::eight_lbf)}) {
    OnOffProgram maneuver;
    maneuver.end_s = 9;
    maneuver.controls = {{1, 0, -1}, {-1, 1}, {1, -1, 0}};
    maneuver.switch_times_s = {{2, 6.5}, {3.1}, {4.1, 7}};
    const ManeuverBody body(problem.plant);
    OnOffFlight flight(body);
    flight.fly(maneuver, problem.initial);

    FlownOnOff flown{&problem, {}, {}, 0};
    for (const FlownSwitch& one : flight.switches()) flown.times.push_back(one.time_s);
    flown.times.push_back(maneuver.end_s);
    for (std::size_t k = 0; k < flown.times.size(); ++k) {
      const double at_s = 0.5 * (flown.times[k] + (k > 0 ? flown.times[k - 1] : 0));
      ControlHistory history;
      history.time_s = maneuver.end_s;
      history.on_off = maneuver;
      flown.controls.push_back(control_at(history, problem.plant, at_s));
    }
    std::vector<double> stops;
    for (std::size_t k = 1; k <= flown.times.size(); ++k) stops.push_back(static_cast<double>(k));
    const Sensitivities oracle = by_cvodes(on_off_slope, &flown, flown.times, problem.initial, stops,
                                           [&](std::size_t k) { flown.segment = k; });
    EXPECT_LE((oracle.end.head<4>() - flight.end().attitude).norm(), 1e-6);

    const auto is_free = problem.plant.is_free();
    for (std::size_t k = 0; k < flight.switches().size(); ++k) {
      const FlownSwitch& one = flight.switches()[k];
      Eigen::Matrix<double, 6, 1> jump = Eigen::Matrix<double, 6, 1>::Zero();
      jump.tail<3>() = (one.before - one.after) * body.acceleration_rad_s2.col(one.control);
      const Eigen::Matrix<double, 6, 1> ours =
          flight.end().transition * (inverse_transition(flight.at_switch(k).transition, is_free) * jump);
      EXPECT_LE((oracle.by[k] - ours).norm(), 1e-4 * std::max(1.0, ours.norm())) << k;
    }
    const Eigen::Matrix<double, 6, 1> ours = flight.drift_at(flight.end(), flight.controls_at_end());
    EXPECT_LE((oracle.by.back() - ours).norm(), 1e-4 * std::max(0.1, ours.norm()));
  }
}

// Levels as parameters, between switches that stay where they are.
struct FlownLevels {
  struct Lasting {
    std::size_t control, from, to;  // segments of the whole maneuver
  };
  const ManeuverProblem* problem;
  std::vector<Vector3d> controls;
  std::vector<double> lengths, levels;
  std::vector<Lasting> lasting;
  std::size_t segment = 0;
};

int level_slope(sunrealtype, N_Vector x, N_Vector dx, void* context) {
  const auto& flown = *static_cast<const FlownLevels*>(context);
  const RigidManeuverPlant& plant = flown.problem->plant;
  const std::size_t k = flown.segment;
  Vector3d u = flown.controls[k];
  for (std::size_t l = 0; l < flown.levels.size(); ++l)
    if (k >= flown.lasting[l].from && k < flown.lasting[l].to)
      u[static_cast<Eigen::Index>(flown.lasting[l].control)] = flown.levels[l];
  const Eigen::Map<const Eigen::Matrix<double, 7, 1>> state(N_VGetArrayPointer(x));
  Eigen::Map<Eigen::Matrix<double, 7, 1>> rate(N_VGetArrayPointer(dx));
  const auto moved = rigid_rate<double>(plant, plant.inertia_kg_m2.inverse(), state.head<4>(),
                                        state.tail<3>(), plant.influence_N_m * u);
  rate << moved.attitude_1_s, moved.acceleration_rad_s2;
  rate *= flown.lengths[k];
  return 0;
}

TEST(Sensitivity, OfLevelsAgainstCvodes) {
  for (const auto& problem :
       {floating(AstrexThrusters::two_hundred_lbf), on_pedestal(AstrexThrusters::eight_lbf)}) {
    const OnOffProgram maneuver = with_levels();
    ControlHistory history;
    history.time_s = maneuver.end_s;
    history.on_off = maneuver;
    const ManeuverBody body(problem.plant);
    OnOffFlight flight(body);
    flight.fly_with_response(maneuver, problem.initial);
    const std::vector<double> breaks = breaks_of(history);
    FlownLevels flown{&problem, {}, {}, {}, {}, 0};
    std::vector<double> stops;
    for (std::size_t k = 0; k + 1 < breaks.size(); ++k) {
      flown.controls.push_back(control_at(history, problem.plant, 0.5 * (breaks[k] + breaks[k + 1])));
      flown.lengths.push_back(breaks[k + 1] - breaks[k]);
      stops.push_back(static_cast<double>(k + 1));
    }
    const auto break_at = [&](double t) {
      return static_cast<std::size_t>(std::lower_bound(breaks.begin(), breaks.end(), t) - breaks.begin());
    };
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < maneuver.controls[i].size(); ++k) {
        if (!is_throttled(problem.plant, i, maneuver.controls[i][k])) continue;
        const auto& times = maneuver.switch_times_s[i];
        flown.levels.push_back(maneuver.controls[i][k]);
        flown.lasting.push_back({i, break_at(k == 0 ? 0 : times[k - 1]),
                                 break_at(k == times.size() ? maneuver.end_s : times[k])});
      }
    ASSERT_EQ(flown.levels.size(), 9u);
    const Sensitivities oracle = by_cvodes(level_slope, &flown, flown.levels, problem.initial, stops,
                                           [&](std::size_t k) { flown.segment = k; });
    const auto is_free = problem.plant.is_free();
    const auto at_start = [&](double t) -> Eigen::Matrix<double, 6, 3> {
      std::size_t p = 0;
      while (flight.points()[p].time_s < t - 1e-12) ++p;
      return inverse_transition(flight.points()[p].transition, is_free) * flight.response(p);
    };
    for (std::size_t l = 0; l < flown.levels.size(); ++l) {
      const FlownLevels::Lasting& one = flown.lasting[l];
      const Eigen::Matrix<double, 6, 1> ours =
          flight.end().transition * ((at_start(breaks[one.to]) - at_start(breaks[one.from])) *
                                     body.acceleration_rad_s2.col(static_cast<Eigen::Index>(one.control)));
      EXPECT_LE((oracle.by[l] - ours).norm(), 1e-4 * std::max(0.1, ours.norm())) << l;
    }
  }
}

TEST(CriticalControl, PublishedOnes) {
  const auto critical = [](const ManeuverProblem& problem) {
    const ManeuverBody body(problem.plant);
    return eigenaxis_maneuver(body, eigenaxis(problem.initial.attitude, problem.final.attitude));
  };
  const auto float8 = critical(floating(AstrexThrusters::eight_lbf));
  EXPECT_EQ(float8.critical, 1);
  EXPECT_LE((float8.effort_s2.cwiseAbs() - Vector3d(61.97952, 63.15152, 24.35549)).cwiseAbs().maxCoeff(),
            1e-3);
  EXPECT_NEAR(float8.eigenaxis.angle_rad / kRadian, 148.78394385728242, 1e-9);
  EXPECT_LE((float8.eigenaxis.axis - Vector3d(0.9435639081506058, 0.0055117701375081915, -0.3311446385274967))
                .norm(),
            1e-9);
  EXPECT_NEAR(float8.synthetic_s, 25.611711768, 1e-6);
  const auto float200 = critical(floating(AstrexThrusters::two_hundred_lbf));
  EXPECT_EQ(float200.critical, 2);
  EXPECT_NEAR(float200.synthetic_s, 15.905092587, 1e-6);
  EXPECT_EQ(critical(on_pedestal(AstrexThrusters::eight_lbf)).critical, 0);
  EXPECT_NEAR(critical(on_pedestal(AstrexThrusters::two_hundred_lbf)).synthetic_s, 5.199684791, 1e-6);
}

}  // namespace
