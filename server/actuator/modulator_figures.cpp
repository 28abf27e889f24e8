#include "server/actuator/modulator_figures.hpp"

#include <algorithm>
#include <cmath>

#include "server/actuator/pwpf_filter.hpp"

namespace slew {

PulseTrain steady_pulses(const PwpfModulator& modulator, double level, double demand) {
  const double size = std::abs(demand);
  const double rising = pwpf_target(modulator, level, size, 0);
  const double falling = pwpf_target(modulator, level, size, 1);
  if (rising <= modulator.on) return {};
  const double on_time_s = time_to_reach(modulator, modulator.on, falling, modulator.off);
  if (on_time_s == kNever) return {kNever, 0};
  return {on_time_s, time_to_reach(modulator, modulator.off, rising, modulator.on)};
}

PulseTrain steady_pulses(const PulseWidthModulator& modulator, double level, double demand, double period_s) {
  const double on_time_s = std::min(std::abs(demand) / level, 1.0) * period_s;
  if (on_time_s == 0 || on_time_s < modulator.minimum_on_time_s) return {};
  if (on_time_s >= period_s) return {kNever, 0};
  return {on_time_s, period_s - on_time_s};
}

PwpfFigures figures(const PwpfModulator& modulator, double level) {
  const double feedback = pwpf_feedback(modulator, level);
  const double unit = modulator.input == ModulatorInput::scaled ? level : 1;
  const bool is_clipped = modulator.input == ModulatorInput::clipped;
  PwpfFigures figures;
  figures.dead_band = modulator.on / modulator.gain * unit;
  figures.saturation = (modulator.off / modulator.gain + feedback) * unit;
  if (is_clipped && figures.dead_band >= level) figures.dead_band = kNever;
  if (is_clipped && modulator.off > 0) figures.saturation = kNever;
  figures.minimum_on_time_s =
      time_to_reach(modulator, modulator.on, modulator.on - modulator.gain * feedback, modulator.off);
  return figures;
}

SchmittFigures figures(const SchmittModulator& modulator, double level) {
  return {modulator.on * level, (modulator.on - modulator.off) * level};
}

PulseWidthFigures figures(const PulseWidthModulator& modulator, double level, double period_s) {
  const double least = modulator.minimum_on_time_s / period_s;
  return {least <= 1 ? least * level : kNever, level, least};
}

namespace {

struct DutyCycle {
  double level, demand, period_s;

  double operator()(const PwpfModulator& modulator) const {
    return steady_pulses(modulator, level, demand).duty_cycle();
  }
  double operator()(const SchmittModulator& modulator) const {
    return std::abs(demand) >= modulator.on * level ? 1 : 0;
  }
  double operator()(const PulseWidthModulator& modulator) const {
    return steady_pulses(modulator, level, demand, period_s).duty_cycle();
  }
};

}  // namespace

double duty_cycle(const Modulator& modulator, double level, double demand, double period_s) {
  return std::visit(DutyCycle{level, demand, period_s}, modulator);
}

}  // namespace slew
