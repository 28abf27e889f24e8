#include "server/experiment/axis_request.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "server/experiment/frame_request.hpp"
#include "server/experiment/shaper_request.hpp"
#include "server/propagation/modal_basis.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr double kRadPerDeg = std::numbers::pi / 180;

double radians(const json& value_deg) {
  return value_deg.get<double>() * kRadPerDeg;
}

std::optional<double> optional_number(const json& block, const char* name) {
  const auto place = block.find(name);
  return place == block.end() ? std::nullopt : std::optional(place->get<double>());
}

SingleAxisPlant specify_plant(const json& plant) {
  if (is_frame(plant)) return specify_frame_plant(plant);
  SingleAxisPlant spec{plant.at("inertia_kg_m2"), {}};
  if (const auto modes = plant.find("modes"); modes != plant.end())
    for (const json& mode : *modes)
      spec.modes.push_back({.frequency_rad_s = 2 * std::numbers::pi * mode.at("frequency_hz").get<double>(),
                            .damping = mode.at("damping_ratio"),
                            .coupling_sqrt_kg_m = mode.at("coupling_sqrt_kg_m")});
  return spec;
}

OnOffPairParameters specify_actuator(const json& actuator) {
  return {.torque_N_m = actuator.at("torque_N_m"),
          .minimum_on_time_s = actuator.value("minimum_on_time_s", 0.0),
          .switching_delay_s = actuator.value("switching_delay_s", 0.0),
          .lever_arm_m = optional_number(actuator, "lever_arm_m"),
          .specific_impulse_s = optional_number(actuator, "specific_impulse_s"),
          .gas_density_kg_m3 = optional_number(actuator, "gas_density_kg_m3")};
}

Disturbances specify_disturbances(const json& disturbances, double thrust_N_m) {
  Disturbances spec;
  for (const json& disturbance : disturbances) {
    const auto& type = disturbance.at("type").get_ref<const std::string&>();
    if (type == "constant") spec.constant_N_m += disturbance.at("torque_N_m").get<double>();
    if (type == "fraction_of_thrust")
      spec.constant_N_m += disturbance.at("fraction").get<double>() * thrust_N_m;
    if (type == "friction") spec.friction_N_m += disturbance.at("torque_N_m").get<double>();
    if (type == "step") spec.steps.push_back({disturbance.at("from_s"), disturbance.at("torque_N_m")});
    if (type == "sinusoid")
      spec.sinusoids.push_back({disturbance.at("amplitude_N_m"),
                                2 * std::numbers::pi * disturbance.at("frequency_hz").get<double>(),
                                radians(disturbance.at("phase_deg"))});
  }
  std::stable_sort(spec.steps.begin(), spec.steps.end(),
                   [](const StepDisturbance& a, const StepDisturbance& b) { return a.from_s < b.from_s; });
  return spec;
}

}  // namespace

void specify_axis(const json& request, double thrust_N_m, AxisSpecification& spec) {
  const json& maneuver = request.at("maneuver");
  spec.plant = specify_plant(request.at("plant"));
  spec.maneuver = {.initial_angle_rad = radians(maneuver.at("initial_angle_deg")),
                   .initial_rate_rad_s = radians(maneuver.at("initial_rate_deg_s")),
                   .final_angle_rad = radians(maneuver.at("final_angle_deg"))};
  spec.disturbances = specify_disturbances(request.at("disturbances"), thrust_N_m);
  spec.shaper = specify_shaper(request.at("guidance"));
  const std::string& stop = request.at("stop").at("when").get_ref<const std::string&>();
  if (stop == "end_box") spec.stop = StopCondition::end_box;
  if (stop == "first_rest") spec.stop = StopCondition::first_rest;
  const json& tolerance = request.at("metrics").at("settling").at("tolerance");
  spec.settling = tolerance.at("type") == "absolute"
                      ? SettlingCriterion{SettlingTolerance::absolute, radians(tolerance.at("value_deg"))}
                      : SettlingCriterion{SettlingTolerance::fraction_of_initial, tolerance.at("value")};
  const json& simulation = request.at("simulation");
  spec.duration_s = simulation.at("duration_s");
  spec.verification_tolerance = simulation.at("verification_relative_tolerance");
  spec.telemetry_period_s = request.at("telemetry").at("sample_period_s");
  spec.output_times_s = request.at("outputs").at("at_s").get<std::vector<double>>();
  std::sort(spec.output_times_s.begin(), spec.output_times_s.end());
}

