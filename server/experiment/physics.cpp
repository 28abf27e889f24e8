#include "server/experiment/physics.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "server/experiment/limits.hpp"
#include "server/experiment/wall_time.hpp"

namespace slew {
namespace {

using nlohmann::json;

std::string number(double value) {
  const bool is_whole = value == std::floor(value) && std::abs(value) < 1e15;
  return is_whole ? std::to_string(static_cast<long long>(value)) : json(value).dump();
}

// The fields of a request that may be relied upon.
class SoundFields {
 public:
  SoundFields(const json& request, const std::vector<Violation>& violations)
      : request_(request), violations_(violations) {}

  const json* at(const std::string& pointer) const {
    const bool is_unsound =
        std::any_of(violations_.begin(), violations_.end(), [&](const Violation& violation) {
          return pointer.starts_with(violation.pointer) &&
                 (pointer.size() == violation.pointer.size() || pointer[violation.pointer.size()] == '/');
        });
    const json::json_pointer place(pointer);
    return !is_unsound && request_.contains(place) ? &request_.at(place) : nullptr;
  }
  std::optional<double> number(const std::string& pointer) const {
    const json* value = at(pointer);
    return value && value->is_number() ? std::optional(value->get<double>()) : std::nullopt;
  }
  bool says(const std::string& pointer, const char* text) const {
    const json* value = at(pointer);
    return value && *value == text;
  }
  /// Left out, and not wrong either.
  bool lacks(const std::string& block, const std::string& field) const {
    const json* value = at(block);
    return value && value->is_object() && !value->contains(field);
  }
  bool has(const std::string& pointer) const { return at(pointer) != nullptr; }

 private:
  const json& request_;
  const std::vector<Violation>& violations_;
};

}  // namespace

std::vector<Violation> physics_violations(const json& request,
                                          const std::vector<Violation>& schema_violations) {
  const SoundFields fields(request, schema_violations);
  const Limits& most = limits();
  std::vector<Violation> violations;
  const auto violate = [&](std::string pointer, std::string problem, std::string given, std::string allowed) {
    violations.push_back({std::move(pointer), std::move(problem), std::move(given), std::move(allowed)});
  };
  const auto duration_s = fields.number("/simulation/duration_s");
  const auto minimum_on_time_s = fields.number("/actuator/minimum_on_time_s");
  const bool is_continuous = fields.says("/controller/evaluation/type", "continuous");

  if (is_continuous && minimum_on_time_s == 0.0)
    violate(
        "/actuator/minimum_on_time_s",
        "a law that is evaluated continuously switches infinitely often where both sides of its switching "
        "curve point at it; something must regularise it",
        "0", "a minimum on-time greater than 0, or controller.evaluation of type \"sampled\"");
  if (fields.says("/stop/when", "end_box") && fields.lacks("/controller", "end_box"))
    violate("/stop/when", "the run cannot stop at the end box of a controller that has none", "\"end_box\"",
            "controller.end_box given, or another stop");
  if (fields.has("/actuator/specific_impulse_s") && fields.lacks("/actuator", "lever_arm_m"))
    violate("/actuator/lever_arm_m", "the propellant cannot be told from a torque without its lever arm", "",
            "given together with specific_impulse_s");
  if (fields.has("/actuator/gas_density_kg_m3") && fields.lacks("/actuator", "specific_impulse_s"))
    violate("/actuator/specific_impulse_s", "the gas volume cannot be told without the propellant's mass", "",
            "given together with gas_density_kg_m3");
  if (fields.says("/timing/mode", "scaled") && fields.lacks("/timing", "rate"))
    violate("/timing/rate", "a scaled run needs a rate", "", "simulated seconds in a wall second");
  if (fields.has("/timing/mode") && !fields.says("/timing/mode", "scaled") && fields.has("/timing/rate"))
    violate("/timing/rate", "only a scaled run has a rate of its own", shortened(*fields.at("/timing/rate")),
            "left out, or timing.mode \"scaled\"");
  if (const json* start = fields.at("/timing/start"); start && start->is_string()) {
    const auto& when = start->get_ref<const std::string&>();
    if (when != "now" && when != "held" && !parse_utc(when))
      violate("/timing/start", "this is no time to start at", shortened(*start),
              "\"now\", \"held\", or a time in UTC such as \"2026-11-24T12:00:00Z\"");
  }
  if (const json* modes = fields.at("/plant/modes"); modes && modes->is_array()) {
    const auto inertia = fields.number("/plant/inertia_kg_m2");
    double coupled = 0;
    bool is_sound = inertia.has_value();
    for (std::size_t i = 0; i < modes->size() && is_sound; ++i) {
      const auto coupling = fields.number("/plant/modes/" + std::to_string(i) + "/coupling_sqrt_kg_m");
      is_sound = coupling.has_value();
      coupled += coupling.value_or(0) * coupling.value_or(0);
    }
    if (is_sound && *inertia <= coupled)
      violate("/plant/inertia_kg_m2",
              "the modes carry more inertia than the spacecraft has: I - sum D^2 must be "
              "positive",
              number(*inertia), "more than sum D^2, " + number(coupled));
  }
  if (!duration_s) return violations;

  // What is legal by itself may be too much together.
  const auto bound = [&](const std::string& pointer, double most_pieces, const std::string& pieces) {
    const auto piece_s = fields.number(pointer);
    if (!piece_s || *piece_s == 0 || *duration_s / *piece_s <= most_pieces) return;
    violate(pointer, "the run would take " + number(*duration_s / *piece_s) + " " + pieces, number(*piece_s),
            "at least " + number(*duration_s / most_pieces) + " s for this duration (" + number(most_pieces) +
                " " + pieces + ")");
  };
  bound("/controller/evaluation/period_s", most.max_steps, "controller samples");
  if (is_continuous) bound("/actuator/minimum_on_time_s", most.max_steps, "firings");
  bound("/telemetry/sample_period_s", most.max_archived_rows, "telemetry samples");
  if (const json* times = fields.at("/outputs/at_s"); times && times->is_array())
    for (std::size_t i = 0; i < times->size() && violations.size() <= most.max_violations; ++i) {
      const std::string pointer = "/outputs/at_s/" + std::to_string(i);
      if (const auto at_s = fields.number(pointer); at_s && *at_s > *duration_s)
        violate(pointer, "the time lies after the end of the run", number(*at_s),
                "at most simulation.duration_s, " + number(*duration_s));
    }
  return violations;
}

}  // namespace slew
