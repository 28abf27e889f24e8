#include "server/experiment/shaper_request.hpp"

#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "server/experiment/attitude_request.hpp"
#include "server/experiment/linear_axis_request.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr const char* kShaper = "/guidance/shaper";
constexpr const char* kType = "/guidance/shaper/type";

json modes_document(std::span<const VibratingMode> modes) {
  json list = json::array();
  for (const VibratingMode& mode : modes)
    list.push_back({{"frequency_hz", mode.frequency_rad_s / (2 * std::numbers::pi)},
                    {"damping_ratio", mode.damping_ratio}});
  return list;
}

// Whether the request leaves no doubt that nothing in the plant vibrates.
bool is_rigid(const SoundFields& fields) {
  if (fields.says("/plant/type", "rigid_axis")) return true;
  const json* modes = fields.at("/plant/modes");
  return (modes && modes->is_array() && modes->empty()) || fields.number("/plant/modes_kept") == 0.0;
}

void check_axis_shaper(const SoundFields& fields, const Violate& violate) {
  const json& type = *fields.at(kType);
  if (has_linear_law(fields) || !fields.has("/controller/type")) return;
  if (!fields.says("/controller/type", "firing_program")) {
    violate(
        kType,
        "a law that fires or does not fire does not answer a command in proportion, so that the answers to "
        "its "
        "parts do not cancel",
        shortened(type),
        "\"none\", or controller.type \"attitude_rate_feedback\" or \"lead_compensation\", whose commanded "
        "angle is shaped, or \"firing_program\", whose torque is");
    return;
  }
  if (is_rigid(fields))
    violate(kType, "a rigid axis has no mode that a torque could leave vibrating", shortened(type),
            "\"none\", or plant.type \"flexible_axis\" or \"flexible_axis_frame\" with modes");
  if (fields.says("/actuator/type", "on_off_pair"))
    violate("/actuator/type", "each impulse takes a part of a firing, which on-off thrusters do not give",
            "\"on_off_pair\"", "\"proportional\" with torque_N_m, or guidance.shaper of type \"none\"");
}

void check_attitude_shaper(const SoundFields& fields, const Violate& violate) {
  const json& type = *fields.at(kType);
  if (fields.says("/guidance/type", "none")) {
    violate(kType, "a rigid body has no mode that a command could leave vibrating", shortened(type),
            "\"none\", or guidance of type \"given_controls\" with vibration");
    return;
  }
  const json* vibration = fields.at("/guidance/vibration");
  if (fields.lacks("/guidance", "vibration") || (vibration && vibration->empty()))
    violate(kType, "guidance.vibration names no mode that the controls could leave vibrating",
            shortened(type), "\"none\", or guidance.vibration with modes");
  if (fields.has("/guidance/controls/type") && !fields.says("/guidance/controls/type", "on_off"))
    violate("/guidance/controls/type", "controls are shaped that are constant between switches",
            shortened(*fields.at("/guidance/controls/type")),
            "\"on_off\", or guidance.shaper of type \"none\"");
  if (fields.says("/controller/type", "planned_torque") &&
      fields.says("/actuator/modulator/type", "schmitt_trigger"))
    violate("/actuator/modulator/type",
            "each impulse takes a part of the controls, which thrusters that are on or off do not give in "
            "open loop",
            "\"schmitt_trigger\"",
            "another modulator, or actuator.type \"ideal_torque\", or a law that follows the plan");
}

}  // namespace

void check_shaper(const SoundFields& fields, const Violate& violate) {
  const json* type = fields.at(kType);
  if (!type || *type == "none") return;
  if (has_three_axes(fields)) return check_attitude_shaper(fields, violate);
  check_axis_shaper(fields, violate);
}

