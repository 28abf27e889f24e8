// Slews of a large flexible structure: the specification (all SI) and the runs made from it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/control/tracking_sliding_mode.hpp"
#include "server/estimation/elastic_filter.hpp"
#include "server/guidance/elastic_tracking.hpp"
#include "server/guidance/sine_squared_pulses.hpp"
#include "server/simulation/run.hpp"
#include "server/structure/reduction.hpp"

namespace slew {

/// One of a node's six: 0 to 2 along, 3 to 5 about the hub's x, y and z.
struct NodeMotion {
  std::size_t node = 0;
  std::size_t motion = 0;

  bool is_rotation() const { return motion >= 3; }
  Eigen::Index coordinate() const { return static_cast<Eigen::Index>(6 * node + motion); }
};

// In which coordinates the structure deforms.
struct EveryMode {};  ///< all of them, with the hub clamped
struct ClampedModes {
  Eigen::Index count = 0;
};
struct HubFreeModes {
  Eigen::Index count = 0;
};
struct KrylovVectors {
  std::vector<double> shifts_rad_s;
  std::vector<NodeMotion> loads;
};
using ElasticReduction = std::variant<EveryMode, ClampedModes, HubFreeModes, KrylovVectors>;

/// Any force, or torque, and each a channel of its own.
struct ActuatorGroup {
  std::string name;
  std::vector<NodeMotion> motions;  ///< all of them forces, or all torques
};

/// Seen from the hub.
struct SensorGroup {
  std::vector<NodeMotion> motions;
  bool sees_displacement = true, sees_rate = true;
};

/// Sine-squared pulses, shaped for some modes of the design model with the hub free, and for others.
struct StructureGuidance {
  double torque_N_m = 1;
  double pulse_rad_s = 1;
  double angle_rad = 0;
  ImpulseShaper shaper;
  ZeroOrderLoads loads = ZeroOrderLoads::all;
};

/// Sliding mode, tracking model and filter. Nothing tracked: the structure is held as a rigid one.
struct StructureControl {
  ElasticReduction design = EveryMode{};
  TrackingGains gains;
  Eigen::Index tracked_modes = 0;
  double tracking_scale = 1;  ///< mu
  RigidReference rigid_reference = RigidReference::natural;
  FilterIntensities intensities;
  bool filter_knows_loads = true;
};

/// White noise of an intensity as a machine can have it: a number held over each period, of variance
/// intensity / period.
struct HeldNoise {
  double intensity = 0;
  double period_s = 0;
};

enum class StructureQuantity { pointing, relative, hub_angle };

/// The last time any axis of the antenna's rotation, or the hub's angle less the final one, is outside the
/// tolerance.
struct StructureSettling {
  StructureQuantity quantity = StructureQuantity::pointing;
  double tolerance_rad = 0;
  bool from_arrival = true;  ///< of the command; else from the start
};

struct StructureSystem;

struct StructureSpecification {
  SpaceFrame frame;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
  double alpha_1_s = 0, beta_s = 0;  ///< C = alpha M + beta K
  ElasticReduction plant = EveryMode{};
  std::size_t antenna_node = 0;
  double initial_angle_rad = 0;  ///< of the hub, about the axis
  StructureGuidance guidance;
  std::vector<ActuatorGroup> actuators;
  std::vector<SensorGroup> sensors;
  std::optional<StructureControl> control;  ///< none: the command alone
  std::optional<HeldNoise> process_noise;   ///< on every elastic acceleration of the plant
  std::optional<HeldNoise> sensor_noise;
  StructureSettling settling;
  double duration_s = 0;
  double relative_tolerance = 1e-8;
  double telemetry_period_s = 0;          ///< simulated time between samples
  std::vector<double> output_times_s;     ///< ascending
  double verification_tolerance = 1e-10;  ///< relative, of the second opinion
  std::uint64_t seed = 0;
  /// What follows from all above but the last five; null: not derived yet.
  std::shared_ptr<const StructureSystem> system;
};

/// Ready to run. Expects a specification that has passed validation.
std::unique_ptr<Run> make_structure_run(const StructureSpecification& specification);

/// The same request by CVODE's multistep method: its own equations of the loop, with the filter's Riccati
/// equation among them, and its own metrics. Its report's digest is its own.
std::unique_ptr<Run> make_structure_verification(const StructureSpecification& specification);

}  // namespace slew
