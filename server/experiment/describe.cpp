// What a requested single-axis system is, from closed forms: no flight.
#include <cmath>
#include <numbers>

#include "server/experiment/experiment.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr double kDegPerRad = 180 / std::numbers::pi;

// Rest-to-rest slews without disturbance, in the limit of infinitely fast switching (Agrawal & Bang 1995,
// Eqs. 3 and 8; the coast and the slide along s = const are derived from Eqs. 11, 15 and 19).
json predictions(const SingleAxisSpecification& spec) {
  const double slew = std::abs(spec.maneuver.final_angle_rad - spec.maneuver.initial_angle_rad);
  const double a = spec.actuator.torque_N_m / spec.plant.inertia_kg_m2;
  const double g = error_factor(spec);
  const double band = spec.law.deadband == Deadband::none ? 0 : spec.law.deadband_rad;
  json document = {{"minimum_time_s", 2 * std::sqrt(slew / a)},
                   {"minimum_time_switch_s", std::sqrt(slew / a)},
                   {"minimum_time_peak_rate_deg_s", std::sqrt(slew * a) * kDegPerRad}};
  if (band >= slew) return document;
  const double t1 = std::sqrt(2 * (slew - band) / (a * (1 + g)));
  const double rate = a * t1;
  const double coast = (spec.law.deadband == Deadband::double_sided   ? 2
                        : spec.law.deadband == Deadband::single_sided ? 1
                                                                      : 0) *
                       band / rate;
  document["accelerating_s"] = t1;
  document["peak_rate_deg_s"] = rate * kDegPerRad;
  document["coast_s"] = coast;
  if (g >= 1) {
    const double braking = g * t1;
    document["slew_time_s"] = t1 + coast + braking;
    document["rest_error_deg"] =
        (spec.law.deadband == Deadband::double_sided ? band : 0) * slew_direction(spec.maneuver) * kDegPerRad;
    document["thruster_on_time_s"] = band > 0 ? 2 * t1 : t1 + braking;
    document["braking_duty"] = band > 0 ? 1 / g : (1 + 1 / g) / 2;
  } else if (band == 0) {
    const double rho = (1 - g) / (1 + g);
    document["overshoot_deg"] = slew * rho * kDegPerRad;
    document["first_stop_s"] = 2 * t1;
    document["slew_time_s"] = 2 * t1 / (1 - std::sqrt(rho));
  }
  return document;
}

}  // namespace

json describe(const Prepared& prepared) {
  const SingleAxisSpecification& spec = prepared.system;
  const double g = error_factor(spec);
  const SwitchingFunction law(spec.law, spec.maneuver.final_angle_rad, slew_direction(spec.maneuver));
  json regularisation;
  if (spec.sample_period_s)
    regularisation = {{"type", "sampled"}, {"period_s", *spec.sample_period_s}};
  else
    regularisation = {{"type", "minimum_on_time"}, {"minimum_on_time_s", spec.actuator.minimum_on_time_s}};
  return {{"plant",
           {{"type", "rigid_axis"},
            {"inertia_kg_m2", spec.plant.inertia_kg_m2},
            {"acceleration_deg_s2", spec.actuator.torque_N_m / spec.plant.inertia_kg_m2 * kDegPerRad},
            {"poles_rad_s", {0, 0}}}},
          {"law",
           {{"type", "switching_function"},
            {"error_factor", g},
            {"regime", g >= 1 ? "tracks the switching curve" : "leaves the switching curve, overshoots"},
            {"curvature_s2", law.curvature()},
            {"band_deg", {law.lower_rad() * kDegPerRad, law.upper_rad() * kDegPerRad}}}},
          {"regularisation", std::move(regularisation)},
          {"predictions", predictions(spec)},
          {"warnings", prepared.warnings},
          {"request", prepared.resolved}};
}

}  // namespace slew
