// Three-axis slew experiments: the specification (all SI) and the runs made from it.
#pragma once

#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "server/actuator/modulator.hpp"
#include "server/actuator/thruster_set.hpp"
#include "server/control/attitude_law.hpp"
#include "server/control/mrp_trajectory.hpp"
#include "server/estimation/disturbance_observer.hpp"
#include "server/plant/body_disturbance.hpp"
#include "server/plant/rigid_body.hpp"
#include "server/sensor/attitude_sensor.hpp"
#include "server/simulation/run.hpp"

namespace slew {

/// The final attitude is the frame in which attitude is told.
struct AttitudeManeuver {
  Eigen::Vector3d initial_mrp = Eigen::Vector3d::Zero();
  Eigen::Vector3d initial_rate_rad_s = Eigen::Vector3d::Zero();
  Vector4<double> final_attitude = Vector4<double>::UnitX();  ///< relative to the frame of reference
  /// Attitude is also told by Euler angles 1-2-3 relative to the frame of reference.
  bool tells_euler_angles = false;
  MrpTrajectory reference;  ///< p_d(t); none: the final attitude
};

/// Any torque, as wheels give it; up to the maximum in each axis where there is one.
struct IdealTorque {
  std::optional<Eigen::Vector3d> maximum_N_m;
  /// Columns are the torques of controls that are throttled between -1 and 1 (Vadali, Singh & Carter 1993,
  /// Eq. 2); then there is no other maximum.
  std::optional<Eigen::Matrix3d> influence_N_m = {};
  std::optional<Eigen::Vector3d> gas_flow_m3_s = {};  ///< of each control at its most
};

/// Thrusters in pairs or larger couples, each about one axis, either way, and each a channel.
struct AxisThrusters {
  Eigen::Vector3d torque_N_m = Eigen::Vector3d::Ones();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< columns, of norm 1
  std::optional<Eigen::Vector3d> gas_flow_m3_s;        ///< of each while it fires
  /// Columns: the force of each couple, which does not move the body's attitude. Where it is known.
  std::optional<Eigen::Matrix3d> net_force_N;
  /// Valves, noise and faults of all six: +x, -x, +y, -y, +z, -z. Its geometry is not looked at.
  Thruster valve;
  std::optional<double> lever_arm_m;
  Modulator modulator;
  Propellant propellant;
};

/// Thrusters as they are mounted, each a channel; what each is to give is allocated.
struct MountedThrusters {
  std::vector<Thruster> thrusters;
  AllocationMethod allocation = AllocationMethod::non_negative_least_squares;
  Modulator modulator;
  Propellant propellant;
};

using AttitudeActuator = std::variant<IdealTorque, AxisThrusters, MountedThrusters>;

enum class AttitudeQuantity { mrp_1, mrp_2, mrp_3, mrp_norm, angle };

/// The last time at which |quantity| is outside the tolerance.
struct AttitudeSettling {
  AttitudeQuantity quantity = AttitudeQuantity::angle;
  bool is_fraction_of_initial = true;
  double tolerance = 0.01;  ///< rad, or 1 of parameters, when absolute
};

struct AttitudeSpecification {
  RigidBodyPlant plant;
  BodyDisturbances disturbances;
  AttitudeManeuver maneuver;
  AttitudeLaw law;
  std::optional<DisturbanceObserver> observer;
  std::optional<double> sample_period_s;  ///< of a sampled law; empty: evaluated continuously
  AttitudeSensorParameters sensor;
  AttitudeActuator actuator;
  AttitudeSettling settling;
  double duration_s = 0;
  double relative_tolerance = 1e-12;      ///< of the propagator of a law evaluated continuously
  double telemetry_period_s = 0;          ///< simulated time between samples
  std::vector<double> output_times_s;     ///< ascending
  double verification_tolerance = 1e-10;  ///< relative, of the SUNDIALS path
  std::uint64_t seed = 0;
};

/// Ready to run. Expects a specification that has passed validation.
std::unique_ptr<Run> make_attitude_run(const AttitudeSpecification& specification);

/// The same request through SUNDIALS: its own guards, modulators and metrics; laws, observer and the plant's
/// right-hand side are the same functions. Its report's digest is its own.
std::unique_ptr<Run> make_attitude_verification(const AttitudeSpecification& specification);

}  // namespace slew
