#include "server/experiment/structure_request.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/experiment/derived_structures.hpp"
#include "server/experiment/frame_request.hpp"
#include "server/experiment/limits.hpp"
#include "server/experiment/shaper_request.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr double kRadPerDeg = std::numbers::pi / 180;

std::size_t motion_of(const json& name) {
  static constexpr std::array<const char*, 6> kNames{"ux", "uy", "uz", "rx", "ry", "rz"};
  return static_cast<std::size_t>(std::find(kNames.begin(), kNames.end(), name) - kNames.begin());
}

void add_motions(const json& of, std::vector<NodeMotion>& motions) {
  for (const json& name : of.at("motions")) motions.push_back({of.at("node"), motion_of(name)});
}

ElasticReduction specify_coordinates(const json& coordinates) {
  const json& type = coordinates.at("type");
  if (type == "clamped_modes") return ClampedModes{coordinates.at("count")};
  if (type == "free_modes") return HubFreeModes{coordinates.at("count")};
  if (type == "all_modes") return EveryMode{};
  KrylovVectors vectors{coordinates.at("shifts_rad_s"), {}};
  for (const json& load : coordinates.at("loads")) add_motions(load, vectors.loads);
  return vectors;
}

void specify_guidance(const json& guidance, StructureGuidance& spec) {
  spec.torque_N_m = guidance.at("torque_N_m");
  spec.pulse_rad_s = guidance.at("pulse_rad_s");
  if (guidance.at("zero_order_loads") == "about_axis_only") spec.loads = ZeroOrderLoads::about_axis_only;
  spec.shaper = specify_shaper(guidance);
}

StructureControl specify_control(const json& request) {
  const json& controller = request.at("controller");
  const json& estimator = request.at("estimator");
  StructureControl spec;
  spec.design = specify_coordinates(controller.contains("design") ? controller.at("design")
                                                                  : request.at("plant").at("coordinates"));
  spec.gains = {.surface_rad_s = controller.at("surface_weight_rad_s"),
                .reaching_1_s = controller.at("reaching_gain_1_s"),
                .rigid_1_s = controller.at("rigid_gain_1_s"),
                .form = controller.at("form") == "consistent" ? LawForm::consistent : LawForm::as_printed,
                .knows_loads = controller.at("knows_loads")};
  const json& tracking = controller.at("tracking");
  spec.tracked_modes = tracking.at("modes");
  spec.tracking_scale = tracking.at("scale");
  spec.rigid_reference =
      tracking.at("rigid_reference") == "natural" ? RigidReference::natural : RigidReference::zero;
  spec.intensities = {.process = estimator.at("process_noise_intensity"),
                      .measurement = estimator.at("measurement_noise_intensity"),
                      .initial_covariance = estimator.at("initial_covariance")};
  spec.filter_knows_loads = estimator.at("knows_loads");
  return spec;
}

void specify_sensors(const json& sensors, StructureSpecification& spec) {
  if (sensors.at("type") != "node_sensors") return;
  for (const json& group : sensors.at("groups")) {
    SensorGroup& one = spec.sensors.emplace_back();
    add_motions(group, one.motions);
    one.sees_displacement = group.at("sees") != "rate";
    one.sees_rate = group.at("sees") != "displacement";
  }
  if (const double intensity = sensors.at("noise_intensity"); intensity > 0)
    spec.sensor_noise = HeldNoise{intensity, sensors.at("noise_period_s")};
}

StructureSettling specify_settling(const json& settling, double angle_rad) {
  StructureSettling spec;
  spec.quantity = settling.at("quantity") == "antenna_pointing_deg"   ? StructureQuantity::pointing
                  : settling.at("quantity") == "antenna_rotation_deg" ? StructureQuantity::relative
                                                                      : StructureQuantity::hub_angle;
  const json& tolerance = settling.at("tolerance");
  spec.tolerance_rad = tolerance.at("type") == "absolute"
                           ? tolerance.at("value_deg").get<double>() * kRadPerDeg
                           : tolerance.at("value").get<double>() * std::abs(angle_rad);
  spec.from_arrival = settling.at("origin") == "command_arrival";
  return spec;
}

}  // namespace

bool is_structure(const json& plant) {
  return plant.is_object() && plant.value("type", json()) == "flexible_structure";
}

