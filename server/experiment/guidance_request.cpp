#include "server/experiment/guidance_request.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/actuator/propellant.hpp"
#include "server/experiment/attitude_request.hpp"
#include "server/experiment/experiment.hpp"
#include "server/experiment/law_fields.hpp"
#include "server/experiment/limits.hpp"
#include "server/experiment/shaper_request.hpp"
#include "server/guidance/maneuver_bounds.hpp"
#include "server/guidance/shaped_controls.hpp"
#include "server/simulation/attitude_loop.hpp"

namespace slew {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

constexpr double kRadPerDeg = std::numbers::pi / 180;

std::optional<double> optional_number(const json& block, const char* name) {
  const auto place = block.find(name);
  return place == block.end() ? std::nullopt : std::optional(place->get<double>());
}

// What one kg of each thruster's propellant is counted as.
std::optional<double> consumption_of_propellant(const Propellant& propellant, const char*& consumed) {
  if (!propellant.specific_impulse_s) return std::nullopt;
  consumed = propellant.gas_density_kg_m3 ? "gas_m3" : "propellant_kg";
  return 1 /
         (*propellant.specific_impulse_s * kStandardGravity_m_s2 * propellant.gas_density_kg_m3.value_or(1));
}

// B, bounds, whether they may be throttled, and what is consumed.
void set_controls(RigidManeuverPlant& plant, const char*& consumed, const IdealTorque& ideal) {
  plant.influence_N_m = ideal.influence_N_m ? *ideal.influence_N_m : ideal.maximum_N_m->asDiagonal();
  if (!ideal.gas_flow_m3_s) return;
  plant.consumption_1_s = *ideal.gas_flow_m3_s;
  consumed = "gas_m3";
}

void set_controls(RigidManeuverPlant& plant, const char*& consumed, const AxisThrusters& couples) {
  plant.is_on_off = true;
  plant.influence_N_m = couples.axes * couples.torque_N_m.asDiagonal();
  if (couples.gas_flow_m3_s) {
    plant.consumption_1_s = *couples.gas_flow_m3_s;
    consumed = "gas_m3";
  } else if (couples.lever_arm_m) {
    if (const auto per_newton = consumption_of_propellant(couples.propellant, consumed))
      plant.consumption_1_s = *per_newton / *couples.lever_arm_m * couples.torque_N_m;
  }
}

void set_controls(RigidManeuverPlant& plant, const char*& consumed, const MountedThrusters& mounted) {
  const auto count = static_cast<Eigen::Index>(mounted.thrusters.size());
  plant.is_on_off = true;
  plant.influence_N_m.resize(3, count);
  plant.least_control = Eigen::VectorXd::Zero(count);
  plant.most_control = Eigen::VectorXd::Ones(count);
  const auto per_newton = consumption_of_propellant(mounted.propellant, consumed);
  if (per_newton) plant.consumption_1_s.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Thruster& thruster = mounted.thrusters[static_cast<std::size_t>(i)];
    plant.influence_N_m.col(i) = torque_N_m(thruster);
    if (per_newton) plant.consumption_1_s[i] = *per_newton * thruster.thrust_N;
  }
}

void read_parameters(const json& family, ManeuverProblem& problem) {
  const auto list = family.find("parameters");
  if (list == family.end()) return;
  for (const json& one : *list)
    problem.parameters.push_back({one.at("start"), one.at("least"), one.at("most"), one.at("fixed")});
}

void read_family(const json& family, ManeuverProblem& problem) {
  const json& type = family.at("type");
  if (type == "on_off") {
    problem.sequences = family.value("sequences", std::vector<SwitchSequence>{});
    problem.switch_starts_s = family.value("switch_starts_s", std::vector<std::vector<double>>{});
  } else if (type == "smooth_switches") {
    problem.family = ProfileFamily::smooth_switches;
    problem.switches = family.value("switches", std::vector<int>{});
    problem.smoothness = family.value("smoothness", std::vector<double>{});
    problem.rise = family.at("rise_fraction");
    problem.smoothness_is_free = family.at("smoothness_is_free");
    problem.rise_is_free = family.at("rise_is_free");
    problem.least_smoothness = family.at("least_smoothness");
    problem.most_smoothness = family.at("most_smoothness");
    problem.least_rise = family.at("least_rise_fraction");
    problem.most_rise = family.at("most_rise_fraction");
  } else {
    problem.family = ProfileFamily::impulses;
    problem.t1 = family.value("widths", std::vector<double>{});
    problem.least_t1 = family.at("least_width");
    problem.most_t1 = family.at("most_width");
  }
  read_parameters(family, problem);
}

