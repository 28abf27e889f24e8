// What a requested single-axis system is, from closed forms: no flight.
#include <cmath>
#include <numbers>

#include "server/experiment/experiment.hpp"
#include "server/propagation/modal_basis.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr double kDegPerRad = 180 / std::numbers::pi;

// In the limit of infinitely fast switching (Agrawal & Bang 1995, Eqs. 3 and 8; the coast and the slide along
// s = const are derived from Eqs. 11, 15 and 19). A constant disturbance delta N along the slew leaves
// a (1 + delta) to accelerate with and a (1 - delta) to brake with; inside a dead band it keeps accelerating,
// for which there is no prediction here. Null where the closed forms do not apply.
json predictions(const OnOffAxisSpecification& spec) {
  const double slew = std::abs(spec.maneuver.final_angle_rad - spec.maneuver.initial_angle_rad);
  const double a = spec.actuator.torque_N_m / spec.plant.inertia_kg_m2;
  const int direction = slew_direction(spec.maneuver);
  const double delta = direction * spec.disturbances.constant_N_m / spec.actuator.torque_N_m;
  if (slew == 0 || spec.maneuver.initial_rate_rad_s != 0 || std::abs(delta) >= 1) return nullptr;

  const double g = error_factor(spec);
  const double fastest = std::sqrt(a * slew * (1 - delta * delta));
  json document = {{"minimum_time_s", 2 * slew / fastest},
                   {"minimum_time_switch_s", fastest / (a * (1 + delta))},
                   {"minimum_time_peak_rate_deg_s", fastest * kDegPerRad},
                   {"gamma_bar_for_no_overshoot", spec.law.gamma_bar / (g * (1 - delta))}};
  const double band = spec.law.deadband == Deadband::none ? 0 : spec.law.deadband_rad;
  if (band >= slew || (band > 0 && delta != 0)) return document;

  const double rate = std::sqrt(2 * a * (slew - band) / (g + 1 / (1 + delta)));
  const double t1 = rate / (a * (1 + delta));
  const double coast = (spec.law.deadband == Deadband::double_sided ? 2 : 1) * band / rate;
  document["accelerating_s"] = t1;
  document["peak_rate_deg_s"] = rate * kDegPerRad;
  document["coast_s"] = coast;
  if (g * (1 - delta) >= 1) {
    const double braking = g * rate / a;
    document["overshoot_deg"] = spec.law.deadband == Deadband::double_sided ? band * kDegPerRad : 0;
    document["slew_time_s"] = t1 + coast + braking;
    document["rest_error_deg"] =
        (spec.law.deadband == Deadband::double_sided ? band : 0) * direction * kDegPerRad;
    document["thruster_on_time_s"] = band > 0 ? 2 * t1 : t1 + braking;
    document["braking_duty"] = band > 0 ? 1 / g : (1 + 1 / g + delta) / 2;
  } else if (band == 0) {
    document["overshoot_deg"] = rate * rate / (2 * a) * (1 / (1 - delta) - g) * kDegPerRad;
    document["first_stop_s"] = t1 + rate / (a * (1 - delta));
    // Each half cycle leaves the fraction rho of the error.
    const double rho = (1 - g) / (1 + g);
    if (delta == 0) document["slew_time_s"] = 2 * t1 / (1 - std::sqrt(rho));
  }
  return document;
}

// Frequencies clamped as they were given; free, as an observer of the attitude sees them.
json plant(const OnOffAxisSpecification& spec) {
  json document = {{"type", spec.plant.modes.empty() ? "rigid_axis" : "flexible_axis"},
                   {"inertia_kg_m2", spec.plant.inertia_kg_m2},
                   {"acceleration_deg_s2", spec.actuator.torque_N_m / spec.plant.inertia_kg_m2 * kDegPerRad}};
  // Two at the origin: momentum is conserved.
  json poles = {{0.0, 0.0}, {0.0, 0.0}};
  if (!spec.plant.modes.empty()) {
    const ModalBasis basis(spec.plant);
    json clamped = json::array(), free = json::array(), damped = json::array(), ratios = json::array();
    for (const ElasticMode& mode : spec.plant.modes)
      clamped.push_back(mode.frequency_rad_s / (2 * std::numbers::pi));
    for (const double w : basis.free_frequencies_rad_s()) free.push_back(w / (2 * std::numbers::pi));
    for (const auto& lambda : basis.lambda()) {
      damped.push_back(lambda.imag() / (2 * std::numbers::pi));
      ratios.push_back(-lambda.real() / std::abs(lambda));
      poles.push_back({lambda.real(), lambda.imag()});
      if (lambda.imag() != 0) poles.push_back({lambda.real(), -lambda.imag()});
    }
    document["residual_inertia_kg_m2"] = residual_inertia_kg_m2(spec.plant);
    document["clamped_frequencies_hz"] = std::move(clamped);
    document["free_frequencies_hz"] = std::move(free);
    document["free_damped_frequencies_hz"] = std::move(damped);
    document["free_damping_ratios"] = std::move(ratios);
  }
  document["poles_rad_s"] = std::move(poles);
  return document;
}

// What the run asks of the machine.
json size(const OnOffAxisSpecification& spec) {
  const double step_s =
      spec.evaluation == Evaluation::sampled ? spec.sample_period_s : spec.actuator.minimum_on_time_s;
  return {{"most_control_steps", step_s > 0 ? json(std::ceil(spec.duration_s / step_s)) : json(nullptr)},
          {"most_telemetry_samples", std::floor(spec.duration_s / spec.telemetry_period_s) + 2}};
}

}  // namespace

json describe(const Prepared& prepared) {
  const OnOffAxisSpecification& spec = prepared.system;
  const double g = error_factor(spec);
  const SwitchingFunction law(spec.law, spec.maneuver.final_angle_rad, slew_direction(spec.maneuver));
  json regularisation;
  if (spec.evaluation == Evaluation::sampled)
    regularisation = {{"type", "sampled"}, {"period_s", spec.sample_period_s}};
  else
    regularisation = {{"type", "minimum_on_time"}, {"minimum_on_time_s", spec.actuator.minimum_on_time_s}};
  return {{"plant", plant(spec)},
          {"law",
           {{"type", "switching_function"},
            {"error_factor", g},
            {"regime", g >= 1 ? "tracks the switching curve" : "leaves the switching curve, overshoots"},
            {"curvature_s2", law.curvature()},
            {"band_deg", {law.lower_rad() * kDegPerRad, law.upper_rad() * kDegPerRad}}}},
          {"regularisation", std::move(regularisation)},
          {"predictions", spec.plant.modes.empty() ? predictions(spec) : json(nullptr)},
          {"size", size(spec)},
          {"warnings", prepared.warnings},
          {"request", json::parse(prepared.resolved)}};
}

}  // namespace slew
