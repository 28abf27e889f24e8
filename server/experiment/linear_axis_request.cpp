#include "server/experiment/linear_axis_request.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/control/root_locus.hpp"
#include "server/experiment/axis_request.hpp"
#include "server/experiment/limits.hpp"
#include "server/experiment/shaper_request.hpp"

namespace slew {
namespace {

using nlohmann::json;

double radians(const json& value_deg) {
  return value_deg.get<double>() * (std::numbers::pi / 180);
}

std::optional<double> optional_number(const json& block, const char* name) {
  const auto place = block.find(name);
  return place == block.end() ? std::nullopt : std::optional(place->get<double>());
}

// Three figures are enough for people.
std::string rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string in_words(std::complex<double> pole) {
  std::string text = rounded(pole.real());
  if (pole.imag() != 0) text += " +- " + rounded(std::abs(pole.imag())) + "i";
  return text + " rad/s";
}

void check_estimator(const SoundFields& fields, const Violate& violate) {
  const auto positive = [&](const char* name, const char* what) {
    const std::string pointer = std::string("/estimator/") + name;
    if (const auto gain = fields.number(pointer); gain && *gain <= 0)
      violate(pointer, std::string("the estimate's error would not die out: ") + what, number(*gain),
              "greater than 0");
  };
  // The roots of s^2 + k_theta s + k_q, and of s + ell.
  positive("rate_gain_1_s2", "with k_q <= 0 an estimator pole is at the origin or in the right half plane");
  positive("attitude_gain_1_s", "with k_theta <= 0 an estimator pole is not in the left half plane");
  positive("gain_1_s", "with ell <= 0 the estimator's pole -ell is not in the left half plane");
}

LinearFeedback specify_feedback(const json& controller) {
  LinearFeedback feedback;
  if (controller.at("type") == "lead_compensation")
    feedback.law = LeadCompensation{controller.at("gain_N_m_rad"), controller.at("zero_rad_s"),
                                    controller.at("pole_rad_s")};
  else
    feedback.law =
        AttitudeRateFeedback{controller.at("attitude_gain_N_m_rad"), controller.at("rate_gain_N_m_s_rad")};
  feedback.loop_gain = controller.at("loop_gain");
  return feedback;
}

}  // namespace

bool has_linear_law(const SoundFields& fields) {
  return fields.says("/controller/type", "attitude_rate_feedback") ||
         fields.says("/controller/type", "lead_compensation");
}

bool is_linear_law(const json& controller) {
  const json& type = controller.at("type");
  return type == "attitude_rate_feedback" || type == "lead_compensation";
}

void check_linear_law(const SoundFields& fields, const Violate& violate) {
  check_estimator(fields, violate);
  const bool is_linear = has_linear_law(fields);
  const bool has_estimator = fields.has("/estimator/type") && !fields.says("/estimator/type", "none");
  if (has_estimator && fields.has("/controller/type") &&
      !fields.says("/controller/type", "attitude_rate_feedback"))
    violate("/estimator/type", "only attitude and rate feedback has a use for what is estimated",
            shortened(*fields.at("/estimator/type")),
            "\"none\", or controller.type \"attitude_rate_feedback\"");
  if (!is_linear) {
    if (!fields.has("/controller/type") || !fields.says("/actuator/type", "proportional")) return;
    if (!fields.says("/controller/type", "firing_program"))
      violate("/actuator/type", "a law that fires or does not fire has no use for proportional thrusters",
              "\"proportional\"",
              "\"on_off_pair\", or controller.type \"attitude_rate_feedback\", \"lead_compensation\" or "
              "\"firing_program\"");
    else if (fields.lacks("/actuator", "torque_N_m"))
      violate("/actuator/torque_N_m", "a firing of a program is of a torque, which nobody has told", "",
              "given with controller.type \"firing_program\"");
    return;
  }
  if (fields.says("/actuator/type", "proportional") && fields.has("/actuator/torque_N_m"))
    violate("/actuator/torque_N_m", "a linear law asks for any torque: its thrusters have no full one",
            shortened(*fields.at("/actuator/torque_N_m")), "left out, or controller.type \"firing_program\"");
  if (fields.has("/actuator/type") && !fields.says("/actuator/type", "proportional"))
    violate("/actuator/type", "a linear law asks for any torque, which on-off thrusters do not give",
            shortened(*fields.at("/actuator/type")), "\"proportional\"");
  if (fields.says("/stop/when", "end_box"))
    violate("/stop/when", "a linear law has no end box to stop at", "\"end_box\"",
            "\"duration\" or \"first_rest\"");
  const json* disturbances = fields.at("/disturbances");
  if (!disturbances || !disturbances->is_array()) return;
  for (std::size_t i = 0; i < disturbances->size(); ++i) {
    const std::string pointer = "/disturbances/" + std::to_string(i) + "/type";
    if (fields.says(pointer, "friction"))
      violate(pointer, "with friction the loop is not linear: it is flown in closed form without it",
              "\"friction\"", "\"constant\", \"step\" or \"sinusoid\"");
    if (fields.says(pointer, "fraction_of_thrust"))
      violate(pointer, "proportional thrusters have no level of thrust to take a fraction of",
              "\"fraction_of_thrust\"", "\"constant\", \"step\" or \"sinusoid\"");
  }
}

LinearAxisSpecification specify_linear_axis(const json& request) {
  LinearAxisSpecification spec;
  specify_axis(request, 0, spec);
  spec.feedback = specify_feedback(request.at("controller"));
  const json& actuator = request.at("actuator");
  spec.actuator = {.lever_arm_m = optional_number(actuator, "lever_arm_m"),
                   .specific_impulse_s = optional_number(actuator, "specific_impulse_s"),
                   .gas_density_kg_m3 = optional_number(actuator, "gas_density_kg_m3")};
  const auto shape = [&] {
    if (spec.shaper.is_there()) spec.impulses = impulses_or_none(spec.shaper, vibrating_modes(spec));
  };
  const json& estimator = request.at("estimator");
  const auto& type = estimator.at("type").get_ref<const std::string&>();
  if (type == "none") return shape(), spec;
  const double inertia = estimator.value("inertia_kg_m2", spec.plant.inertia_kg_m2);
  spec.estimate.rate_rad_s = radians(estimator.at("initial_rate_deg_s"));
  if (type == "first_order_angle") {
    spec.estimator = FirstOrderAngleEstimator{estimator.at("gain_1_s"), inertia};
    return shape(), spec;
  }
  spec.estimator =
      SecondOrderAngleEstimator{estimator.at("rate_gain_1_s2"), estimator.at("attitude_gain_1_s"), inertia};
  if (estimator.contains("initial_angle_deg"))
    spec.estimate.error_rad = radians(estimator.at("initial_angle_deg")) - spec.maneuver.final_angle_rad;
  return shape(), spec;
}

std::optional<Violation> why_it_cannot_be_built(const LinearAxisSpecification& spec) {
  const double steps = propagator_steps(spec), most = limits().max_steps;
  if (steps <= most) return std::nullopt;
  return Violation{"/simulation/duration_s",
                   "the run would take " + number(steps) + " propagator steps: the loop is too fast for it",
                   number(spec.duration_s),
                   "at most " + number(spec.duration_s * most / steps) + " s with this loop"};
}

std::vector<std::string> warnings_about(const LinearAxisSpecification& spec) {
  std::vector<std::string> warnings;
  const ControlLoop loop = control_loop(spec);
  const auto poles = loop.poles(spec.feedback.loop_gain);
  if (!is_stable(poles)) {
    const auto rightmost = *std::max_element(
        poles.begin(), poles.end(), [](const auto& a, const auto& b) { return a.real() < b.real(); });
    const auto* lead = std::get_if<LeadCompensation>(&spec.feedback.law);
    std::string why = "the closed loop is not stable: its rightmost pole is at ";
    if (lead && lead->pole_rad_s <= lead->zero_rad_s)
      why =
          "lead compensation is stable only with its pole beyond its zero (b > a): the closed loop's "
          "rightmost pole is at ";
    warnings.push_back(why + in_words(rightmost));
  }
  warn_of_growing_modes(spec.plant, warnings);
  warn_of_late_arrival(spec.impulses, 0, spec.duration_s, warnings);
  if (!spec.impulses.empty() && spec.maneuver.initial_rate_rad_s != 0)
    warnings.push_back("the initial rate is not commanded: the vibration that it leaves is not shaped");
  return warnings;
}

}  // namespace slew
