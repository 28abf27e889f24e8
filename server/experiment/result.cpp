// The result document: radians become degrees here and nowhere else.
#include <gnu/libc-version.h>
#include <sys/utsname.h>

#include <numbers>

#include "server/experiment/experiment.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr double kDegPerRad = 180 / std::numbers::pi;

json optional(const std::optional<double>& value, double factor = 1) {
  return value ? json(*value * factor) : json(nullptr);
}

template <typename T>
json by_sign(const BySign<T>& value) {
  return {{"positive", value.positive}, {"negative", value.negative}};
}

template <typename T>
json tally(const ThrusterTally<T>& value) {
  json document = by_sign(value.by_sign);
  document["total"] = value.total;
  document["per_thruster"] = value.per_thruster;
  document["accelerating"] = by_sign(value.accelerating);
  document["coasting"] = by_sign(value.coasting);
  document["braking"] = by_sign(value.braking);
  return document;
}

json rotation_document(const AntennaRotation& rotation) {
  const auto degrees = [](const std::array<double, 3>& values) -> json {
    return {values[0] * kDegPerRad, values[1] * kDegPerRad, values[2] * kDegPerRad};
  };
  return {{"peak_deg", degrees(rotation.peak_rad)},
          {"residual_deg", degrees(rotation.residual_rad)},
          {"settling_time_s", optional(rotation.settling_s)}};
}

json structure_document(const std::optional<StructureMetrics>& metrics) {
  if (!metrics) return nullptr;
  json efforts = json::array();
  for (const GroupEffort& one : metrics->efforts)
    efforts.push_back({{"group", one.group},
                       {"control_effort_N2_m2_s", one.is_torque ? json(one.effort) : json(nullptr)},
                       {"control_effort_N2_s", one.is_torque ? json(nullptr) : json(one.effort)}});
  return {{"command_arrival_s", metrics->command_arrival_s},
          {"antenna_pointing", rotation_document(metrics->pointing)},
          {"antenna_rotation", rotation_document(metrics->relative)},
          {"efforts", std::move(efforts)},
          {"deflected_shape",
           {{"t_s", metrics->shape.t_s},
            {"position_m", metrics->shape.position_m},
            {"displacement_m", metrics->shape.displacement_m},
            {"members", metrics->shape.members}}}};
}

json vibration_document(const std::vector<ModeVibration>& vibration) {
  if (vibration.empty()) return nullptr;
  json modes = json::array();
  for (const ModeVibration& mode : vibration)
    modes.push_back({{"frequency_hz", mode.frequency_rad_s / (2 * std::numbers::pi)},
                     {"damping_ratio", mode.damping_ratio},
                     {"residual_deg", mode.residual_rad * kDegPerRad}});
  return {{"modes", std::move(modes)}};
}

json metrics_document(const Metrics& metrics, const ChannelTable& channels) {
  json extrema = json::array();
  for (const Extremum& extremum : metrics.extrema)
    extrema.push_back({{"t_s", extremum.t_s}, {"error_deg", extremum.error_rad * kDegPerRad}});
  json final_state = json::object();
  for (std::size_t i = 0; i < metrics.final_state.size(); ++i)
    final_state[channels.state[i].name] = metrics.final_state[i];
  json limit_cycle;
  if (metrics.limit_cycle)
    limit_cycle = {{"period_s", metrics.limit_cycle->period_s},
                   {"amplitude_deg", metrics.limit_cycle->amplitude_rad * kDegPerRad},
                   {"rate_amplitude_deg_s", metrics.limit_cycle->rate_amplitude_rad_s * kDegPerRad},
                   {"coast_s", metrics.limit_cycle->coast_s},
                   {"firing_s", metrics.limit_cycle->firing_s}};
  return {{"end_time_s", metrics.end_time_s},
          {"maneuver_time_s", optional(metrics.maneuver_time_s)},
          {"end_box_entry_s", optional(metrics.end_box_entry_s)},
          {"settling_time_s", optional(metrics.settling_time_s)},
          {"overshoot_deg", optional(metrics.overshoot_rad, kDegPerRad)},
          {"extrema_deg", std::move(extrema)},
          {"switch_on_s", optional(metrics.switch_on_s)},
          {"coast_s", optional(metrics.coast_s)},
          {"crossing_s", optional(metrics.crossing_s)},
          {"first_rest_s", optional(metrics.first_rest_s)},
          {"rest_error_deg", optional(metrics.rest_error_rad, kDegPerRad)},
          {"braking_duty", optional(metrics.braking_duty)},
          {"final_error_deg", metrics.final_error_rad * kDegPerRad},
          {"residual_rate_deg_s", metrics.residual_rate_rad_s * kDegPerRad},
          {"peak_rate_deg_s", metrics.peak_rate_rad_s * kDegPerRad},
          {"thruster_on_time_s", tally(metrics.thruster_on_time_s)},
          {"firings", tally(metrics.firings)},
          {"angular_impulse_N_m_s", metrics.angular_impulse_N_m_s},
          {"control_effort_N2_m2_s", metrics.control_effort_N2_m2_s},
          {"control_effort_N2_s", optional(metrics.control_effort_N2_s)},
          {"propellant_kg", optional(metrics.propellant_kg)},
          {"gas_volume_m3", optional(metrics.gas_volume_m3)},
          {"kinetic_energy_J", optional(metrics.kinetic_energy_J)},
          {"limit_cycle", std::move(limit_cycle)},
          {"switching_period_s", optional(metrics.switching_period_s)},
          {"sliding_s", metrics.sliding_s},
          {"rest_s", optional(metrics.rest_s)},
          {"vibration", vibration_document(metrics.vibration)},
          {"structure", structure_document(metrics.structure)},
          {"final_state", std::move(final_state)}};
}

