// What is wrong with a guidance block, in the words and at the places of the request.
#include <Eigen/LU>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "server/experiment/attitude_request.hpp"
#include "server/experiment/guidance_request.hpp"
#include "server/experiment/law_fields.hpp"

namespace slew {
namespace {

using nlohmann::json;

bool has_guidance(const SoundFields& fields) {
  const json* type = fields.at("/guidance/type");
  return type && *type != "none";
}

// What is planned must be flown, and what is flown planned.
void check_use(const SoundFields& fields, const Violate& violate) {
  const bool flies = fields.says("/controller/type", "planned_torque");
  const bool follows = fields.says("/maneuver/reference/type", "planned");
  if (!has_guidance(fields)) {
    if (flies)
      violate("/controller/type", "there is no plan whose torque could be flown", "\"planned_torque\"",
              "another law, or guidance of type \"time_optimal\" or \"given_controls\"");
    if (follows)
      violate("/maneuver/reference/type", "there is no plan whose motion could be followed", "\"planned\"",
              "another reference, or guidance of type \"time_optimal\" or \"given_controls\"");
    const json* rate = fields.at("/maneuver/final_rate_deg_s");
    if (rate && rate->is_array() &&
        std::any_of(rate->begin(), rate->end(), [](const json& w) { return w != 0; }))
      violate("/maneuver/final_rate_deg_s", "only a plan can end at a rate; laws bring the body to rest",
              shortened(*rate), "[0, 0, 0], or guidance of type \"time_optimal\"");
    return;
  }
  if (!flies && !follows && fields.has("/controller/type") && fields.has("/maneuver/reference/type"))
    violate("/guidance/type", "nothing flies what is planned", shortened(*fields.at("/guidance/type")),
            "controller.type \"planned_torque\", or maneuver.reference of type \"planned\", or guidance of "
            "type \"none\"");
  const json* rate = fields.at("/maneuver/final_rate_deg_s");
  if (follows && rate && rate->is_array() &&
      std::any_of(rate->begin(), rate->end(), [](const json& w) { return w != 0; }))
    violate("/maneuver/final_rate_deg_s",
            "a reference that ends at a rate leaves nothing to follow after its end", shortened(*rate),
            "[0, 0, 0], or controller.type \"planned_torque\"");
}

// Rows of numbers, where all of them are sound.
std::optional<Eigen::Matrix3d> sound_matrix(const SoundFields& fields, const std::string& pointer) {
  Eigen::Matrix3d matrix;
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j) {
      const auto entry = fields.number(pointer + '/' + std::to_string(i) + '/' + std::to_string(j));
      if (!entry) return std::nullopt;
      matrix(i, j) = *entry;
    }
  return matrix;
}

// Couples that are given one by one: B, where all of it is sound.
std::optional<Eigen::Matrix3d> sound_couples(const SoundFields& fields) {
  const json* thrusters = fields.at("/actuator/thrusters");
  if (!thrusters || !thrusters->is_array()) return std::nullopt;
  for (std::size_t i = 0; i < thrusters->size(); ++i) {
    const std::string place = "/actuator/thrusters/" + std::to_string(i);
    for (const char* name : {"/thrust_N", "/couple", "/sign", "/position_m/0", "/position_m/1",
                             "/position_m/2", "/direction/0", "/direction/1", "/direction/2"})
      if (!fields.number(place + name)) return std::nullopt;
  }
  std::optional<Eigen::Matrix3d> net_force_N;
  return influence_of_couples(*fields.at("/actuator"), net_force_N);
}

void check_influence(const SoundFields& fields, const Violate& violate) {
  std::string pointer = "/actuator/influence_N_m";
  const bool is_given = fields.has(pointer), are_couples = fields.says("/actuator/type", "thruster_couples");
  if (are_couples && !is_given && fields.lacks("/actuator", "influence_N_m") &&
      fields.lacks("/actuator", "thrusters"))
    violate(pointer, "a required field is missing", "", "given, or thrusters");
  if (are_couples && is_given && fields.has("/actuator/thrusters"))
    violate("/actuator/thrusters", "an influence matrix and thrusters say the same thing twice",
            shortened(*fields.at("/actuator/thrusters")), "left out, or influence_N_m left out");
  if (is_given && fields.has("/actuator/maximum_torque_N_m"))
    violate("/actuator/maximum_torque_N_m", "an influence matrix has its own maximum",
            shortened(*fields.at("/actuator/maximum_torque_N_m")), "left out, or influence_N_m left out");
  if (!is_given && !are_couples) return;
  const auto influence = is_given ? sound_matrix(fields, pointer) : sound_couples(fields);
  if (!influence) return;
  if (!is_given) pointer = "/actuator/thrusters";
  constexpr double kRounding = 1e-9;
  Eigen::JacobiSVD<Eigen::Matrix3d> svd(*influence, Eigen::ComputeFullU);
  if (svd.singularValues()[2] > kRounding * svd.singularValues()[0]) return;
  const Eigen::Vector3d axis = svd.matrixU().col(2);
  violate(pointer,
          "the controls give no torque about an axis, here near (" + number(axis[0]) + ", " +
              number(axis[1]) + ", " + number(axis[2]) + ")",
          shortened(*fields.at(pointer)), "three torques that do not lie in a plane");
}

std::size_t control_count(const SoundFields& fields) {
  const json* thrusters = fields.at("/actuator/thrusters");
  const bool is_set = fields.says("/actuator/type", "thruster_set") && thrusters && thrusters->is_array();
  return is_set ? thrusters->size() : 3;
}

// Lists with one entry for each control.
void check_lists(const SoundFields& fields, const std::string& block, const Violate& violate) {
  const std::size_t controls = control_count(fields);
  for (const char* name : {"sequences", "switch_starts_s", "switch_times_s", "switches", "smoothness",
                           "widths", "amplitudes", "switch_fractions", "first_peaks", "last_peaks"}) {
    const json* list = fields.at(block + '/' + name);
    if (list && list->is_array() && list->size() != controls)
      violate(block + '/' + name, "there is one entry for each control of the actuator",
              std::to_string(list->size()) + " entries", std::to_string(controls));
  }
  for (const char* name : {"/widths", "/least_width", "/most_width"}) {
    const json* value = fields.at(block + name);
    if (!value) continue;
    for (const json& one : value->is_array() ? *value : json::array({*value}))
      if (one.is_number() && one > 0.25)
        violate(block + name, "two impulses of this width do not fit into the maneuver", number(one),
                "at most 0.25");
  }
  for (const char* name : {"/rise_fraction", "/most_rise_fraction"})
    if (const auto rise = fields.number(block + name); rise && *rise > 0.5)
      violate(block + name, "rise and fall do not fit into the maneuver", number(*rise), "at most 0.5");
}

// Of each control as many signs as switches and one more, the switches in their order within the maneuver.
void check_program(const SoundFields& fields, const std::string& block, const char* times_name, double end_s,
                   const Violate& violate) {
  const json *sequences = fields.at(block + "/sequences"), *times = fields.at(block + '/' + times_name);
  if (times && !sequences && fields.lacks(block, "sequences"))
    violate(block + '/' + times_name, "times of switches need the signs between them", shortened(*times),
            "given together with sequences");
  if (!sequences || !sequences->is_array()) return;
  for (std::size_t i = 0; i < sequences->size(); ++i) {
    const std::string place = block + "/sequences/" + std::to_string(i);
    const json& signs = (*sequences)[i];
    if (!signs.is_array() || !fields.has(place)) continue;
    for (std::size_t k = 1; k < signs.size(); ++k)
      if (signs[k] == signs[k - 1])
        violate(place + '/' + std::to_string(k), "a switch changes a control", shortened(signs[k]),
                "other than the sign before it");
    const std::string at = block + '/' + times_name + '/' + std::to_string(i);
    const json* own = fields.at(at);
    if (!own || !own->is_array()) continue;
    if (own->size() + 1 != signs.size())
      violate(at, "a control has one switch less than it has signs",
              std::to_string(own->size()) + " switches", std::to_string(signs.size() - 1));
    double last = 0;
    for (std::size_t k = 0; k < own->size(); ++k) {
      const auto time = fields.number(at + '/' + std::to_string(k));
      if (!time) continue;
      if (*time < last || *time > end_s)
        violate(at + '/' + std::to_string(k), "switches come in their order, within the maneuver",
                number(*time),
                "from " + number(last) + (std::isfinite(end_s) ? " to " + number(end_s) : " on"));
      last = std::max(last, *time);
    }
  }
}

// What is switched on is on altogether.
void check_authority(const SoundFields& fields, const Violate& violate) {
  const auto authority = fields.number("/guidance/authority");
  if (authority && *authority < 1 && fields.says("/controller/type", "planned_torque") &&
      fields.says("/actuator/modulator/type", "schmitt_trigger"))
    violate("/guidance/authority",
            "thrusters that are on or off do not fly a part of themselves in open loop", number(*authority),
            "1, or another modulator, or a law that follows the plan");
}

void check_limits(const SoundFields& fields, const Violate& violate) {
  const bool has_gas = fields.has("/guidance/gas_limit_m3"),
             has_mass = fields.has("/guidance/propellant_limit_kg");
  if (has_gas && has_mass)
    violate("/guidance/propellant_limit_kg", "one limit on what is used is enough",
            shortened(*fields.at("/guidance/propellant_limit_kg")), "left out, or gas_limit_m3 left out");
  const bool knows_gas =
      fields.has("/actuator/gas_flow_m3_s") ||
      (fields.has("/actuator/specific_impulse_s") && fields.has("/actuator/gas_density_kg_m3"));
  const bool knows_mass =
      fields.has("/actuator/specific_impulse_s") && !fields.has("/actuator/gas_density_kg_m3");
  if (has_gas && !knows_gas)
    violate("/guidance/gas_limit_m3", "the actuator does not tell what gas it uses",
            shortened(*fields.at("/guidance/gas_limit_m3")),
            "left out, or actuator.gas_flow_m3_s, or specific_impulse_s and gas_density_kg_m3");
  if (has_mass && !has_gas && !knows_mass)
    violate("/guidance/propellant_limit_kg", "the actuator does not tell what propellant it uses by its mass",
            shortened(*fields.at("/guidance/propellant_limit_kg")),
            "left out, or actuator.specific_impulse_s, without gas_density_kg_m3");
}

void check_parameters(const SoundFields& fields, const Violate& violate) {
  const json* parameters = fields.at("/guidance/family/parameters");
  if (!parameters || !parameters->is_array()) return;
  const std::size_t controls = control_count(fields);
  std::size_t needed = 3 * controls;
  if (fields.says("/guidance/family/type", "smooth_switches")) {
    needed = 2 * controls + 1;
    const json* switches = fields.at("/guidance/family/switches");
    for (std::size_t i = 0; i < controls; ++i)
      needed += switches && i < switches->size() && (*switches)[i].is_number_unsigned()
                    ? (*switches)[i].get<std::size_t>()
                    : 1;
  }
  // Smoothness and rise may be left to the fields that name them.
  const bool fits =
      parameters->size() == needed ||
      (fields.says("/guidance/family/type", "smooth_switches") &&
       parameters->size() + controls + 1 == needed) ||
      (fields.says("/guidance/family/type", "impulses") && parameters->size() + controls == needed);
  if (!fits)
    violate("/guidance/family/parameters", "there is one entry for each parameter of the family",
            std::to_string(parameters->size()) + " entries",
            std::to_string(needed) + ", or without the last that have fields of their own");
  for (std::size_t k = 0; k < parameters->size(); ++k) {
    const std::string place = "/guidance/family/parameters/" + std::to_string(k);
    const auto least = fields.number(place + "/least"), most = fields.number(place + "/most");
    if (least && most && *least > *most)
      violate(place + "/least", "the least is more than the most", number(*least),
              "at most " + number(*most));
  }
}

}  // namespace

