// K_m 7.46, T_m 1.33 s, U_on 0.45, U_off 0.25 (Kim & Crassidis 1998) on 1 N m: at 0.1 and 0.5 N m on for
// 0.03765823 and 0.06520914 s, off for 0.68656791 and 0.07872120 s; dead band 0.0603217, saturation 1.0335121
// N m.
#include "server/actuator/modulator_figures.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "server/actuator/pwpf_filter.hpp"

namespace {

using namespace slew;

PwpfModulator with_input(ModulatorInput input) {
  PwpfModulator modulator;
  modulator.input = input;
  return modulator;
}

TEST(Pwpf, PulsesOfAConstantDemand) {
  const PulseTrain weak = steady_pulses(PwpfModulator{}, 1, 0.1),
                   strong = steady_pulses(PwpfModulator{}, 1, -0.5);
  EXPECT_NEAR(weak.on_time_s, 0.03765823485, 1e-10);
  EXPECT_NEAR(weak.off_time_s, 0.6865679083, 1e-9);
  EXPECT_NEAR(strong.on_time_s, 0.06520913823, 1e-10);
  EXPECT_NEAR(strong.off_time_s, 0.07872119895, 1e-10);
  EXPECT_DOUBLE_EQ(weak.period_s(), weak.on_time_s + weak.off_time_s);
  EXPECT_DOUBLE_EQ(weak.frequency_Hz() * weak.period_s(), 1);
  EXPECT_NEAR(strong.duty_cycle(), 0.06520913823 / 0.14393033718, 1e-9);
}

TEST(Pwpf, DeadBandSaturationAndShortestPulse) {
  const PwpfFigures raw = figures(PwpfModulator{}, 1);
  EXPECT_NEAR(raw.dead_band, 0.06032171582, 1e-11);
  EXPECT_NEAR(raw.saturation, 1.033512064, 1e-9);
  EXPECT_NEAR(raw.minimum_on_time_s, 1.33 * std::log(7.46 / 7.26), 1e-15);

  const PwpfModulator modulator;
  EXPECT_EQ(duty_cycle(modulator, 1, raw.dead_band * (1 - 1e-12), 0), 0);
  EXPECT_GT(duty_cycle(modulator, 1, raw.dead_band * (1 + 1e-12), 0), 0);
  EXPECT_LT(duty_cycle(modulator, 1, raw.saturation * (1 - 1e-12), 0), 1);
  EXPECT_EQ(duty_cycle(modulator, 1, raw.saturation * (1 + 1e-12), 0), 1);
  EXPECT_NEAR(steady_pulses(modulator, 1, raw.dead_band * (1 + 1e-9)).on_time_s, raw.minimum_on_time_s, 1e-9);
}

TEST(Pwpf, WhatItsInputIs) {
  const double level = 0.2;
  // Raw: thresholds are absolute, so a small level saturates soon.
  EXPECT_DOUBLE_EQ(figures(PwpfModulator{}, level).dead_band, 0.45 / 7.46);
  EXPECT_DOUBLE_EQ(figures(PwpfModulator{}, level).saturation, 0.25 / 7.46 + level);
  // Clipped: never quite on all the time.
  const auto clipped = with_input(ModulatorInput::clipped);
  EXPECT_EQ(figures(clipped, level).saturation, kNever);
  EXPECT_DOUBLE_EQ(duty_cycle(clipped, level, 50, 0), duty_cycle(clipped, level, level, 0));
  EXPECT_LT(duty_cycle(clipped, level, 50, 0), 1);
  EXPECT_EQ(figures(clipped, 0.05).dead_band, kNever);
  EXPECT_EQ(duty_cycle(clipped, 0.05, 50, 0), 0);
  // Scaled: the same for every level.
  const auto scaled = with_input(ModulatorInput::scaled);
  EXPECT_DOUBLE_EQ(figures(scaled, level).dead_band, level * figures(PwpfModulator{}, 1).dead_band);
  EXPECT_DOUBLE_EQ(figures(scaled, level).saturation, level * figures(PwpfModulator{}, 1).saturation);
  EXPECT_DOUBLE_EQ(duty_cycle(scaled, level, 0.3 * level, 0), duty_cycle(PwpfModulator{}, 1, 0.3, 0));
}

// A level within the hysteresis of the trigger cannot bring the filter down: there are no pulses.
TEST(Pwpf, WithoutALimitCycle) {
  const PwpfModulator modulator;
  const double level = 0.02;
  EXPECT_EQ(figures(modulator, level).minimum_on_time_s, kNever);
  EXPECT_LT(figures(modulator, level).saturation, figures(modulator, level).dead_band);
  EXPECT_EQ(duty_cycle(modulator, level, 0.0603, 0), 0);
  EXPECT_EQ(duty_cycle(modulator, level, 0.0604, 0), 1);
}

TEST(Pwpf, TheDutyCycleRisesWithTheDemand) {
  double last = 0;
  for (double demand = 0; demand < 1.2; demand += 1e-3) {
    const double duty = duty_cycle(PwpfModulator{}, 1, demand, 0);
    EXPECT_GE(duty, last);
    EXPECT_DOUBLE_EQ(duty, duty_cycle(PwpfModulator{}, 1, -demand, 0));
    last = duty;
  }
  EXPECT_EQ(last, 1);
}

// From what the filter reaches to the time it takes and back, and in two steps as in one.
TEST(PwpfFilter, IsTheLagInClosedForm) {
  const PwpfModulator modulator;
  EXPECT_NEAR(filter_after(modulator, 0, 1, modulator.time_constant_s), 1 - std::exp(-1), 1e-15);
  EXPECT_EQ(filter_after(modulator, 0.3, 0.3, 5), 0.3);
  const double f = 0.1, target = pwpf_target(modulator, 1, 0.5, 0);
  EXPECT_DOUBLE_EQ(target, 7.46 * 0.5);
  EXPECT_NEAR(filter_after(modulator, filter_after(modulator, f, target, 0.2), target, 0.3),
              filter_after(modulator, f, target, 0.5), 1e-15);
  for (const double dt : {1e-9, 1e-3, 0.7, 4.0})
    EXPECT_NEAR(time_to_reach(modulator, f, target, filter_after(modulator, f, target, dt)), dt,
                1e-14 + 1e-13 * dt);
}

TEST(PwpfFilter, MayNeverReachAThreshold) {
  const PwpfModulator modulator;
  EXPECT_EQ(time_to_reach(modulator, 0.1, 0.4, 0.45), kNever);   // short of it
  EXPECT_EQ(time_to_reach(modulator, 0.1, 0.45, 0.45), kNever);  // tends to it
  EXPECT_EQ(time_to_reach(modulator, 0.5, 0.9, 0.45), kNever);   // away from it
  EXPECT_EQ(time_to_reach(modulator, 0.1, 0.1, 0.45), kNever);   // at rest
  EXPECT_EQ(time_to_reach(modulator, 0.45, 0.9, 0.45), 0);
  EXPECT_EQ(time_to_reach(modulator, 0.45, 0.45, 0.45), 0);
  EXPECT_GT(time_to_reach(modulator, 0.3, -2, -0.45), 0);
}

// The pulses are those of the filter followed from one switching to the next.
TEST(PwpfFilter, GivesTheLimitCycle) {
  const auto modulator = with_input(ModulatorInput::scaled);
  const double level = 2.5, demand = -0.8;
  const PulseTrain pulses = steady_pulses(modulator, level, demand);
  double f = -modulator.on;
  f = filter_after(modulator, f, pwpf_target(modulator, level, demand, -1), pulses.on_time_s);
  EXPECT_NEAR(f, -modulator.off, 1e-15);
  f = filter_after(modulator, f, pwpf_target(modulator, level, demand, 0), pulses.off_time_s);
  EXPECT_NEAR(f, -modulator.on, 1e-15);
}

TEST(Schmitt, DeadBandAndHysteresis) {
  const SchmittModulator modulator{0.5, 0.2};
  EXPECT_DOUBLE_EQ(figures(modulator, 3).dead_band, 1.5);
  EXPECT_DOUBLE_EQ(figures(modulator, 3).hysteresis, 0.9);
  EXPECT_EQ(duty_cycle(modulator, 3, 1.49, 0), 0);
  EXPECT_EQ(duty_cycle(modulator, 3, -1.5, 0), 1);
}

TEST(PulseWidth, LeavesOutWhatIsTooShort) {
  const PulseWidthModulator modulator{0.02};
  EXPECT_DOUBLE_EQ(figures(modulator, 5, 0.1).dead_band, 1);
  EXPECT_DOUBLE_EQ(figures(modulator, 5, 0.1).saturation, 5);
  EXPECT_DOUBLE_EQ(figures(modulator, 5, 0.1).least_duty_cycle, 0.2);
  EXPECT_EQ(figures(modulator, 5, 0.01).dead_band, kNever);
  EXPECT_EQ(duty_cycle(modulator, 5, 0.99, 0.1), 0);
  EXPECT_DOUBLE_EQ(duty_cycle(modulator, 5, -1.01, 0.1), 0.202);
  EXPECT_EQ(duty_cycle(modulator, 5, 7, 0.1), 1);
  EXPECT_EQ(duty_cycle(PulseWidthModulator{}, 5, 0, 0.1), 0);
  EXPECT_DOUBLE_EQ(steady_pulses(modulator, 5, 2, 0.1).off_time_s, 0.06);
}

}  // namespace
