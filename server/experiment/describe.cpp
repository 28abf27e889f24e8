// What a requested single-axis system is, from closed forms: no flight.
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "server/experiment/description.hpp"
#include "server/experiment/experiment.hpp"
#include "server/experiment/phase_plane.hpp"
#include "server/experiment/plan_document.hpp"
#include "server/experiment/shaper_request.hpp"
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
  const bool has_other_disturbances = !spec.disturbances.steps.empty() ||
                                      !spec.disturbances.sinusoids.empty() ||
                                      spec.disturbances.friction_N_m != 0;
  if (slew == 0 || spec.maneuver.initial_rate_rad_s != 0 || std::abs(delta) >= 1 || has_other_disturbances)
    return nullptr;

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

// Modes without one, two that are alike and critically damped, are flown by power series only.
std::optional<ModalBasis> basis_of(const SingleAxisPlant& plant) try {
  return ModalBasis(plant);
} catch (const std::domain_error&) {
  return std::nullopt;
}

}  // namespace

// Frequencies clamped as they were given; free, as an observer of the attitude sees them.
json plant_document(const SingleAxisPlant& plant) {
  json document = {{"type", plant.modes.empty() ? "rigid_axis" : "flexible_axis"},
                   {"inertia_kg_m2", plant.inertia_kg_m2}};
  // Two at the origin: momentum is conserved.
  json poles = {{0.0, 0.0}, {0.0, 0.0}};
  if (!plant.modes.empty()) {
    json clamped = json::array();
    for (const ElasticMode& mode : plant.modes)
      clamped.push_back(mode.frequency_rad_s / (2 * std::numbers::pi));
    document["residual_inertia_kg_m2"] = residual_inertia_kg_m2(plant);
    document["clamped_frequencies_hz"] = std::move(clamped);
    const auto basis = basis_of(plant);
    if (!basis) return document;
    json free = json::array(), damped = json::array(), ratios = json::array();
    for (const double w : basis->free_frequencies_rad_s()) free.push_back(w / (2 * std::numbers::pi));
    for (const auto& lambda : basis->lambda()) {
      damped.push_back(lambda.imag() / (2 * std::numbers::pi));
      ratios.push_back(-lambda.real() / std::abs(lambda));
      poles.push_back({lambda.real(), lambda.imag()});
      if (lambda.imag() != 0) poles.push_back({lambda.real(), -lambda.imag()});
    }
    document["free_frequencies_hz"] = std::move(free);
    document["free_damped_frequencies_hz"] = std::move(damped);
    document["free_damping_ratios"] = std::move(ratios);
  }
  document["poles_rad_s"] = std::move(poles);
  return document;
}

