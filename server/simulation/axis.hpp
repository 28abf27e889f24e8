// Single-axis slew experiments: the specification (all SI) and the runs made from it.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "server/actuator/on_off_pair.hpp"
#include "server/actuator/proportional_thrusters.hpp"
#include "server/control/control_loop.hpp"
#include "server/control/switching_function.hpp"
#include "server/guidance/impulse_shaper.hpp"
#include "server/plant/disturbance.hpp"
#include "server/plant/single_axis.hpp"
#include "server/simulation/run.hpp"

namespace slew {

/// Where the maneuver starts and where it should end.
struct SingleAxisManeuver {
  double initial_angle_rad = 0;
  double initial_rate_rad_s = 0;
  double final_angle_rad = 0;
};

enum class StopCondition { duration, end_box, first_rest };

enum class SettlingTolerance { absolute, fraction_of_initial };

/// Settling of the angle error: |theta - theta_f| within the tolerance for good.
struct SettlingCriterion {
  SettlingTolerance kind = SettlingTolerance::fraction_of_initial;
  double tolerance = 0.01;  ///< rad when absolute
};

/// What every single-axis experiment has, whatever its law.
struct AxisSpecification {
  SingleAxisPlant plant;
  SingleAxisManeuver maneuver;
  Disturbances disturbances;
  ImpulseShaper shaper;           ///< of what is commanded
  std::vector<Impulse> impulses;  ///< that it makes; none: unshaped
  StopCondition stop = StopCondition::duration;
  SettlingCriterion settling;
  double duration_s = 0;
  double telemetry_period_s = 0;          ///< simulated time between samples
  std::vector<double> output_times_s;     ///< ascending
  double verification_tolerance = 1e-10;  ///< relative, of the SUNDIALS path
};

/// When the law decides, and with that what keeps the number of switchings finite.
enum class Evaluation {
  sampled,     ///< at t = kT, and held
  continuous,  ///< at every instant; minimum on-time, hysteresis or switching delay regularise it
  ideal,       ///< infinitely fast (Filippov): sliding and rest are modes of their own
  program,     ///< there is no law: firings at given times
};

/// A firing of a program, [from, to).
struct ProgrammedFiring {
  double from_s;
  double to_s;
  int direction;  ///< +1 or -1
};

/// A switching function, or a program, and a pair of on-off thrusters. Impulses shape a program's torque;
/// then the thrusters give parts of it, as proportional ones do.
struct OnOffAxisSpecification : AxisSpecification {
  SwitchingFunctionParameters law;
  Evaluation evaluation = Evaluation::continuous;
  double sample_period_s = 0;             ///< of a sampled law
  std::vector<ProgrammedFiring> program;  ///< ascending, apart from each other
  OnOffPairParameters actuator;
};

/// Linear feedback through proportional thrusters. Impulses shape the angle that is commanded: at each of
/// them it goes its part of the way from the initial to the final one.
struct LinearAxisSpecification : AxisSpecification {
  LinearFeedback feedback;
  AngleEstimator estimator;
  InitialEstimate estimate;
  ProportionalThrusterParameters actuator;
};

/// The sign of the slew; +1 where there is none.
int slew_direction(const SingleAxisManeuver& maneuver);

/// gamma_bar gamma = gamma_bar (I*/N*)/(I/N): at least 1 where the law tracks its switching curve.
double error_factor(const OnOffAxisSpecification& specification);

/// Ready to run, by closed-form arcs. Expects a specification that has passed validation.
std::unique_ptr<Run> make_on_off_axis_run(const OnOffAxisSpecification& specification);

/// The same request through SUNDIALS: shares the plant's right-hand side and nothing else. Its report's
/// digest is its own.
std::unique_ptr<Run> make_on_off_axis_verification(const OnOffAxisSpecification& specification);

ControlLoop control_loop(const LinearAxisSpecification& specification);

/// The modes that what is commanded makes vibrate, ascending by frequency: of a torque, the plant's with the
/// hub free; under a linear law the closed loop's. Those that do not oscillate are left out, and so are all
/// of them where the plant's have no closed form.
std::vector<VibratingMode> vibrating_modes(const OnOffAxisSpecification& specification);
std::vector<VibratingMode> vibrating_modes(const LinearAxisSpecification& specification);

/// The torque of a program as it is flown, in parts of the thrusters' own: shaped, where there are impulses.
std::vector<HeldCommand> commanded_torque(const OnOffAxisSpecification& specification);

/// Steps of the propagator that the whole duration takes.
double propagator_steps(const LinearAxisSpecification& specification);

/// Ready to run, by power series (server/propagation/taylor_arc.hpp). Expects a specification that has passed
/// validation: no friction, no end box.
std::unique_ptr<Run> make_linear_axis_run(const LinearAxisSpecification& specification);
std::unique_ptr<Run> make_linear_axis_verification(const LinearAxisSpecification& specification);

}  // namespace slew
