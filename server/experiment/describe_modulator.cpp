#include "server/experiment/describe_modulator.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "server/actuator/modulator_figures.hpp"

namespace slew {
namespace {

using nlohmann::json;

// Infinity is no number in JSON.
json finite(double value) {
  return std::isfinite(value) ? json(value) : json(nullptr);
}

const char* name_of(ModulatorInput input) {
  switch (input) {
    case ModulatorInput::raw:
      return "raw";
    case ModulatorInput::clipped:
      return "clipped";
    case ModulatorInput::scaled:
      return "scaled";
  }
  return "";
}

json parameters(const PwpfModulator& pwpf) {
  return {{"type", "pwpf"}, {"gain", pwpf.gain}, {"time_constant_s", pwpf.time_constant_s},
          {"on", pwpf.on},  {"off", pwpf.off},   {"input", name_of(pwpf.input)}};
}
json parameters(const SchmittModulator& schmitt) {
  return {{"type", "schmitt_trigger"}, {"on", schmitt.on}, {"off", schmitt.off}};
}
json parameters(const PulseWidthModulator& width) {
  return {{"type", "pulse_width"}, {"minimum_on_time_s", width.minimum_on_time_s}};
}

json figures_of(const PwpfModulator& pwpf, double level, double) {
  const PwpfFigures of = figures(pwpf, level);
  return {{"dead_band", of.dead_band},
          {"saturation", finite(of.saturation)},
          {"minimum_on_time_s", finite(of.minimum_on_time_s)}};
}
json figures_of(const SchmittModulator& schmitt, double level, double) {
  const SchmittFigures of = figures(schmitt, level);
  return {{"dead_band", of.dead_band}, {"hysteresis", of.hysteresis}};
}
json figures_of(const PulseWidthModulator& width, double level, double period_s) {
  const PulseWidthFigures of = figures(width, level, period_s);
  return {{"dead_band", of.dead_band},
          {"saturation", of.saturation},
          {"least_duty_cycle", of.least_duty_cycle},
          {"period_s", period_s}};
}

json point(double demand, const PulseTrain& pulses) {
  return {{"demand", demand},
          {"on_time_s", finite(pulses.on_time_s)},
          {"off_time_s", finite(pulses.off_time_s)},
          {"duty_cycle", pulses.duty_cycle()}};
}

json point(const PwpfModulator& pwpf, double level, double demand, double) {
  return point(demand, steady_pulses(pwpf, level, demand));
}
json point(const SchmittModulator& schmitt, double level, double demand, double period_s) {
  return {{"demand", demand}, {"duty_cycle", duty_cycle(schmitt, level, demand, period_s)}};
}
json point(const PulseWidthModulator& width, double level, double demand, double period_s) {
  return point(demand, steady_pulses(width, level, demand, period_s));
}

// From no demand on, in steps of this fraction of the level.
json curve(const Modulator& modulator, double level, double period_s, double step, int steps) {
  json points = json::array();
  for (int i = 0; i <= steps; ++i)
    points.push_back(std::visit(
        [&](const auto& one) { return point(one, level, i * step * level, period_s); }, modulator));
  return points;
}

}  // namespace

json modulator_document(const Modulator& modulator, std::span<const double> levels,
                        std::optional<double> sample_period_s) {
  const double period_s = sample_period_s.value_or(1);
  json document = std::visit([](const auto& one) { return parameters(one); }, modulator);
  document["levels"] = json::array();
  std::vector<double> told;
  for (const double level : levels) {
    if (std::find(told.begin(), told.end(), level) != told.end()) continue;
    told.push_back(level);
    json figures = std::visit([&](const auto& one) { return figures_of(one, level, period_s); }, modulator);
    figures["level"] = level;
    figures["curve"] = curve(modulator, level, period_s, 0.05, 22);
    document["levels"].push_back(std::move(figures));
  }
  return document;
}

json modulator_design(const Modulator& modulator, double level, const char* unit,
                      std::optional<double> sample_period_s) {
  const double period_s = sample_period_s.value_or(1);
  json document = std::visit([&](const auto& one) { return figures_of(one, level, period_s); }, modulator);
  document["type"] = "modulator";
  document["modulator"] = std::visit([](const auto& one) { return parameters(one); }, modulator);
  document["level"] = level;
  document["unit"] = unit;
  document["curve"] = curve(modulator, level, period_s, 0.0025, 480);
  return document;
}

}  // namespace slew
