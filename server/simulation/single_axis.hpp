// Single-axis slew experiments: the specification (all SI) and the runs made from it.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "server/actuator/on_off_pair.hpp"
#include "server/control/switching_function.hpp"
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

struct SingleAxisSpecification {
  SingleAxisPlant plant;
  SingleAxisManeuver maneuver;
  SwitchingFunctionParameters law;
  std::optional<double> sample_period_s;  ///< the law's; empty: evaluated continuously
  OnOffPairParameters actuator;
  double disturbance_torque_N_m = 0;  ///< constant, from t = 0, along +theta
  StopCondition stop = StopCondition::duration;
  SettlingCriterion settling;
  double duration_s = 0;
  double telemetry_period_s = 0;          ///< simulated time between samples
  std::vector<double> output_times_s;     ///< ascending
  double verification_tolerance = 1e-10;  ///< relative, of the SUNDIALS path
};

/// The sign of the slew; +1 where there is none.
int slew_direction(const SingleAxisManeuver& maneuver);

/// gamma_bar gamma = gamma_bar (I*/N*)/(I/N): at least 1 where the law tracks its switching curve.
double error_factor(const SingleAxisSpecification& specification);

/// Ready to run, by closed-form arcs. Expects a specification that has passed validation.
std::unique_ptr<Run> make_single_axis_run(const SingleAxisSpecification& specification);

/// The same request through SUNDIALS: shares the plant's right-hand side and nothing else. Its report's
/// digest is its own.
std::unique_ptr<Run> make_single_axis_verification(const SingleAxisSpecification& specification);

}  // namespace slew