void read_search(const json& search, PlanningTask& task) {
  PlannerOptions& options = task.options;
  options.seed = search.at("seed");
  options.most_evaluations = search.at("most_evaluations");
  options.least_starts = search.at("least_starts");
  options.most_starts = std::max<int>(options.least_starts, search.at("most_starts"));
  options.enough_hits = search.at("enough_hits");
  task.time_budget_s = optional_number(search, "time_budget_s");
}

ControlHistory read_controls(const json& guidance, const RigidManeuverPlant& plant) {
  const json& controls = guidance.at("controls");
  const json& type = controls.at("type");
  ControlHistory history;
  history.time_s = guidance.at("time_s");
  if (type == "on_off") {
    history.on_off.end_s = history.time_s;
    history.on_off.switch_times_s = controls.at("switch_times_s").get<std::vector<std::vector<double>>>();
    Eigen::Index i = 0;
    for (const auto& signs : controls.at("sequences").get<std::vector<SwitchSequence>>()) {
      auto& values = history.on_off.controls.emplace_back();
      for (const int sign : signs)
        values.push_back(sign < 0 ? plant.least_control[i] : sign > 0 ? plant.most_control[i] : 0);
      ++i;
    }
    return history;
  }
  ProfileLayout& layout = history.layout;
  const auto append = [&](const char* name) {
    for (const json& value : controls.at(name)) history.parameters.push_back(value);
  };
  layout.controls = static_cast<std::size_t>(plant.controls());
  if (type == "impulses") {
    layout.family = history.family = ProfileFamily::impulses;
    for (const char* name : {"first_peaks", "last_peaks", "widths"}) append(name);
    return history;
  }
  layout.family = history.family = ProfileFamily::smooth_switches;
  append("amplitudes");
  for (const json& switches : controls.at("switch_fractions")) {
    layout.switches.push_back(static_cast<int>(switches.size()));
    for (const json& at : switches) history.parameters.push_back(at);
  }
  append("smoothness");
  history.parameters.push_back(controls.at("rise_fraction"));
  return history;
}

std::vector<SurrogateMode> read_vibration(const json& guidance) {
  std::vector<SurrogateMode> modes;
  for (const json& mode : guidance.value("vibration", json::array()))
    modes.push_back({2 * std::numbers::pi * mode.at("frequency_hz").get<double>(), mode.at("damping_ratio"),
                     vector_of(mode.at("axis")).stableNormalized()});
  return modes;
}

// What the planner calls its fields, and what a request does.
struct Place {
  std::string pointer;
  const char* subject;
};

Place place_of(const std::string& field, const PlanningTask& task, const json& resolved) {
  const json& guidance = resolved.at("guidance");
  const auto begins = [&](const char* with) { return field.starts_with(with); };
  if (begins("plant/inertia"))
    return {guidance.contains("inertia_kg_m2") ? "/guidance/inertia_kg_m2" : "/plant/inertia_kg_m2",
            "the inertia"};
  if (begins("plant/weight")) return {"/plant/pivot_weight", "the weight"};
  if (begins("plant/")) return {"/actuator", "the actuator"};
  if (begins("initial/attitude")) return {"/maneuver/initial_attitude", "the attitude"};
  if (begins("initial/")) return {"/maneuver/initial_rate_deg_s", "the rate"};
  if (begins("final/attitude")) return {"/maneuver/final_attitude", "the attitude"};
  if (begins("final/")) return {"/maneuver/final_rate_deg_s", "the rate"};
  if (begins("most_rate")) return {"/guidance/rate_limit_deg_s", "the limit"};
  if (begins("longest_s")) return {"/guidance/longest_s", ""};
  if (begins("most_consumption"))
    return {
        std::string("/guidance/") + (std::string_view(task.consumed ? task.consumed : "gas_m3") == "gas_m3"
                                         ? "gas_limit_m3"
                                         : "propellant_limit_kg"),
        ""};
  if (begins("time_start")) return {"/guidance/time_start_s", "the guess"};
  return {"/guidance/family", field == "switches" ? "the family:" : ""};
}