void check_guidance(const SoundFields& fields, const Violate& violate) {
  if (!has_three_axes(fields)) {
    if (has_guidance(fields) && fields.has("/plant/type"))
      violate("/guidance/type", "maneuvers are planned for a body in three axes",
              shortened(*fields.at("/guidance/type")), "\"none\", or plant of type \"rigid_body\"");
    return;
  }
  check_use(fields, violate);
  check_influence(fields, violate);
  if (!has_guidance(fields)) return;
  if (fields.says("/actuator/type", "ideal_torque") && fields.lacks("/actuator", "maximum_torque_N_m") &&
      fields.lacks("/actuator", "influence_N_m"))
    violate("/actuator/maximum_torque_N_m",
            "torque without a limit leaves nothing to plan: any maneuver can be faster", "",
            "given, or influence_N_m");
  check_limits(fields, violate);
  check_authority(fields, violate);
  constexpr std::size_t kMostControls = 12;
  if (control_count(fields) > kMostControls)
    violate("/actuator/thrusters", "a plan has no more controls than that",
            std::to_string(control_count(fields)) + " thrusters", "at most " + std::to_string(kMostControls));
  if (fields.says("/guidance/type", "time_optimal")) {
    check_lists(fields, "/guidance/family", violate);
    check_program(fields, "/guidance/family", "switch_starts_s", std::numeric_limits<double>::infinity(),
                  violate);
    check_parameters(fields, violate);
  } else {
    check_lists(fields, "/guidance/controls", violate);
    if (const auto end_s = fields.number("/guidance/time_s"))
      check_program(fields, "/guidance/controls", "switch_times_s", *end_s, violate);
  }
  const json* vibration = fields.at("/guidance/vibration");
  for (std::size_t i = 0; vibration && i < vibration->size(); ++i) {
    const std::string place = "/guidance/vibration/" + std::to_string(i);
    if (const auto damping = fields.number(place + "/damping_ratio"); damping && std::abs(*damping) >= 1)
      violate(place + "/damping_ratio", "a mode that does not oscillate does not vibrate", number(*damping),
              "less than 1");
    const json* axis = fields.at(place + "/axis");
    if (axis && axis->is_array() &&
        std::all_of(axis->begin(), axis->end(), [](const json& n) { return n == 0; }))
      violate(place + "/axis", "the axis has no direction", shortened(*axis), "a vector that is not 0");
  }
}

}  // namespace slew
