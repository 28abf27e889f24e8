#include "server/experiment/plan_document.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/experiment/law_fields.hpp"
#include "server/experiment/planning.hpp"
#include "server/guidance/maneuver_bounds.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr double kDegPerRad = 180 / std::numbers::pi;

const char* status_name(PlanStatus status) {
  switch (status) {
    case PlanStatus::extremal:
      return "extremal";
    case PlanStatus::nearly_extremal:
      return "nearly_extremal";
    case PlanStatus::best_found:
      return "best_found";
    case PlanStatus::refused:
      return "refused";
    case PlanStatus::none:
      break;
  }
  return "none";
}

const char* ended_by(SearchEnd end, bool is_out_of_time) {
  switch (end) {
    case SearchEnd::starts:
      return "most_starts";
    case SearchEnd::evaluations:
      return "most_evaluations";
    case SearchEnd::caller:
      return is_out_of_time ? "time_budget" : "cancelled";
    case SearchEnd::content:
      break;
  }
  return "content";
}

template <typename Vector>
json numbers(const Vector& values) {
  return std::vector<double>(values.begin(), values.end());
}

json finite(double value) {
  return std::isfinite(value) ? json(value) : json(nullptr);
}

// Parameters under their names (control_profile.hpp).
json controls_document(const ControlHistory& history) {
  if (history.family == ProfileFamily::on_off)
    return {{"type", "on_off"},
            {"values", history.on_off.controls},
            {"switch_times_s", history.on_off.switch_times_s}};
  const ProfileLayout& layout = history.layout;
  const std::vector<double>& parameters = history.parameters;
  const auto part = [&](std::size_t from, std::size_t count) {
    const auto begin = parameters.begin() + static_cast<std::ptrdiff_t>(from);
    return std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(count));
  };
  const std::size_t n = layout.controls;
  if (history.family == ProfileFamily::impulses)
    return {{"type", "impulses"},
            {"first_peaks", part(layout.amplitude(0), n)},
            {"last_peaks", part(layout.last_peak(0), n)},
            {"widths", part(layout.t1(0), n)}};
  json switches = json::array();
  for (std::size_t i = 0; i < n; ++i)
    switches.push_back(part(layout.first_switch(i), static_cast<std::size_t>(layout.switches[i])));
  return {{"type", "smooth_switches"},
          {"amplitudes", part(layout.amplitude(0), n)},
          {"switch_fractions", std::move(switches)},
          {"smoothness", part(layout.smoothness(0), n)},
          {"rise_fraction", parameters[layout.rise()]}};
}

json certificate_document(const PlanningTask& task, const PlanCertificate& certificate) {
  const ManeuverProblem& problem = task.problem;
  json document = {
      {"attitude_error_rad", certificate.attitude_error_rad},
      {"rate_error_rad_s", certificate.rate_error_rad_s},
      {"peak_rate_deg_s", numbers(Eigen::Vector3d(certificate.peak_rate_rad_s * kDegPerRad))},
      {"consumption_margin", problem.most_consumption ? json(certificate.consumption_margin) : json(nullptr)},
      {"rate_margin_deg_s",
       problem.most_rate_rad_s ? json(certificate.rate_margin_rad_s * kDegPerRad) : json(nullptr)},
      {"meets_all", certificate.meets_all}};
  if (task.given) return document;
  document["residual"] = certificate.residual;
  document["signs_were_tested"] = certificate.signs_were_tested;
  document["violating_s"] = certificate.violating_s;
  document["worst_sign"] = certificate.worst_sign;
  document["saving_s"] = certificate.saving_s;
  document["throttled_s"] = certificate.throttled_s;
  document["legendre_clebsch"] = finite(certificate.legendre_clebsch);
  document["final_costate"] = numbers(certificate.final_costate);
  document["price"] = certificate.price;
  return document;
}

json bounds_document(const ManeuverProblem& problem) {
  const ManeuverBody body(problem.plant);
  const EigenaxisManeuver maneuver =
      eigenaxis_maneuver(body, eigenaxis(problem.initial.attitude, problem.final.attitude));
  return {{"eigenaxis", numbers(maneuver.eigenaxis.axis)},
          {"angle_deg", maneuver.eigenaxis.angle_rad * kDegPerRad},
          {"effort_s2", numbers(maneuver.effort_s2)},
          {"critical_control", maneuver.critical + 1},
          {"synthetic_s", finite(maneuver.synthetic_s)},
          {"eigenaxis_s", finite(maneuver.time_s)},
          {"least_s", least_time_s(problem)},
          {"least_consumption", least_consumption(problem)}};
}