namespace {

// What the run asks of the machine.
json size(const OnOffAxisSpecification& spec) {
  const double step_s =
      spec.evaluation == Evaluation::sampled ? spec.sample_period_s : spec.actuator.minimum_on_time_s;
  return {{"most_control_steps", step_s > 0 ? json(std::ceil(spec.duration_s / step_s)) : json(nullptr)},
          {"most_telemetry_samples", std::floor(spec.duration_s / spec.telemetry_period_s) + 2}};
}

// Linear law, rigid body, undisturbed. With s going on at alpha_1 and off at alpha_0 (Bryson 1994, Eqs. 3.13
// and 3.14; a relay with hysteresis is alpha_0 = -alpha_1); with a switching delay D < tau instead, derived:
// the rate at a switching is the largest, N D (2 tau - D) / (2 (tau - D)).
json limit_cycle(const OnOffAxisSpecification& spec, const SwitchingFunction& law) {
  const double tau = law.rate_gain(), n = spec.actuator.torque_N_m / spec.plant.inertia_kg_m2;
  const double delay_s = spec.actuator.switching_delay_s;
  const bool is_plain = spec.plant.modes.empty() && spec.evaluation == Evaluation::continuous &&
                        spec.law.gamma_bar == 0 && spec.disturbances == Disturbances{} &&
                        spec.actuator.minimum_on_time_s == 0 && law.upper_rad() == -law.lower_rad();
  if (!is_plain || law.has_hysteresis() == (delay_s > 0)) return nullptr;
  double period_s = 0, amplitude_rad = 0, rate_rad_s = 0, coast_s = 0, firing_s = 0;
  if (law.has_hysteresis()) {
    const double on = law.enter_above_rad(), off = law.leave_above_rad();
    rate_rad_s = (on - off) / (2 * tau);
    coast_s = (on + off) / rate_rad_s;
    firing_s = 2 * rate_rad_s / n;
    period_s = 4 * tau * ((on + off) / (on - off) + (on - off) / (2 * n * tau * tau));
    amplitude_rad = 0.5 * (on + off) + 0.125 * (on - off) * (on - off) / (n * tau * tau);
  } else {
    if (!law.is_a_line() || delay_s >= tau) return nullptr;
    rate_rad_s = n * delay_s * (2 * tau - delay_s) / (2 * (tau - delay_s));
    firing_s = 2 * rate_rad_s / n;
    period_s = 2 * firing_s;
    amplitude_rad = rate_rad_s * rate_rad_s / (2 * n);
  }
  return {{"period_s", period_s},
          {"amplitude_deg", amplitude_rad * kDegPerRad},
          {"rate_amplitude_deg_s", rate_rad_s * kDegPerRad},
          {"coast_s", coast_s},
          {"firing_s", firing_s}};
}

// Along the line theta + tau omega = 0 of a relay with a delay, at the initial rate; to first order in the
// delay.
json chatter_period_s(const OnOffAxisSpecification& spec, const SwitchingFunction& law) {
  const double most_rad_s = spec.actuator.torque_N_m / spec.plant.inertia_kg_m2 * law.rate_gain();
  const double rate = spec.maneuver.initial_rate_rad_s, delay_s = spec.actuator.switching_delay_s;
  if (spec.evaluation != Evaluation::continuous || delay_s == 0 || spec.law.gamma_bar != 0 ||
      !law.is_a_line() || std::abs(rate) >= most_rad_s)
    return nullptr;
  return 4 * delay_s * most_rad_s * most_rad_s / (most_rad_s * most_rad_s - rate * rate);
}

json law_document(const OnOffAxisSpecification& spec, const SwitchingFunction& law) {
  if (spec.evaluation == Evaluation::program)
    return {{"type", "firing_program"}, {"firings", spec.program.size()}};
  json document = {
      {"type", spec.law.gamma_bar == 0 ? "linear_switching_function" : "switching_function"},
      {"rate_gain_s", law.rate_gain()},
      {"curvature_s2", law.curvature()},
      {"band_deg", {law.lower_rad() * kDegPerRad, law.upper_rad() * kDegPerRad}},
      {"fires_above_deg",
       {{"from", law.enter_above_rad() * kDegPerRad}, {"to", law.leave_above_rad() * kDegPerRad}}},
      {"fires_below_deg",
       {{"from", law.enter_below_rad() * kDegPerRad}, {"to", law.leave_below_rad() * kDegPerRad}}}};
  if (spec.law.gamma_bar != 0) {
    const double g = error_factor(spec);
    document["error_factor"] = g;
    document["regime"] = g >= 1 ? "tracks the switching curve" : "leaves the switching curve, overshoots";
  } else if (law.rate_gain() > 0) {
    // Bryson 1994, Fig. 3.5: below N tau both sides point at the line, and theta falls as exp(-t/tau).
    document["slides_below_rate_deg_s"] =
        spec.actuator.torque_N_m / spec.plant.inertia_kg_m2 * law.rate_gain() * kDegPerRad;
    document["regime"] = "tracks the switching line";
  }
  return document;
}

// What keeps the number of switchings finite.
json regularisation(const OnOffAxisSpecification& spec) {
  switch (spec.evaluation) {
    case Evaluation::sampled:
      return {{"type", "sampled"}, {"period_s", spec.sample_period_s}};
    case Evaluation::ideal:
      return {{"type", "sliding"}};
    case Evaluation::program:
      return {{"type", "program"}};
    case Evaluation::continuous:
      break;
  }
  json document = json::object();
  if (spec.law.hysteresis_rad > 0) {
    document["type"] = "hysteresis";
    document["hysteresis_deg"] = spec.law.hysteresis_rad * kDegPerRad;
  }
  if (spec.actuator.switching_delay_s > 0) {
    document["type"] = "switching_delay";
    document["switching_delay_s"] = spec.actuator.switching_delay_s;
  }
  if (spec.actuator.minimum_on_time_s > 0) {
    document["type"] = "minimum_on_time";
    document["minimum_on_time_s"] = spec.actuator.minimum_on_time_s;
  }
  return document;
}

// The torque of a program, which can be shaped; a law commands none that could.
json torque_document(const OnOffAxisSpecification& spec) {
  if (spec.evaluation != Evaluation::program) return nullptr;
  json document = command_document(spec.shaper, vibrating_modes(spec), spec.impulses,
                                   spec.program.empty() ? 0 : spec.program.back().to_s);
  document["type"] = "torque";
  return document;
}

// For a rigid axis; null where no closed form applies.
json all_predictions(const OnOffAxisSpecification& spec, const SwitchingFunction& law) {
  if (!spec.plant.modes.empty() || spec.evaluation == Evaluation::program) return nullptr;
  if (spec.law.gamma_bar != 0) return predictions(spec);
  return {{"limit_cycle", limit_cycle(spec, law)}, {"chatter_period_s", chatter_period_s(spec, law)}};
}

}  // namespace

json system_document(const OnOffAxisSpecification& spec) {
  const SwitchingFunction law(spec.law, spec.maneuver.final_angle_rad, slew_direction(spec.maneuver));
  json plant = plant_document(spec.plant);
  plant["acceleration_deg_s2"] = spec.actuator.torque_N_m / spec.plant.inertia_kg_m2 * kDegPerRad;
  return {{"plant", std::move(plant)},
          {"law", law_document(spec, law)},
          {"regularisation", regularisation(spec)},
          {"command", torque_document(spec)},
          {"predictions", all_predictions(spec, law)},
          {"size", size(spec)}};
}

json design_document(const OnOffAxisSpecification& spec) {
  return phase_plane(spec);
}

json describe(const Prepared& prepared) {
  json document = std::visit([](const auto& spec) { return system_document(spec); }, prepared.system);
  if (prepared.planning) document["guidance"] = problem_document(*prepared.planning);
  if (prepared.planning && prepared.planning->given) {
    const PlanningTask& task = *prepared.planning;
    document["command"] = command_document(task.shaper, own_modes(task), task.impulses, task.unshaped_end_s);
    document["command"]["type"] = "controls";
  }
  document["warnings"] = prepared.warnings;
  document["request"] = json::parse(prepared.resolved);
  return document;
}

json design_curves(const Prepared& prepared) {
  return std::visit([](const auto& spec) { return design_document(spec); }, prepared.system);
}

}  // namespace slew
