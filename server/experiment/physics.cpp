#include "server/experiment/physics.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "server/actuator/switching_delay.hpp"
#include "server/experiment/attitude_request.hpp"
#include "server/experiment/frame_request.hpp"
#include "server/experiment/guidance_request.hpp"
#include "server/experiment/limits.hpp"
#include "server/experiment/linear_axis_request.hpp"
#include "server/experiment/shaper_request.hpp"
#include "server/experiment/sound_fields.hpp"
#include "server/experiment/structure_request.hpp"
#include "server/experiment/wall_time.hpp"

namespace slew {
namespace {

using nlohmann::json;

// A law without regularisation is refused, and so is one with two that contradict each other.
void check_regularisation(const SoundFields& fields, const Violate& violate) {
  const auto on_time_s = fields.number("/actuator/minimum_on_time_s");
  const auto delay_s = fields.number("/actuator/switching_delay_s");
  const auto hysteresis_deg = fields.number("/controller/hysteresis_deg");
  const bool may_have_hysteresis = !fields.lacks("/controller", "hysteresis_deg");
  if (fields.says("/controller/evaluation/type", "continuous") && on_time_s == 0.0 && delay_s == 0.0 &&
      may_have_hysteresis && hysteresis_deg == 0.0)
    violate(
        "/actuator/minimum_on_time_s",
        "a law that is evaluated continuously switches infinitely often where both sides of its switching "
        "curve point at it; something must regularise it",
        "0",
        "a minimum on-time, a switching delay or a hysteresis greater than 0, or controller.evaluation of "
        "type "
        "\"sampled\" or \"ideal\"");
  if (fields.says("/controller/evaluation/type", "ideal")) {
    const auto refuse = [&](const char* pointer, const std::optional<double>& value, const char* what) {
      if (value && *value > 0)
        violate(pointer,
                std::string("an ideal law switches infinitely fast: ") + what + " contradicts its evaluation",
                number(*value), "0, or controller.evaluation of type \"continuous\" or \"sampled\"");
    };
    refuse("/actuator/minimum_on_time_s", on_time_s, "a minimum on-time");
    refuse("/actuator/switching_delay_s", delay_s, "a switching delay");
    refuse("/controller/hysteresis_deg", hysteresis_deg, "hysteresis");
    if (fields.says("/controller/type", "schmitt_trigger"))
      violate("/controller/evaluation/type", "a Schmitt trigger's hysteresis contradicts an ideal evaluation",
              "\"ideal\"", "\"continuous\" or \"sampled\"");
  }
  if (fields.says("/controller/deadband/type", "none")) return;
  const auto width_deg = fields.number("/controller/deadband/width_deg");
  const double room = fields.says("/controller/deadband/type", "double_sided") ? 2 : 1;
  if (width_deg && hysteresis_deg && *hysteresis_deg > room * *width_deg)
    violate("/controller/hysteresis_deg", "the hysteresis is wider than the dead band",
            number(*hysteresis_deg), "at most " + number(room * *width_deg) + " with this dead band");
}

// At an edge of the end box both sides may point at it too, under a disturbance.
void check_end_box(const SoundFields& fields, const Violate& violate) {
  if (!fields.has("/controller/end_box") || fields.says("/stop/when", "end_box")) return;
  const bool is_ideal = fields.says("/controller/evaluation/type", "ideal");
  const bool has_hysteresis_only = fields.says("/controller/evaluation/type", "continuous") &&
                                   fields.number("/actuator/minimum_on_time_s") == 0.0 &&
                                   fields.number("/actuator/switching_delay_s") == 0.0;
  if (is_ideal || has_hysteresis_only)
    violate("/controller/end_box",
            "nothing regularises the firings at the edges of the end box, which a disturbance may make "
            "infinitely "
            "many",
            shortened(*fields.at("/controller/end_box")),
            "left out, or stop.when \"end_box\", or a minimum on-time, a switching delay or a sampled law");
}

void check_schmitt_trigger(const SoundFields& fields, const Violate& violate) {
  const auto on_deg = fields.number("/controller/on_deg"), off_deg = fields.number("/controller/off_deg");
  if (on_deg && off_deg && *off_deg >= *on_deg)
    violate("/controller/off_deg", "a Schmitt trigger goes off below where it goes on", number(*off_deg),
            "less than controller.on_deg, " + number(*on_deg));
}

void check_firing_program(const SoundFields& fields, const Violate& violate) {
  const json* firings = fields.at("/controller/firings");
  if (!firings || !firings->is_array()) return;
  double free_from_s = 0;
  for (std::size_t i = 0; i < firings->size(); ++i) {
    const std::string pointer = "/controller/firings/" + std::to_string(i);
    const auto from_s = fields.number(pointer + "/from_s"), to_s = fields.number(pointer + "/to_s");
    if (!from_s || !to_s) continue;
    if (*from_s < free_from_s)
      violate(pointer + "/from_s", "a firing begins before the one before it has ended", number(*from_s),
              "at least " + number(free_from_s));
    if (*to_s <= *from_s)
      violate(pointer + "/to_s", "a firing ends after it has begun", number(*to_s),
              "more than " + number(*from_s));
    free_from_s = std::max(free_from_s, *to_s);
  }
}

// What holds the hub (an ideal law on its switching line, friction at rest) is solved for oscillating modes.
// A frame has one damping ratio for all of them.
void check_damping(const SoundFields& fields, const Violate& violate) {
  const json* disturbances = fields.at("/disturbances");
  const bool is_ideal = fields.says("/controller/evaluation/type", "ideal");
  const bool has_friction =
      disturbances && disturbances->is_array() &&
      std::any_of(disturbances->begin(), disturbances->end(), [](const json& disturbance) {
        return disturbance.is_object() && disturbance.value("type", json()) == "friction";
      });
  if (!is_ideal && !has_friction) return;
  std::vector<std::string> pointers{"/plant/damping_ratio"};
  if (const json* modes = fields.at("/plant/modes"))
    for (std::size_t i = 0; i < modes->size(); ++i)
      pointers.push_back("/plant/modes/" + std::to_string(i) + "/damping_ratio");
  for (const std::string& pointer : pointers)
    if (const auto damping = fields.number(pointer); damping && *damping >= 1)
      violate(pointer,
              std::string(is_ideal ? "an ideal law" : "friction") +
                  " holds the hub by turns, which is solved for modes that oscillate",
              number(*damping), "less than 1, or another evaluation and no friction");
}

// What is about one axis.
void check_axis(const SoundFields& fields, const Violate& violate) {
  check_regularisation(fields, violate);
  check_end_box(fields, violate);
  check_schmitt_trigger(fields, violate);
  check_firing_program(fields, violate);
  check_linear_law(fields, violate);
  check_damping(fields, violate);
}

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
  const bool is_continuous = fields.says("/controller/evaluation/type", "continuous");
  const bool is_sampled = fields.says("/controller/evaluation/type", "sampled");
  const bool is_of_a_structure = has_structure(fields);
  if (is_of_a_structure) {
    check_structure(fields, violate);
  } else {
    check_no_structure(fields, violate);
    check_attitude(fields, violate);
    check_guidance(fields, violate);
  }
  // What has another number of axes than the plant needs no other reason, and a law that has makes no other
  // sense.
  const std::vector<Violation> misfits = violations;
  const auto is_misfit = [&](const std::string& pointer) {
    return std::any_of(misfits.begin(), misfits.end(),
                       [&](const Violation& misfit) { return misfit.pointer == pointer; });
  };
  const auto violate_besides = [&](std::string pointer, std::string problem, std::string given,
                                   std::string allowed) {
    if (!is_misfit(pointer))
      violate(std::move(pointer), std::move(problem), std::move(given), std::move(allowed));
  };
  if (!is_of_a_structure && !has_three_axes(fields) && !is_misfit("/controller/type"))
    check_axis(fields, violate_besides);
  if (!is_of_a_structure && !is_misfit("/controller/type") && !is_misfit("/guidance/type"))
    check_shaper(fields, violate_besides);
  if (fields.says("/stop/when", "end_box") && !is_of_a_structure && !has_three_axes(fields) &&
      fields.lacks("/controller", "end_box") && !has_linear_law(fields))
    violate("/stop/when", "the run cannot stop at the end box of a controller that has none", "\"end_box\"",
            "controller.end_box given, or another stop");
  if (fields.has("/actuator/specific_impulse_s") && fields.lacks("/actuator", "lever_arm_m") &&
      !fields.says("/actuator/type", "thruster_set"))
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
  for (Violation& violation : frame_violations(request, schema_violations))
    violations.push_back(std::move(violation));
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
  constexpr auto kCommands = static_cast<double>(SwitchingDelay::kCommands);
  const auto delay_s = fields.number("/actuator/switching_delay_s");
  const auto period_s = fields.number("/controller/evaluation/period_s");
  if (is_sampled && delay_s && period_s && *period_s > 0 && *delay_s / *period_s > kCommands)
    violate("/actuator/switching_delay_s", "more commands would be on their way than a valve holds",
            number(*delay_s), "at most " + number(kCommands * *period_s) + " with this sample period");
  if (!duration_s) return violations;

  // What is legal by itself may be too much together.
  const auto bound = [&](const std::string& pointer, double most_pieces, const std::string& pieces) {
    const auto piece_s = fields.number(pointer);
    if (!piece_s || *piece_s == 0 || *duration_s / *piece_s <= most_pieces) return;
    violate(pointer, "the run would take " + number(*duration_s / *piece_s) + " " + pieces, number(*piece_s),
            "at least " + number(*duration_s / most_pieces) + " s for this duration (" + number(most_pieces) +
                " " + pieces + ")");
  };
  if (is_sampled) bound("/controller/evaluation/period_s", most.max_steps, "controller samples");
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
