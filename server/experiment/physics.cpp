#include "server/experiment/physics.hpp"

#include <nlohmann/json.hpp>

#include "server/experiment/limits.hpp"

namespace slew {
namespace {

using nlohmann::json;

std::string number(double value) {
  return json(value).dump();
}

}  // namespace

std::vector<Violation> physics_violations(const json& request) {
  std::vector<Violation> violations;
  const auto violate = [&](std::string pointer, std::string problem, std::string given, std::string allowed) {
    violations.push_back({std::move(pointer), std::move(problem), std::move(given), std::move(allowed)});
  };
  const json& controller = request.at("controller");
  const json& evaluation = controller.at("evaluation");
  const json& actuator = request.at("actuator");
  const json& timing = request.at("timing");
  const double duration_s = request.at("simulation").at("duration_s");

  if (evaluation.at("type") == "continuous" && actuator.at("minimum_on_time_s") == 0)
    violate("/actuator/minimum_on_time_s",
            "a law that is evaluated continuously switches infinitely often where both sides of its "
            "switching curve "
            "point at it; something must regularise it",
            shortened(actuator.at("minimum_on_time_s")),
            "a minimum on-time greater than 0, or controller.evaluation of type \"sampled\"");
  if (request.at("stop").at("when") == "end_box" && !controller.contains("end_box"))
    violate("/stop/when", "the run cannot stop at the end box of a controller that has none", "\"end_box\"",
            "controller.end_box given, or another stop");
  if (actuator.contains("specific_impulse_s") && !actuator.contains("lever_arm_m"))
    violate("/actuator/lever_arm_m", "the propellant cannot be told from a torque without its lever arm", "",
            "given together with specific_impulse_s");
  if (actuator.contains("gas_density_kg_m3") && !actuator.contains("specific_impulse_s"))
    violate("/actuator/specific_impulse_s", "the gas volume cannot be told without the propellant's mass", "",
            "given together with gas_density_kg_m3");
  if (timing.at("mode") == "scaled" && !timing.contains("rate"))
    violate("/timing/rate", "a scaled run needs a rate", "", "simulated seconds in a wall second");
  if (timing.at("mode") != "scaled" && timing.contains("rate"))
    violate("/timing/rate", "only a scaled run has a rate of its own", shortened(timing.at("rate")),
            "left out, or timing.mode \"scaled\"");

  const Limits& most = limits();
  if (evaluation.at("type") == "sampled")
    if (const double steps = duration_s / evaluation.at("period_s").get<double>(); steps > most.max_steps)
      violate("/controller/evaluation/period_s",
              "the run would take " + number(steps) + " controller samples",
              shortened(evaluation.at("period_s")),
              "at least " + number(duration_s / most.max_steps) + " s for this duration (" +
                  number(most.max_steps) + " samples)");
  if (evaluation.at("type") == "continuous" && actuator.at("minimum_on_time_s") > 0)
    if (const double steps = duration_s / actuator.at("minimum_on_time_s").get<double>();
        steps > most.max_steps)
      violate("/actuator/minimum_on_time_s", "the run could take " + number(steps) + " firings",
              shortened(actuator.at("minimum_on_time_s")),
              "at least " + number(duration_s / most.max_steps) + " s for this duration");
  const double sample_period_s = request.at("telemetry").at("sample_period_s");
  if (const double rows = duration_s / sample_period_s; rows > most.max_archived_rows)
    violate("/telemetry/sample_period_s", "the run would leave " + number(rows) + " samples",
            number(sample_period_s),
            "at least " + number(duration_s / most.max_archived_rows) + " s for this duration (" +
                number(most.max_archived_rows) + " samples)");
  for (std::size_t i = 0; i < request.at("outputs").at("at_s").size(); ++i)
    if (const json& at_s = request.at("outputs").at("at_s")[i]; at_s > duration_s)
      violate("/outputs/at_s/" + std::to_string(i), "the time lies after the end of the run", shortened(at_s),
              "at most simulation.duration_s, " + number(duration_s));
  return violations;
}

}  // namespace slew