json search_document(const SearchLog& log, bool is_out_of_time) {
  json optima = json::array();
  for (const FoundOptimum& one : log.optima)
    optima.push_back({{"time_s", one.time_s},
                      {"switches", one.switches},
                      {"hits", one.hits},
                      {"is_extremal", one.is_extremal}});
  return {{"starts", log.starts},
          {"failed_starts", log.failed_starts},
          {"programs_solved", log.programs_solved},
          {"evaluations", log.evaluations},
          {"ended_by", ended_by(log.ended_by, is_out_of_time)},
          {"optima", std::move(optima)}};
}

json vibration_document(const PlanningTask& task, const ControlHistory& history) {
  if (task.vibration.empty()) return nullptr;
  json modes = json::array();
  const auto responses = surrogate_responses(task.problem, history, task.vibration);
  for (std::size_t m = 0; m < responses.size(); ++m)
    modes.push_back({{"frequency_hz", task.vibration[m].frequency_rad_s / (2 * std::numbers::pi)},
                     {"damping_ratio", task.vibration[m].damping_ratio},
                     {"axis", numbers(task.vibration[m].axis)},
                     {"peak_deg", responses[m].peak_rad * kDegPerRad},
                     {"residual_deg", responses[m].residual_rad * kDegPerRad}});
  return {{"label", "a modal surrogate driven by the body's angular acceleration; no finite-element model"},
          {"modes", std::move(modes)}};
}

std::size_t switches_of(const ControlHistory& history) {
  if (history.family == ProfileFamily::on_off) return history.on_off.switches();
  return history.family == ProfileFamily::impulses ? 0 : history.layout.switch_count();
}

}  // namespace

json plan_document(const PlanningTask& task, const Plan& plan, bool is_out_of_time) {
  const bool is_there = task.given || (plan.status != PlanStatus::none && plan.status != PlanStatus::refused);
  json document = {{"status", task.given ? "given" : status_name(plan.status)},
                   {"why", plan.why},
                   {"time_s", is_there ? json(plan.time_s) : json(nullptr)},
                   {"switches", is_there ? json(switches_of(plan)) : json(nullptr)},
                   {"controls", is_there ? controls_document(plan) : json(nullptr)},
                   {"consumption",
                    {{"unit", task.consumed ? json(task.consumed) : json(nullptr)},
                     {"value", is_there && task.consumed ? json(plan.consumption) : json(nullptr)}}},
                   {"certificate", is_there ? certificate_document(task, plan.certificate) : json(nullptr)},
                   {"bounds", bounds_document(task.problem)},
                   {"search", task.given ? json(nullptr) : search_document(plan.log, is_out_of_time)},
                   {"vibration", is_there ? vibration_document(task, plan) : json(nullptr)}};
  return document;
}

json problem_document(const PlanningTask& task) {
  json document = bounds_document(task.problem);
  const RigidManeuverPlant& plant = task.problem.plant;
  document["controls"] = plant.controls();
  document["influence_N_m"] = json::array();
  for (Eigen::Index i = 0; i < 3; ++i)
    document["influence_N_m"].push_back(numbers(Eigen::VectorXd(plant.influence_N_m.row(i).transpose())));
  document["consumption_1_s"] = numbers(plant.consumption_1_s);
  document["consumption_unit"] = task.consumed ? json(task.consumed) : json(nullptr);
  return document;
}

ControlHistory controls_of(const json& plan) {
  const json& controls = plan.at("controls");
  ControlHistory history;
  history.time_s = plan.at("time_s");
  if (controls.at("type") == "on_off") {
    history.on_off = {controls.at("values").get<std::vector<std::vector<double>>>(),
                      controls.at("switch_times_s").get<std::vector<std::vector<double>>>(), history.time_s};
    return history;
  }
  ProfileLayout& layout = history.layout;
  const auto append = [&](const json& list) {
    for (const json& value : list) history.parameters.push_back(value);
  };
  if (controls.at("type") == "impulses") {
    layout.family = history.family = ProfileFamily::impulses;
    layout.controls = controls.at("widths").size();
    for (const char* name : {"first_peaks", "last_peaks", "widths"}) append(controls.at(name));
    return history;
  }
  layout.family = history.family = ProfileFamily::smooth_switches;
  layout.controls = controls.at("amplitudes").size();
  append(controls.at("amplitudes"));
  for (const json& switches : controls.at("switch_fractions")) {
    layout.switches.push_back(static_cast<int>(switches.size()));
    append(switches);
  }
  append(controls.at("smoothness"));
  history.parameters.push_back(controls.at("rise_fraction"));
  return history;
}

}  // namespace slew
