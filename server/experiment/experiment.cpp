#include "server/experiment/experiment.hpp"

#include <algorithm>
#include <iterator>

#include "server/experiment/attitude_request.hpp"
#include "server/experiment/axis_request.hpp"
#include "server/experiment/limits.hpp"
#include "server/experiment/linear_axis_request.hpp"
#include "server/experiment/physics.hpp"
#include "server/experiment/planning.hpp"
#include "server/experiment/preset.hpp"
#include "server/experiment/schema.hpp"
#include "server/experiment/shaper_request.hpp"
#include "server/experiment/structure_request.hpp"
#include "server/experiment/wall_time.hpp"
#include "server/guidance/plan_certificate.hpp"
#include "server/simulation/ballast.hpp"

namespace slew {
namespace {

using nlohmann::json;

std::optional<double> optional_number(const json& block, const char* name) {
  const auto place = block.find(name);
  return place == block.end() ? std::nullopt : std::optional(place->get<double>());
}

// Pointers and names are as long as whoever wrote them liked.
std::string bounded(std::string text) {
  constexpr std::size_t kBytes = 400;
  if (text.size() <= kBytes) return text;
  std::size_t end = kBytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

Rejection invalid(std::vector<Violation> violations) {
  const std::size_t most = limits().max_violations;
  const std::size_t count = violations.size();
  if (count > most) violations.resize(most);
  for (Violation& violation : violations) violation.pointer = bounded(std::move(violation.pointer));
  std::string sentence = "the request was refused";
  if (count == 1) {
    sentence += ": " + violations.front().problem;
    if (!violations.front().pointer.empty()) sentence += " (" + violations.front().pointer + ")";
  } else if (count <= most) {
    sentence += " for " + std::to_string(count) + " reasons";
  } else {
    sentence += " for more than " + std::to_string(most) + " reasons; these are the first";
  }
  return {"invalid", std::move(sentence), std::move(violations)};
}

Violation no_such_preset(const json& name) {
  std::string like;
  if (name.is_string()) {
    std::vector<std::string> names;
    for (const Preset& known : presets()) names.push_back(known.name);
    like = nearest(name.get_ref<const std::string&>(), names);
  }
  return {"/preset", "there is no such preset" + (like.empty() ? "" : "; did you mean \"" + like + "\"?"),
          shortened(name), "a name that `slewctl presets` lists"};
}

// Why the request cannot be flown, as far as it can be told without its preset: what is missing may be there.
std::vector<Violation> violations_without_preset(const json& request) {
  std::vector<Violation> violations{no_such_preset(request.at("preset"))};
  for (Violation& violation : schema_violations("request", request))
    if (violation.pointer != "/preset" && request.contains(json::json_pointer(violation.pointer)))
      violations.push_back(std::move(violation));
  return violations;
}

// The preset with the request merged over it (RFC 7396), and defaults where neither says anything.
json resolve(const json& request, const json* preset) {
  json resolved = preset ? preset->at("request") : json::object();
  resolved.merge_patch(request);
  fill_defaults("request", resolved);
  return resolved;
}

// By schema and by physics, in the order of the document.
std::vector<Violation> all_violations(const json& resolved) {
  auto violations = schema_violations("request", resolved);
  auto more = physics_violations(resolved, violations);
  violations.insert(violations.end(), std::make_move_iterator(more.begin()),
                    std::make_move_iterator(more.end()));
  std::stable_sort(violations.begin(), violations.end(),
                   [](const Violation& a, const Violation& b) { return a.pointer < b.pointer; });
  return violations;
}

// A field that the preset brought along may not fit a block whose type the request changed.
void name_the_preset(std::vector<Violation>& violations, const json& request) {
  if (!request.contains("preset")) return;
  for (Violation& violation : violations)
    if (violation.problem.starts_with("there is no field") &&
        !request.contains(json::json_pointer(violation.pointer)))
      violation.problem += " (it comes from the preset; null removes it)";
}

TimingSpecification specify_timing(const json& timing) {
  TimingSpecification spec;
  const auto& mode = timing.at("mode").get_ref<const std::string&>();
  if (mode == "real_time") spec.mode = TimingMode::real_time;
  if (mode == "scaled") {
    spec.mode = TimingMode::scaled;
    spec.rate = timing.at("rate");
  }
  const auto& start = timing.at("start").get_ref<const std::string&>();
  if (start == "held") spec.start = TimingStart::held;
  if (const auto unix_ns = parse_utc(start)) {
    spec.start = TimingStart::wall_time;
    spec.start_unix_ns = *unix_ns;
  }
  spec.expires_s = optional_number(timing, "expires_s");
  spec.run_again_after_restart = timing.at("after_restart") == "run_again";
  return spec;
}

System specify(const json& resolved) {
  if (is_structure(resolved.at("plant"))) return specify_structure(resolved);
  if (is_attitude_law(resolved.at("controller"))) return specify_attitude(resolved);
  if (is_linear_law(resolved.at("controller"))) return specify_linear_axis(resolved);
  return specify_on_off_axis(resolved);
}

std::vector<Violation> why_it_cannot_be_shaped(const OnOffAxisSpecification& spec) {
  return shaper_violations(
      spec.shaper, vibrating_modes(spec),
      {"the plant", "firings", static_cast<double>(spec.program.size()), limits().max_shaped_firings});
}
std::vector<Violation> why_it_cannot_be_shaped(const LinearAxisSpecification& spec) {
  return shaper_violations(spec.shaper, vibrating_modes(spec),
                           {"the closed loop", "steps", 1, kMostImpulses});
}
// A plan's shaper is judged with it, a structure's with the structure.
std::vector<Violation> why_it_cannot_be_shaped(const AttitudeSpecification&) {
  return {};
}
std::vector<Violation> why_it_cannot_be_shaped(const StructureSpecification&) {
  return {};
}

std::unique_ptr<Run> run_of(const OnOffAxisSpecification& spec) {
  return make_on_off_axis_run(spec);
}
std::unique_ptr<Run> run_of(const LinearAxisSpecification& spec) {
  return make_linear_axis_run(spec);
}
std::unique_ptr<Run> run_of(const AttitudeSpecification& spec) {
  return make_attitude_run(spec);
}
std::unique_ptr<Run> run_of(const StructureSpecification& spec) {
  return make_structure_run(spec);
}
std::unique_ptr<Run> verification_of(const OnOffAxisSpecification& spec) {
  return make_on_off_axis_verification(spec);
}
std::unique_ptr<Run> verification_of(const LinearAxisSpecification& spec) {
  return make_linear_axis_verification(spec);
}
std::unique_ptr<Run> verification_of(const AttitudeSpecification& spec) {
  return make_attitude_verification(spec);
}
std::unique_ptr<Run> verification_of(const StructureSpecification& spec) {
  return make_structure_verification(spec);
}

}  // namespace

std::string timing_mode_name(TimingMode mode) {
  switch (mode) {
    case TimingMode::as_fast_as_possible:
      return "as_fast_as_possible";
    case TimingMode::real_time:
      return "real_time";
    case TimingMode::scaled:
      return "scaled";
  }
  return "";
}

std::variant<Prepared, Rejection> prepare(std::string_view request_text) {
  auto parsed = parse_document(request_text);
  if (auto* violations = std::get_if<std::vector<Violation>>(&parsed)) return invalid(std::move(*violations));
  const json& request = std::get<json>(parsed);
  const json* preset = nullptr;
  if (const auto name = request.find("preset"); name != request.end() && !name->is_null()) {
    preset = name->is_string() ? preset_document(name->get_ref<const std::string&>()) : nullptr;
    if (!preset) return invalid(violations_without_preset(request));
  }
  json resolved = resolve(request, preset);
  if (auto violations = all_violations(resolved); !violations.empty()) {
    name_the_preset(violations, request);
    return invalid(std::move(violations));
  }
  Prepared prepared;
  prepared.system = specify(resolved);
  const auto why_not = [](const auto& spec) { return why_it_cannot_be_built(spec); };
  if (auto violation = std::visit(why_not, prepared.system)) return invalid({std::move(*violation)});
  const auto why_unshaped = [](const auto& spec) { return why_it_cannot_be_shaped(spec); };
  if (auto violations = std::visit(why_unshaped, prepared.system); !violations.empty())
    return invalid(std::move(violations));
  prepared.preset = resolved.value("preset", "");
  prepared.label = resolved.at("label");
  prepared.warnings = std::visit([](const auto& spec) { return warnings_about(spec); }, prepared.system);
  prepared.duration_s = std::visit([](const auto& spec) { return spec.duration_s; }, prepared.system);
  prepared.seed = resolved.at("simulation").at("seed");
  prepared.verify = resolved.at("simulation").at("verify");
  prepared.ballast_operations_per_step = resolved.at("simulation").at("ballast_operations_per_step");
  prepared.timing = specify_timing(resolved.at("timing"));
  prepared.telemetry = {resolved.at("telemetry").at("sample_period_s"),
                        resolved.at("telemetry").at("publish_max_hz"),
                        resolved.at("telemetry").at("lossless")};
  prepared.resolved = resolved.dump();
  if (auto* spec = std::get_if<AttitudeSpecification>(&prepared.system)) {
    prepared.planning = planning_task(resolved, *spec);
    if (!prepared.planning) return prepared;
    if (auto violations = planning_violations(*prepared.planning, resolved); !violations.empty())
      return invalid(std::move(violations));
    if (prepared.planning->given) try {
        adopt_plan(prepared, plan_maneuver(*prepared.planning));
      } catch (const MotionTooLong& why) {
        return invalid(
            {{"/guidance", "the controls that are given spin the body up: " + std::string(why.what()), "",
              "controls that bring it from one attitude to another"}});
      }
  }
  return prepared;
}

std::unique_ptr<Run> make_run(const Prepared& prepared) {
  auto run = std::visit([](const auto& spec) { return run_of(spec); }, prepared.system);
  return prepared.ballast_operations_per_step == 0
             ? std::move(run)
             : with_ballast(std::move(run), prepared.ballast_operations_per_step);
}

std::unique_ptr<Run> make_verification(const Prepared& prepared) {
  return std::visit([](const auto& spec) { return verification_of(spec); }, prepared.system);
}

}  // namespace slew