// Of the controls that are given, before or after they are shaped.
std::vector<Violation> given_violations(const PlanningTask& task, const json& resolved) {
  std::size_t pieces = 0;
  const json& controls = resolved.at("guidance").at("controls");
  if (controls.contains("sequences"))
    for (const json& signs : controls.at("sequences"))
      pieces += signs.size() - static_cast<std::size_t>(std::count(signs.begin(), signs.end(), 0));
  return shaper_violations(
      task.shaper, own_modes(task),
      {"guidance.vibration", "signs of controls", static_cast<double>(pieces), limits().max_shaped_controls});
}

}  // namespace

std::vector<VibratingMode> own_modes(const PlanningTask& task) {
  std::vector<VibratingMode> modes;
  for (const SurrogateMode& mode : task.vibration)
    modes.push_back({mode.frequency_rad_s, mode.damping_ratio});
  return modes;
}

std::shared_ptr<const PlanningTask> planning_task(const json& resolved, const AttitudeSpecification& spec) {
  const json& guidance = resolved.at("guidance");
  if (guidance.at("type") == "none") return nullptr;
  auto task = std::make_shared<PlanningTask>();
  ManeuverProblem& problem = task->problem;
  RigidManeuverPlant& plant = problem.plant;
  const auto belief = guidance.find("inertia_kg_m2");
  plant.inertia_kg_m2 = belief == guidance.end() ? spec.plant.inertia_kg_m2 : matrix_of(*belief);
  plant.weight = spec.plant.weight;
  plant.springs = spec.plant.springs;
  std::visit([&](const auto& actuator) { set_controls(plant, task->consumed, actuator); }, spec.actuator);
  const json& maneuver = resolved.at("maneuver");
  problem.initial = {attitude_of(maneuver.at("initial_attitude")), spec.maneuver.initial_rate_rad_s};
  problem.final = {spec.maneuver.final_attitude, vector_of(maneuver.at("final_rate_deg_s")) * kRadPerDeg};
  task->vibration = read_vibration(guidance);
  if (guidance.at("type") == "given_controls") {
    task->given = read_controls(guidance, plant);
    task->unshaped_end_s = task->given->time_s;
    task->shaper = specify_shaper(guidance);
    if (!given_violations(*task, resolved).empty()) return task;
    task->impulses = impulses_or_none(task->shaper, own_modes(*task));
    if (!task->impulses.empty()) task->given = shaped_controls(*task->given, task->impulses);
    return task;
  }
  const double authority = guidance.at("authority");
  plant.least_control *= authority;
  plant.most_control *= authority;
  if (const auto limit = guidance.find("rate_limit_deg_s"); limit != guidance.end())
    problem.most_rate_rad_s = vector_of(*limit) * kRadPerDeg;
  for (const char* limit : {"gas_limit_m3", "propellant_limit_kg"})
    if (const auto most = optional_number(guidance, limit)) problem.most_consumption = most;
  problem.longest_s = optional_number(guidance, "longest_s");
  problem.time_start_s = optional_number(guidance, "time_start_s");
  read_family(guidance.at("family"), problem);
  read_search(guidance.at("search"), *task);

  json text = {{"version", SLEW_VERSION}, {"platform", platform()}};
  for (const char* block : {"plant", "actuator", "guidance"}) text[block] = resolved.at(block);
  for (const char* field : {"initial_attitude", "initial_rate_deg_s", "final_attitude", "final_rate_deg_s"})
    text["maneuver"][field] = maneuver.at(field);
  task->problem_text = text.dump();
  return task;
}

std::vector<Violation> planning_violations(const PlanningTask& task, const json& resolved) {
  if (task.given) return given_violations(task, resolved);
  std::vector<Violation> violations;
  for (const ManeuverFault& fault : maneuver_faults(task.problem)) {
    const Place place = place_of(fault.field, task, resolved);
    std::string given = fault.given, allowed = fault.allowed;
    const json::json_pointer pointer(place.pointer);
    if ((given.empty() || place.pointer.ends_with("_deg_s")) && resolved.contains(pointer))
      given = shortened(resolved.at(pointer));
    if (place.pointer.starts_with("/maneuver") && place.pointer.ends_with("_rate_deg_s"))
      allowed = "within guidance.rate_limit_deg_s";
    const std::string subject = place.subject;
    violations.push_back(
        {place.pointer, subject.empty() ? fault.problem : subject + ' ' + fault.problem, given, allowed});
  }
  return violations;
}

}  // namespace slew