json outputs_document(const RunReport& report, const ChannelTable& channels) {
  json names = json::array({"t_s"});
  for (const Channel& channel : channels.state) names.push_back(channel.name);
  for (const Channel& channel : channels.thrusters) names.push_back(channel.name);
  json rows = json::array();
  for (const OutputRow& output : report.outputs) {
    json row = json::array({output.t_s});
    for (const double value : output.state) row.push_back(value);
    for (const double value : output.thrusters) row.push_back(value);
    rows.push_back(std::move(row));
  }
  return {{"channels", std::move(names)}, {"rows", std::move(rows)}};
}

json events_document(const RunReport& report, const std::vector<std::string>& channels) {
  json list = json::array();
  for (const SwitchEvent& event : report.events)
    list.push_back({{"t_s", event.t_s}, {"channel", channels[event.channel]}, {"mode", event.mode}});
  return {{"total", report.events_total},
          {"reported", report.events.size()},
          {"channels", channels},
          {"list", std::move(list)}};
}

json propagator_document(const PropagatorStatistics& statistics) {
  return {{"name", statistics.name},
          {"steps", statistics.steps},
          {"events", statistics.events},
          {"rhs_evaluations", statistics.rhs_evaluations}};
}

json verification_document(const Verification& verification, const ChannelTable& channels) {
  json final_state = json::object();
  for (std::size_t i = 0; i < verification.final_state_difference.size(); ++i)
    final_state[channels.state[i].name] = verification.final_state_difference[i];
  return {{"propagator", propagator_document(verification.statistics)},
          {"relative_tolerance", verification.relative_tolerance},
          {"same_event_sequence", verification.same_event_sequence},
          {"events_compared", verification.events_compared},
          {"event_time_difference_s",
           {{"median", optional(verification.event_time_median_s)},
            {"max", optional(verification.event_time_max_s)}}},
          {"final_time_difference_s", verification.final_time_difference_s},
          {"final_state_difference", std::move(final_state)},
          {"metrics",
           {{"end_time_s", verification.metrics.end_time_s},
            {"final_error_deg", verification.metrics.final_error_rad * kDegPerRad},
            {"residual_rate_deg_s", verification.metrics.residual_rate_rad_s * kDegPerRad},
            {"peak_rate_deg_s", verification.metrics.peak_rate_rad_s * kDegPerRad},
            {"thruster_on_time_s", verification.metrics.thruster_on_time_s.total},
            {"firings", verification.metrics.firings.total}}}};
}

}  // namespace

std::string platform() {
  utsname system{};
  uname(&system);
  std::string text = std::string(system.machine) + ", glibc " + gnu_get_libc_version();
#if defined(__x86_64__)
  text += __builtin_cpu_supports("avx2") ? ", avx2" : "";
  text += __builtin_cpu_supports("fma") ? ", fma" : "";
#endif
  return text;
}

json result_document(const ResultHeading& heading, const Prepared& prepared, const Run* run,
                     const std::optional<Verification>& verification) {
  static const ChannelTable no_channels;
  const ChannelTable& channels = run ? run->channels() : no_channels;
  const RunReport report = run ? run->report() : RunReport{};
  std::vector<std::string> warnings = prepared.warnings;
  warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
  warnings.insert(warnings.end(), heading.warnings.begin(), heading.warnings.end());
  json failure;
  if (heading.failure) failure = {{"code", heading.failure->code}, {"sentence", heading.failure->sentence}};
  return {{"experiment_id", heading.experiment_id},
          {"request_id", heading.request_id},
          {"phase", heading.phase},
          {"stop_reason", report.stop_reason},
          {"failure", std::move(failure)},
          {"warnings", std::move(warnings)},
          {"metrics", run ? metrics_document(report.metrics, channels) : json(nullptr)},
          {"outputs", outputs_document(report, channels)},
          {"events", events_document(report, run ? run->event_channels() : std::vector<std::string>{})},
          {"provenance",
           {{"version", SLEW_VERSION},
            {"preset", prepared.preset},
            {"request", json::parse(prepared.resolved)},
            {"seed", prepared.seed},
            {"propagator", propagator_document(report.propagator)},
            {"platform", platform()},
            {"digest", {{"xxh3_128", report.digest.hex()}, {"hashed_bytes", report.digest.hashed_bytes}}},
            {"lateness", nullptr}}},
          {"plan", prepared.plan.empty() ? json(nullptr) : json::parse(prepared.plan)},
          {"verification", verification ? verification_document(*verification, channels) : json(nullptr)}};
}

}  // namespace slew