namespace {

SwitchingFunctionParameters specify_band(const json& controller) {
  SwitchingFunctionParameters law;
  if (controller.at("type") == "schmitt_trigger") {
    law.deadband = Deadband::double_sided;
    law.deadband_rad = radians(controller.at("on_deg"));
    law.hysteresis_rad = law.deadband_rad - radians(controller.at("off_deg"));
  } else {
    const json& deadband = controller.at("deadband");
    if (deadband.at("type") == "double_sided") law.deadband = Deadband::double_sided;
    if (deadband.at("type") == "single_sided") law.deadband = Deadband::single_sided;
    if (deadband.contains("width_deg")) law.deadband_rad = radians(deadband.at("width_deg"));
    law.hysteresis_rad = radians(controller.at("hysteresis_deg"));
  }
  if (const auto box = controller.find("end_box"); box != controller.end())
    law.end_box = EndBox{radians(box->at("angle_deg")), radians(box->at("rate_deg_s"))};
  return law;
}

void specify_evaluation(const json& evaluation, OnOffAxisSpecification& spec) {
  const auto& type = evaluation.at("type").get_ref<const std::string&>();
  if (type == "ideal") spec.evaluation = Evaluation::ideal;
  if (type != "sampled") return;
  spec.evaluation = Evaluation::sampled;
  spec.sample_period_s = evaluation.at("period_s");
}

void specify_law(const json& controller, OnOffAxisSpecification& spec) {
  const auto& type = controller.at("type").get_ref<const std::string&>();
  if (type == "firing_program") {
    spec.evaluation = Evaluation::program;
    spec.law.gamma_bar = 0;
    for (const json& firing : controller.at("firings"))
      spec.program.push_back({firing.at("from_s"), firing.at("to_s"), firing.at("direction")});
    return;
  }
  spec.law = specify_band(controller);
  specify_evaluation(controller.at("evaluation"), spec);
  spec.law.torque_N_m = spec.actuator.torque_N_m;
  spec.law.inertia_kg_m2 = spec.plant.inertia_kg_m2;
  if (type != "switching_function") {
    spec.law.gamma_bar = 0;
    spec.law.rate_gain_s = controller.at("rate_gain_s");
    return;
  }
  // I*/N* = gamma I/N (Agrawal & Bang 1995, Eq. 7).
  spec.law.inertia_kg_m2 =
      controller.at("gamma").get<double>() * controller.value("inertia_kg_m2", spec.plant.inertia_kg_m2);
  spec.law.torque_N_m = controller.value("torque_N_m", spec.actuator.torque_N_m);
  spec.law.gamma_bar = controller.at("gamma_bar");
}

}  // namespace

OnOffAxisSpecification specify_on_off_axis(const json& request) {
  OnOffAxisSpecification spec;
  spec.actuator = specify_actuator(request.at("actuator"));
  specify_axis(request, spec.actuator.torque_N_m, spec);
  specify_law(request.at("controller"), spec);
  if (spec.shaper.is_there()) spec.impulses = impulses_or_none(spec.shaper, vibrating_modes(spec));
  return spec;
}

std::optional<Violation> why_it_cannot_be_built(const OnOffAxisSpecification& spec) try {
  const ModalBasis basis(spec.plant, spec.disturbances.sinusoids);
  return std::nullopt;
} catch (const std::domain_error& error) {
  return Violation{"/plant", std::string("the motion has no closed form: ") + error.what(), "",
                   "modes, or a sinusoid, that differ a little from these"};
}

std::vector<std::string> warnings_about(const OnOffAxisSpecification& spec) {
  std::vector<std::string> warnings;
  const bool has_law = spec.evaluation != Evaluation::program;
  const double slew_rad = std::abs(spec.maneuver.final_angle_rad - spec.maneuver.initial_angle_rad);
  if (has_law && spec.law.deadband != Deadband::none && spec.law.deadband_rad >= slew_rad &&
      spec.maneuver.initial_rate_rad_s == 0)
    warnings.push_back("the dead band is not smaller than the slew: nothing fires");
  const double g = error_factor(spec);
  if (spec.law.rate_gain_s == 0 && spec.law.deadband == Deadband::single_sided && g < 1)
    warnings.push_back("gamma_bar times gamma is " + json(g).dump() +
                       ", below 1: with a single-sided dead band the slew overshoots and ends slowly "
                       "(Agrawal & Bang 1995 ask for gamma_bar >= 1/gamma_min)");
  if (spec.law.rate_gain_s > 0 && spec.law.deadband == Deadband::none &&
      spec.actuator.switching_delay_s >= spec.law.rate_gain_s)
    warnings.push_back(
        "the switching delay is not smaller than the rate gain tau: the limit cycle grows without bound");
  double most_N_m = std::abs(spec.disturbances.constant_N_m), sum_N_m = spec.disturbances.constant_N_m;
  for (const StepDisturbance& step : spec.disturbances.steps) {
    sum_N_m += step.torque_N_m;
    most_N_m = std::max(most_N_m, std::abs(sum_N_m));
  }
  for (const Sinusoid& sinusoid : spec.disturbances.sinusoids) most_N_m += std::abs(sinusoid.amplitude_N_m);
  if (most_N_m >= spec.actuator.torque_N_m)
    warnings.push_back(
        "the disturbance is not smaller than the thrusters' torque: they cannot hold against it");
  if (spec.disturbances.friction_N_m >= spec.actuator.torque_N_m)
    warnings.push_back("friction is not smaller than the thrusters' torque: they cannot start the motion");
  warn_of_growing_modes(spec.plant, warnings);
  if (!spec.program.empty())
    warn_of_late_arrival(spec.impulses, spec.program.back().to_s, spec.duration_s, warnings);
  return warnings;
}

void warn_of_growing_modes(const SingleAxisPlant& plant, std::vector<std::string>& warnings) {
  for (std::size_t i = 0; i < plant.modes.size(); ++i)
    if (plant.modes[i].damping < 0)
      warnings.push_back("mode " + std::to_string(i + 1) + " has negative damping: it grows by itself");
}

}  // namespace slew