StructureSpecification specify_structure(const json& request) {
  const json& plant = request.at("plant");
  StructureSpecification spec;
  spec.frame = specify_frame(plant);
  spec.axis = hub_axis(plant);
  spec.alpha_1_s = plant.at("mass_damping_1_s");
  spec.beta_s = plant.at("stiffness_damping_s");
  spec.plant = specify_coordinates(plant.at("coordinates"));
  spec.antenna_node = plant.at("antenna_node");
  const json& maneuver = request.at("maneuver");
  spec.initial_angle_rad = maneuver.at("initial_angle_deg").get<double>() * kRadPerDeg;
  specify_guidance(request.at("guidance"), spec.guidance);
  spec.guidance.angle_rad =
      maneuver.at("final_angle_deg").get<double>() * kRadPerDeg - spec.initial_angle_rad;
  for (const json& group : request.at("actuator").at("groups")) {
    ActuatorGroup& one = spec.actuators.emplace_back();
    one.name = group.at("name");
    add_motions(group, one.motions);
  }
  specify_sensors(request.at("sensors"), spec);
  if (request.at("controller").at("type") == "tracking_sliding_mode") spec.control = specify_control(request);
  for (const json& noise : request.at("disturbances"))
    if (noise.at("intensity") > 0)
      spec.process_noise = HeldNoise{noise.at("intensity"), noise.at("period_s")};
  spec.settling = specify_settling(request.at("metrics").at("settling"), spec.guidance.angle_rad);
  const json& simulation = request.at("simulation");
  spec.duration_s = simulation.at("duration_s");
  spec.relative_tolerance = simulation.at("relative_tolerance");
  spec.verification_tolerance = simulation.at("verification_relative_tolerance");
  spec.seed = simulation.at("seed");
  spec.telemetry_period_s = request.at("telemetry").at("sample_period_s");
  spec.output_times_s = request.at("outputs").at("at_s").get<std::vector<double>>();
  std::sort(spec.output_times_s.begin(), spec.output_times_s.end());
  spec.system = derived_structure(request, spec);
  return spec;
}

std::optional<Violation> why_it_cannot_be_built(const StructureSpecification& spec) {
  // Ten boundaries a second, of a few steps each, and one where noise changes.
  constexpr double kStepsPerBoundary = 4;
  double boundaries = 10 * spec.duration_s;
  for (const auto& noise : {spec.process_noise, spec.sensor_noise})
    if (noise) boundaries += spec.duration_s / noise->period_s;
  if (const double most = limits().max_steps; kStepsPerBoundary * boundaries > most)
    return Violation{
        "/simulation/duration_s", "the run would take too many propagator steps", number(spec.duration_s),
        "at most " + number(std::floor(spec.duration_s * most / (kStepsPerBoundary * boundaries))) +
            " s of this"};
  if (spec.system) return std::nullopt;
  static const std::vector<std::pair<StructurePart, const char*>> kPointers = {
      {StructurePart::frame, "/plant/nodes"},        {StructurePart::plant, "/plant/coordinates"},
      {StructurePart::design, "/controller/design"}, {StructurePart::command, "/guidance/shaper"},
      {StructurePart::sensors, "/sensors/groups"},   {StructurePart::tracking, "/controller/tracking/modes"},
      {StructurePart::surface, "/actuator/groups"},  {StructurePart::filter, "/estimator"}};
  static const std::vector<std::pair<StructurePart, const char*>> kAllowed = {
      {StructurePart::frame, "parts that resist every motion, or have mass"},
      {StructurePart::plant, "fewer or other vectors, shifts away from every natural frequency"},
      {StructurePart::design, "fewer or other vectors, shifts away from every natural frequency"},
      {StructurePart::command, "modes of the design model that oscillate"},
      {StructurePart::sensors, "sensors that see every mode of the design model"},
      {StructurePart::tracking, "at most as many as the design model has"},
      {StructurePart::surface, "independent actuators that move the hub and the structure in every way"},
      {StructurePart::filter, "a design model and intensities with a steady filter"}};
  const auto of = [](const auto& list, StructurePart part) {
    return std::string(
        std::find_if(list.begin(), list.end(), [&](const auto& one) { return one.first == part; })->second);
  };
  try {
    build_structure_system(spec);
  } catch (const StructureFault& fault) {
    return Violation{of(kPointers, fault.part), fault.what(), "", of(kAllowed, fault.part)};
  }
  return std::nullopt;
}

std::vector<std::string> warnings_about(const StructureSpecification& spec) {
  std::vector<std::string> warnings;
  const SineSquaredPulses& pulses = spec.system->command.pulses();
  if (const double angle = std::abs(pulses.angle_rad); angle > 0 && angle < pulses.least_angle_rad())
    warnings.push_back("the stop begins before the start has ended, at " + number(pulses.stop_s()) +
                       " s: there is no coast, and neither pulse reaches its peak");
  if (spec.system->command.arrival_s() > spec.duration_s)
    warnings.push_back("the command ends at " + number(spec.system->command.arrival_s()) +
                       " s, after the run");
  return warnings;
}

std::vector<NodeMotion> response_motions(const StructureSpecification& spec) {
  if (const auto* krylov = std::get_if<KrylovVectors>(&spec.plant)) return krylov->loads;
  if (spec.control)
    if (const auto* krylov = std::get_if<KrylovVectors>(&spec.control->design)) return krylov->loads;
  std::vector<NodeMotion> motions;
  for (const SensorGroup& group : spec.sensors)
    motions.insert(motions.end(), group.motions.begin(), group.motions.end());
  if (motions.empty())
    for (std::size_t i = 0; i < 3; ++i) motions.push_back({spec.antenna_node, i});
  return motions;
}

}  // namespace slew
