#include "client/slewctl/report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "client/slewctl/terminal.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

// The last part of a name is its unit: "overshoot_deg" is read as "overshoot", "deg".
std::pair<std::string, std::string> name_and_unit(const std::string& key) {
  static const std::vector<std::pair<std::string, std::string>> units = {
      {"_N2_m2_s", "N² m² s"}, {"_N2_s", "N² s"},   {"_N_m_s", "N m s"},
      {"_deg_s", "deg/s"},     {"_rad_s", "rad/s"}, {"_N_m", "N m"},
      {"_kg", "kg"},           {"_m3", "m³"},       {"_J", "J"},
      {"_deg", "deg"},         {"_rad", "rad"},     {"_s", "s"}};
  std::string name = key, unit;
  for (const auto& [suffix, words] : units)
    if (key.ends_with(suffix)) {
      name = key.substr(0, key.size() - suffix.size());
      unit = words;
      break;
    }
  for (char& c : name)
    if (c == '_') c = ' ';
  return {name, unit};
}

std::string value_in_words(const json& value) {
  return value.is_number_integer() ? value.dump() : value.is_number() ? number(value.get<double>()) : "-";
}

// About one axis by sign, in three axes by thruster.
void add_tally(std::vector<std::vector<std::string>>& rows, const json& metrics, const char* key) {
  const auto [name, unit] = name_and_unit(key);
  const json& tally = metrics.at(key);
  const json& each = tally.at("per_thruster");
  std::string parts;
  if (each.size() > 2)
    for (const json& one : each) parts += (parts.empty() ? "each " : ", ") + value_in_words(one);
  else
    parts = "+ " + value_in_words(tally.at("positive")) + ", - " + value_in_words(tally.at("negative")) +
            "; braking + " + value_in_words(tally.at("braking").at("positive")) + ", - " +
            value_in_words(tally.at("braking").at("negative"));
  if (!each.empty()) rows.push_back({name, value_in_words(tally.at("total")), unit, parts});
}

std::string three_in_words(const json& values) {
  std::string text;
  for (const json& value : values) text += (text.empty() ? "" : ", ") + value_in_words(value);
  return text;
}

// A flexible structure's antenna and what its actuators did.
void add_structure(std::vector<std::vector<std::string>>& rows, const json& structure) {
  rows.push_back({"command arrival", value_in_words(structure.at("command_arrival_s")), "s"});
  for (const char* quantity : {"antenna_pointing", "antenna_rotation"}) {
    const json& rotation = structure.at(quantity);
    const std::string name = name_and_unit(quantity).first;
    rows.push_back({name + ", settling", value_in_words(rotation.at("settling_time_s")), "s"});
    rows.push_back({name + ", peaks", three_in_words(rotation.at("peak_deg")), "deg"});
    rows.push_back({name + ", last second", three_in_words(rotation.at("residual_deg")), "deg"});
  }
  for (const json& one : structure.at("efforts"))
    for (const char* key : {"control_effort_N2_m2_s", "control_effort_N2_s"})
      if (one.at(key).is_number())
        rows.push_back({"effort of " + one.at("group").get<std::string>(), value_in_words(one.at(key)),
                        name_and_unit(key).second});
}

// What is left in each mode, of a plant's or of a plan's surrogate.
void add_vibration(std::vector<std::vector<std::string>>& rows, const json& of) {
  if (!of.is_object() || !of.contains("vibration") || !of.at("vibration").is_object()) return;
  for (const json& mode : of.at("vibration").at("modes"))
    rows.push_back({"left at " + number(mode.at("frequency_hz").get<double>()) + " Hz",
                    value_in_words(mode.at("residual_deg")), "deg"});
}

std::string verification_in_words(const json& verification) {
  std::string text =
      "\nsecond opinion (" + verification.at("propagator").at("name").get<std::string>() + "): ";
  text += verification.at("same_event_sequence").get<bool>() ? "the same events in the same order"
                                                             : "ANOTHER SEQUENCE OF EVENTS";
  const json& times = verification.at("event_time_difference_s");
  if (times.at("max").is_number())
    text += ", " + verification.at("events_compared").dump() + " event times differ by " +
            number(times.at("median")) + " s in the median and " + number(times.at("max")) + " s at most";
  text += "\nfinal state, difference:";
  for (const auto& [channel, difference] : verification.at("final_state_difference").items())
    text += " " + channel + " " + number(difference.get<double>());
  return text + "\n";
}

}  // namespace

std::string result_in_words(const json& result) {
  const json& provenance = result.at("provenance");
  std::string text = provenance.at("preset").get<std::string>();
  if (text.empty()) text = "request " + result.at("request_id").get<std::string>();
  text += ": " + result.at("phase").get<std::string>();
  if (const auto reason = result.value("stop_reason", ""); !reason.empty()) text += " (" + reason + ")";
  text += "\nexperiment " + result.at("experiment_id").get<std::string>() + "\n";
  if (result.at("failure").is_object())
    text += "failed: " + result.at("failure").at("sentence").get<std::string>() + "\n";
  for (const json& warning : result.at("warnings")) text += "warning: " + warning.get<std::string>() + "\n";
  if (result.at("metrics").is_object()) {
    const json& metrics = result.at("metrics");
    std::vector<std::vector<std::string>> rows{{"", "", ""}};
    // Times in the order in which they come, then errors, then costs; what is not known here comes last.
    static const std::vector<std::string> order = {
        "switch_on_s",     "coast_s",         "crossing_s",      "first_rest_s",
        "end_box_entry_s", "maneuver_time_s", "settling_time_s", "end_time_s",
        "overshoot_deg",   "rest_error_deg",  "final_error_deg", "residual_rate_deg_s",
        "peak_rate_deg_s", "braking_duty"};
    const auto add = [&](const std::string& key) {
      const auto [name, unit] = name_and_unit(key);
      if (metrics.at(key).is_number()) rows.push_back({name, value_in_words(metrics.at(key)), unit});
    };
    for (const std::string& key : order)
      if (metrics.contains(key)) add(key);
    for (const auto& [key, value] : metrics.items())
      if (std::find(order.begin(), order.end(), key) == order.end()) add(key);
    add_tally(rows, metrics, "thruster_on_time_s");
    add_tally(rows, metrics, "firings");
    if (metrics.value("structure", json()).is_object()) add_structure(rows, metrics.at("structure"));
    add_vibration(rows, metrics);
    add_vibration(rows, result.value("plan", json()));
    text += table(rows);
  }
  const json& propagator = provenance.at("propagator");
  text += "\n" + propagator.at("name").get<std::string>() + ": " + propagator.at("steps").dump() +
          " steps, " + propagator.at("events").dump() + " events; digest " +
          provenance.at("digest").at("xxh3_128").get<std::string>() + "\n";
  if (provenance.at("lateness").is_object())
    text += "lateness: p50 " + number(1e6 * provenance.at("lateness").at("p50_s").get<double>()) + ", p99 " +
            number(1e6 * provenance.at("lateness").at("p99_s").get<double>()) + ", max " +
            number(1e6 * provenance.at("lateness").at("max_s").get<double>()) + " us over " +
            provenance.at("lateness").at("slices").dump() + " slices\n";
  if (result.at("verification").is_object()) text += verification_in_words(result.at("verification"));
  return text;
}

}  // namespace slew::ctl
