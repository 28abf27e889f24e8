// What is measured on a trajectory. Each metric is defined once, in schemas/result.schema.json.
// SI throughout (rad); empty means that it never happened.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace slew {

/// A quantity of the thrusters, in total, by sign of the torque and by part of the maneuver:
/// accelerating = until the first time the along-slew firing ends; coasting = from there to the first firing
/// against the slew; braking = from there to the crossing of the final angle, or to the first rest.
template <typename T>
struct BySign {
  T positive{};
  T negative{};
};

template <typename T>
struct ThrusterTally {
  T total{};
  BySign<T> by_sign;
  std::vector<T> per_thruster;
  BySign<T> accelerating;
  BySign<T> coasting;
  BySign<T> braking;
};

/// A local extremum of the angle after the start: the error theta - theta_f there.
struct Extremum {
  double t_s;
  double error_rad;
};

struct LimitCycle {
  double period_s;
  double amplitude_rad;
  double rate_amplitude_rad_s;
  double coast_s;   ///< length of its last coast
  double firing_s;  ///< and of its last firing
};

/// What is left of the vibration of a mode: the amplitude of the angle in it.
struct ModeVibration {
  double frequency_rad_s;  ///< undamped
  double damping_ratio;
  double residual_rad;
};

/// The rotation of an antenna on a flexible structure, axis by axis.
struct AntennaRotation {
  std::array<double, 3> peak_rad{};      ///< largest size
  std::array<double, 3> residual_rad{};  ///< largest size over the last second
  std::optional<double> settling_s;  ///< last time outside the tolerance, after the origin: may be negative
};

/// The integral of the squared controls of a group of actuators: N^2 m^2 s of torques, N^2 s of forces.
struct GroupEffort {
  std::string group;
  bool is_torque;
  double effort;
};

/// Where a frame's nodes are, and how far they are displaced relative to the hub.
struct DeflectedShape {
  double t_s = 0;
  std::vector<std::array<double, 3>> position_m, displacement_m;
  std::vector<std::array<std::size_t, 2>> members;
};

struct StructureMetrics {
  double command_arrival_s = 0;
  AntennaRotation pointing;  ///< relative to where the slew should be
  AntennaRotation relative;  ///< to the hub
  std::vector<GroupEffort> efforts;
  DeflectedShape shape;  ///< when the antenna was turned farthest relative to the hub
};

struct Metrics {
  double end_time_s = 0;                  ///< simulated time at which the run ended
  std::optional<double> maneuver_time_s;  ///< end box reached and held until the end
  std::optional<double> end_box_entry_s;  ///< first entry of the end box
  std::optional<double> settling_time_s;  ///< last time outside the settling tolerance
  std::optional<double>
      overshoot_rad;  ///< largest excursion beyond theta_f at the first extremum past it; 0 when none
  std::vector<Extremum> extrema;         ///< the first 32 extrema of theta after the start
  std::optional<double> switch_on_s;     ///< first firing against the slew
  std::optional<double> coast_s;         ///< length of the coast before it
  std::optional<double> crossing_s;      ///< first time theta reaches theta_f
  std::optional<double> first_rest_s;    ///< first time the rate along the slew is <= 0 after braking starts
  std::optional<double> rest_error_rad;  ///< theta - theta_f there
  std::optional<double> braking_duty;    ///< on-time against the slew while braking / duration of braking
  double final_error_rad = 0;            ///< theta - theta_f at the end
  double residual_rate_rad_s = 0;        ///< rate at the end
  double peak_rate_rad_s = 0;            ///< largest |rate|
  ThrusterTally<double> thruster_on_time_s;
  ThrusterTally<std::uint64_t> firings;  ///< a firing: a maximal interval of one constant non-zero command
  double angular_impulse_N_m_s = 0;      ///< integral of |torque|
  double control_effort_N2_m2_s = 0;     ///< integral of torque squared
  std::optional<double> control_effort_N2_s;  ///< integral of force squared, where the lever arm is known
  std::optional<double> propellant_kg;        ///< where lever arm and specific impulse are known
  std::optional<double> gas_volume_m3;        ///< where also the gas density, or the flow, is known
  std::optional<double> kinetic_energy_J;     ///< of rotation, at the end; in three axes
  std::optional<LimitCycle> limit_cycle;      ///< when the last two periods agree within 1 %
  std::optional<double>
      switching_period_s;                ///< between the last two firings of the same sign, begin to begin
  std::optional<double> rest_s;          ///< when it came to rest for good, in a mode of rest
  double sliding_s = 0;                  ///< time spent sliding on a switching surface
  std::vector<ModeVibration> vibration;  ///< at the end; about one axis, of each mode that oscillates
  std::optional<StructureMetrics> structure;
  std::vector<double> final_state;  ///< in the order of the state channels
};

}  // namespace slew