ImpulseShaper specify_shaper(const json& guidance) {
  ImpulseShaper shaper;
  const auto place = guidance.find("shaper");
  if (place == guidance.end() || place->at("type") == "none") return shaper;
  shaper.type = place->at("type") == "zero_vibration" ? ShaperType::zero_vibration
                                                      : ShaperType::zero_vibration_and_derivative;
  for (const json& mode : place->at("modes")) shaper.modes.push_back(mode.get<std::size_t>() - 1);
  for (const json& mode : place->at("known_modes"))
    shaper.known_modes.push_back(
        {2 * std::numbers::pi * mode.at("frequency_hz").get<double>(), mode.at("damping_ratio")});
  return shaper;
}

std::vector<Impulse> impulses_or_none(const ImpulseShaper& shaper, std::span<const VibratingMode> own) try {
  return impulses_of(shaper, own);
} catch (const std::invalid_argument&) {
  return {};
}

std::vector<Violation> shaper_violations(const ImpulseShaper& shaper, std::span<const VibratingMode> own,
                                         const ShapedCommand& command) {
  const std::string& whose = command.whose;
  std::vector<Violation> violations;
  if (!shaper.is_there()) return violations;
  const std::string count = std::to_string(own.size());
  const std::string allowed = (own.empty()       ? "none: modes empty, and known_modes"
                               : own.size() == 1 ? "1"
                                                 : "from 1 to " + count) +
                              std::string("; `slewctl describe` lists them under command.modes");
  for (std::size_t i = 0; i < shaper.modes.size(); ++i) {
    const std::size_t mode = shaper.modes[i];
    const std::string pointer = std::string(kShaper) + "/modes/" + std::to_string(i);
    if (mode >= own.size())
      violations.push_back(
          {pointer,
           own.empty() ? "no mode of " + whose + " oscillates"
                       : whose + " has only " + count + " that oscillate" + (own.size() == 1 ? "s" : ""),
           std::to_string(mode + 1), allowed});
    else if (own[mode].damping_ratio < 0)
      violations.push_back({pointer, "this mode of " + whose + " grows by itself, whatever is commanded",
                            std::to_string(mode + 1), "a mode that does not grow"});
  }
  if (shaper.modes.empty() && shaper.known_modes.empty())
    violations.push_back({std::string(kShaper) + "/modes", "there is no mode to shape for", "[]",
                          "at least one, or known_modes, or guidance.shaper of type \"none\""});
  if (const double impulses = shaper.impulse_count(); impulses > kMostImpulses)
    violations.push_back({kShaper, "the shaper would have " + number(impulses) + " impulses", "",
                          "at most " + number(kMostImpulses) + ": fewer modes"});
  else if (impulses * command.count > command.most)
    violations.push_back(
        {kShaper, "the shaped command would have " + number(impulses * command.count) + " " + command.pieces,
         "", "at most " + number(command.most) + ": fewer modes, or fewer " + command.pieces});
  return violations;
}

json impulses_document(const std::vector<Impulse>& impulses) {
  json list = json::array();
  for (const Impulse& impulse : impulses)
    list.push_back({{"time_s", impulse.time_s}, {"amplitude", impulse.amplitude}});
  return list;
}

json command_document(const ImpulseShaper& shaper, std::span<const VibratingMode> own,
                      const std::vector<Impulse>& impulses, double unshaped_end_s) {
  return {{"modes", modes_document(own)},
          {"shaped_modes", modes_document(shaped_modes(shaper, own))},
          {"impulses", impulses_document(impulses)},
          {"unshaped_end_s", unshaped_end_s},
          {"arrival_s", unshaped_end_s + (impulses.empty() ? 0 : impulses.back().time_s)}};
}

void warn_of_late_arrival(const std::vector<Impulse>& impulses, double unshaped_end_s, double duration_s,
                          std::vector<std::string>& warnings) {
  if (impulses.empty()) return;
  if (const double arrival_s = unshaped_end_s + impulses.back().time_s; arrival_s > duration_s)
    warnings.push_back("the shaped command ends at " + number(arrival_s) + " s, after the run");
}

}  // namespace slew
