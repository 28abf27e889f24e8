#include "server/experiment/attitude_request.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/actuator/modulator_figures.hpp"
#include "server/experiment/law_fields.hpp"
#include "server/experiment/limits.hpp"

namespace slew {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using nlohmann::json;

Vector3d vector_of(const json& numbers) {
  if (numbers.is_number()) return Vector3d::Constant(numbers.get<double>());
  return {numbers.at(0).get<double>(), numbers.at(1).get<double>(), numbers.at(2).get<double>()};
}

Matrix3d matrix_of(const json& rows) {
  if (!rows.at(0).is_array()) return vector_of(rows).asDiagonal();
  Matrix3d matrix;
  for (Eigen::Index i = 0; i < 3; ++i) matrix.row(i) = vector_of(rows.at(static_cast<std::size_t>(i)));
  return matrix;
}

json rows_of(const Matrix3d& matrix) {
  json rows = json::array();
  for (Eigen::Index i = 0; i < 3; ++i) rows.push_back({matrix(i, 0), matrix(i, 1), matrix(i, 2)});
  return rows;
}

namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;

double radians(const json& value_deg) {
  return value_deg.get<double>() * kRadPerDeg;
}

Vector3d radians_of(const json& values_deg) {
  return vector_of(values_deg) * kRadPerDeg;
}

std::optional<double> optional_number(const json& block, const char* name) {
  const auto place = block.find(name);
  return place == block.end() ? std::nullopt : std::optional(place->get<double>());
}

/// Without the way through Euler parameters, which would round it.
std::optional<Vector3d> mrp_as_given(const json& attitude) {
  const json& type = attitude.at("type");
  if (type == "mrp") return vector_of(attitude.at("value"));
  if (type != "rotation") return std::nullopt;
  return vector_of(attitude.at("axis")).stableNormalized() * std::tan(radians(attitude.at("angle_deg")) / 4);
}

std::optional<PivotWeight> specify_weight(const json& plant) {
  const auto weight = plant.find("pivot_weight");
  if (weight == plant.end()) return std::nullopt;
  return PivotWeight{weight->at("mass_kg"), vector_of(weight->at("centre_m")), weight->at("gravity_m_s2")};
}

std::optional<PedestalSprings> specify_springs(const json& plant) {
  const auto springs = plant.find("pedestal_springs");
  if (springs == plant.end()) return std::nullopt;
  return PedestalSprings{springs->at("pitch_N_m_rad"), springs->at("roll_N_m_rad"),
                         radians(springs->at("pitch_at_rest_deg"))};
}

RigidBodyPlant specify_plant(const json& plant) {
  return {.inertia_kg_m2 = matrix_of(plant.at("inertia_kg_m2")),
          .attitude =
              plant.at("attitude") == "mrp" ? AttitudeParameters::mrp : AttitudeParameters::euler_parameters,
          .shadow_switch_norm = optional_number(plant, "shadow_switch_norm"),
          .weight = specify_weight(plant),
          .springs = specify_springs(plant)};
}

MrpTrajectory specify_reference(const json& reference) {
  const json& type = reference.at("type");
  if (type == "sinusoids")
    return {MrpSinusoids{vector_of(reference.at("amplitude")),
                         2 * std::numbers::pi * vector_of(reference.at("frequency_hz")),
                         radians_of(reference.at("phase_deg"))}};
  if (type == "eigenaxis_rotation")
    return {EigenaxisRotation{
        vector_of(reference.at("axis")).stableNormalized(), radians(reference.at("initial_angle_deg")),
        radians(reference.at("final_angle_deg")), reference.at("from_s"), reference.at("duration_s")}};
  if (type == "planned") return {PlannedMotion{}};
  return {};
}

BodyDisturbances specify_disturbances(const json& disturbances) {
  BodyDisturbances spec;
  for (const json& disturbance : disturbances) {
    const json& type = disturbance.at("type");
    if (type == "body_constant") spec.constant_N_m += vector_of(disturbance.at("torque_N_m"));
    if (type == "body_step")
      spec.steps.push_back({disturbance.at("from_s"), vector_of(disturbance.at("torque_N_m"))});
    if (type == "body_sinusoid")
      spec.sinusoids.push_back({vector_of(disturbance.at("amplitude_N_m")),
                                2 * std::numbers::pi * disturbance.at("frequency_hz").get<double>(),
                                radians(disturbance.at("phase_deg"))});
  }
  // One that begins at once is there from the beginning.
  std::erase_if(spec.steps, [&](const BodyStepDisturbance& step) {
    if (step.from_s == 0) spec.constant_N_m += step.torque_N_m;
    return step.from_s == 0;
  });
  std::stable_sort(
      spec.steps.begin(), spec.steps.end(),
      [](const BodyStepDisturbance& a, const BodyStepDisturbance& b) { return a.from_s < b.from_s; });
  return spec;
}

void specify_law(const json& controller, const json& estimator, AttitudeSpecification& spec) {
  spec.law = *attitude_law_of(controller.at("type").get_ref<const std::string&>());
  LawReader reader(controller, spec.plant.inertia_kg_m2);
  std::visit([&](auto& law) { law.fields(reader); }, spec.law);
  if (const auto evaluation = controller.find("evaluation"); evaluation != controller.end())
    spec.sample_period_s = optional_number(*evaluation, "period_s");
  if (estimator.at("type") != "disturbance_observer") return;
  DisturbanceObserver observer{.pole_rad_s = estimator.at("pole_rad_s")};
  const auto inertia = estimator.find("inertia_kg_m2");
  observer.inertia_kg_m2 = inertia != estimator.end()
                               ? matrix_of(*inertia)
                               : reader.belief_kg_m2().value_or(spec.plant.inertia_kg_m2);
  if (estimator.at("feeding") == "applied_total") observer.feeding = ObserverFeeding::applied_total;
  if (estimator.at("feeding") == "commanded") observer.feeding = ObserverFeeding::commanded;
  spec.observer = observer;
}

AttitudeSensorParameters specify_sensor(const json& sensors) {
  if (sensors.at("type") == "ideal") return {};
  return {.angle_bias_rad = radians_of(sensors.at("angle_bias_deg")),
          .rate_bias_rad_s = radians_of(sensors.at("rate_bias_deg_s")),
          .angle_noise_rad = radians(sensors.at("angle_noise_deg")),
          .rate_noise_rad_s = radians(sensors.at("rate_noise_deg_s")),
          .angle_quantum_rad = radians(sensors.at("angle_quantum_deg")),
          .rate_quantum_rad_s = radians(sensors.at("rate_quantum_deg_s")),
          .laws_samples_per_reading = sensors.at("laws_samples_per_reading"),
          .delay_samples = sensors.at("delay_samples")};
}

Modulator specify_modulator(const json& modulator) {
  const json& type = modulator.at("type");
  if (type == "pulse_width") return PulseWidthModulator{modulator.at("minimum_on_time_s")};
  if (type == "schmitt_trigger") return SchmittModulator{modulator.at("on"), modulator.at("off")};
  PwpfModulator pwpf{modulator.at("gain"), modulator.at("time_constant_s"), modulator.at("on"),
                     modulator.at("off")};
  if (modulator.at("input") == "clipped") pwpf.input = ModulatorInput::clipped;
  if (modulator.at("input") == "scaled") pwpf.input = ModulatorInput::scaled;
  return pwpf;
}

Propellant specify_propellant(const json& actuator) {
  return {.specific_impulse_s = optional_number(actuator, "specific_impulse_s"),
          .gas_density_kg_m3 = optional_number(actuator, "gas_density_kg_m3"),
          .tank_kg = optional_number(actuator, "tank_kg")};
}

/// The fields of a valve: its own, or else as the set says.
void specify_valve(const json& valve, const json& set, Thruster& thruster) {
  const auto number = [&](const char* name) {
    return valve.contains(name) ? valve.at(name).get<double>() : set.at(name).get<double>();
  };
  thruster.minimum_on_time_s = number("minimum_on_time_s");
  thruster.minimum_off_time_s = number("minimum_off_time_s");
  if ((valve.contains("minimum_on_time_of") ? valve : set).at("minimum_on_time_of") == "effective_thrust")
    thruster.minimum_on_time_of = MinimumOnTimeOf::effective_thrust;
  thruster.on_delay_s = number("on_delay_s");
  thruster.off_delay_s = number("off_delay_s");
  thruster.rise_s = number("rise_s");
  thruster.fall_s = number("fall_s");
  thruster.noise = number("noise");
}

std::optional<Vector3d> optional_vector(const json& block, const char* name) {
  const auto place = block.find(name);
  return place == block.end() ? std::nullopt : std::optional(vector_of(*place));
}

AttitudeActuator specify_actuator(const json& actuator) {
  const json& type = actuator.at("type");
  if (type == "ideal_torque") {
    IdealTorque ideal;
    if (const auto most = actuator.find("maximum_torque_N_m"); most != actuator.end())
      ideal.maximum_N_m = vector_of(*most);
    if (const auto influence = actuator.find("influence_N_m"); influence != actuator.end())
      ideal.influence_N_m = matrix_of(*influence);
    ideal.gas_flow_m3_s = optional_vector(actuator, "gas_flow_m3_s");
    return ideal;
  }
  if (type == "axis_thrusters") {
    AxisThrusters pairs;
    pairs.torque_N_m = vector_of(actuator.at("torque_N_m"));
    specify_valve(actuator, actuator, pairs.valve);
    pairs.lever_arm_m = optional_number(actuator, "lever_arm_m");
    pairs.modulator = specify_modulator(actuator.at("modulator"));
    pairs.propellant = specify_propellant(actuator);
    return pairs;
  }
  if (type == "thruster_couples") {
    AxisThrusters couples;
    const Matrix3d influence = influence_of_couples(actuator, couples.net_force_N);
    couples.torque_N_m = influence.colwise().norm();
    couples.axes = influence.colwise().normalized();
    couples.gas_flow_m3_s = optional_vector(actuator, "gas_flow_m3_s");
    specify_valve(actuator, actuator, couples.valve);
    couples.modulator = specify_modulator(actuator.at("modulator"));
    return couples;
  }
  MountedThrusters mounted;
  mounted.modulator = specify_modulator(actuator.at("modulator"));
  mounted.propellant = specify_propellant(actuator);
  for (const json& thruster : actuator.at("thrusters"))
    mounted.thrusters.push_back(specify_thruster(thruster, actuator));
  if (actuator.at("allocation").at("type") == "linear_programme")
    mounted.allocation = AllocationMethod::linear_programme;
  return mounted;
}

AttitudeSettling specify_settling(const json& settling) {
  static const std::vector<std::pair<const char*, AttitudeQuantity>> kQuantities = {
      {"mrp_1", AttitudeQuantity::mrp_1},
      {"mrp_2", AttitudeQuantity::mrp_2},
      {"mrp_3", AttitudeQuantity::mrp_3},
      {"mrp_norm", AttitudeQuantity::mrp_norm}};
  AttitudeSettling spec;
  for (const auto& [name, quantity] : kQuantities)
    if (settling.at("quantity") == name) spec.quantity = quantity;
  const json& tolerance = settling.at("tolerance");
  spec.is_fraction_of_initial = tolerance.at("type") == "fraction_of_initial";
  spec.tolerance = tolerance.contains("value_deg") ? radians(tolerance.at("value_deg"))
                                                   : tolerance.at("value").get<double>();
  return spec;
}

}  // namespace

bool is_attitude_law(const json& controller) {
  return attitude_law_of(controller.at("type").get_ref<const std::string&>()).has_value();
}

Vector4d attitude_of(const json& attitude) {
  if (attitude.at("type") == "euler_parameters") {
    const json& value = attitude.at("value");
    const Vector3d v{value.at(1).get<double>(), value.at(2).get<double>(), value.at(3).get<double>()};
    return Vector4d{value.at(0).get<double>(), v[0], v[1], v[2]}.stableNormalized();
  }
  if (attitude.at("type") == "euler_123")
    return euler_parameters_of_angles(radians_of(attitude.at("angles_deg")));
  if (attitude.at("type") == "rotation" && vector_of(attitude.at("axis")).isZero(0)) return Vector4d::Zero();
  return euler_parameters(*mrp_as_given(attitude));
}

Vector3d initial_mrp_of(const json& maneuver) {
  const json& initial = maneuver.at("initial_attitude");
  const Vector4d final = attitude_of(maneuver.at("final_attitude"));
  if (final == Vector4d::UnitX())
    if (const auto given = mrp_as_given(initial)) return *given;
  return mrp(euler_parameter_product<double>(euler_parameter_conjugate(final), attitude_of(initial)));
}

Matrix3d influence_of_couples(const json& actuator, std::optional<Matrix3d>& net_force_N) {
  if (const auto given = actuator.find("influence_N_m"); given != actuator.end()) return matrix_of(*given);
  Matrix3d influence = Matrix3d::Zero(), force = Matrix3d::Zero();
  for (const json& thruster : actuator.at("thrusters")) {
    const Vector3d one = thruster.at("sign").get<double>() * thruster.at("thrust_N").get<double>() *
                         vector_of(thruster.at("direction")).stableNormalized();
    const Eigen::Index couple = thruster.at("couple").get<Eigen::Index>() - 1;
    influence.col(couple) += vector_of(thruster.at("position_m")).cross(one);
    force.col(couple) += one;
  }
  net_force_N = force;
  return influence;
}

Thruster specify_thruster(const json& thruster, const json& set) {
  const auto whose = [&](const char* name) -> const json& {
    return thruster.contains(name) ? thruster : set;
  };
  Thruster spec;
  spec.position_m = vector_of(thruster.at("position_m"));
  spec.direction = vector_of(thruster.at("direction")).stableNormalized();
  spec.thrust_N = whose("thrust_N").at("thrust_N");
  spec.misalignment_rad = radians(whose("misalignment_deg").at("misalignment_deg"));
  if (const auto from_s = optional_number(thruster, "stuck_open_from_s")) spec.stuck_open_from_s = *from_s;
  if (const auto from_s = optional_number(thruster, "stuck_closed_from_s"))
    spec.stuck_closed_from_s = *from_s;
  specify_valve(thruster, set, spec);
  return spec;
}

AttitudeSpecification specify_attitude(const json& request) {
  AttitudeSpecification spec;
  spec.plant = specify_plant(request.at("plant"));
  spec.disturbances = specify_disturbances(request.at("disturbances"));
  const json& maneuver = request.at("maneuver");
  spec.maneuver.initial_mrp = initial_mrp_of(maneuver);
  spec.maneuver.initial_rate_rad_s = radians_of(maneuver.at("initial_rate_deg_s"));
  spec.maneuver.final_attitude = attitude_of(maneuver.at("final_attitude"));
  for (const char* end : {"initial_attitude", "final_attitude"})
    if (maneuver.at(end).at("type") == "euler_123") spec.maneuver.tells_euler_angles = true;
  spec.maneuver.reference = specify_reference(maneuver.at("reference"));
  specify_law(request.at("controller"), request.at("estimator"), spec);
  spec.sensor = specify_sensor(request.at("sensors"));
  spec.actuator = specify_actuator(request.at("actuator"));
  spec.settling = specify_settling(request.at("metrics").at("settling"));
  const json& simulation = request.at("simulation");
  spec.duration_s = simulation.at("duration_s");
  spec.relative_tolerance = simulation.at("relative_tolerance");
  spec.verification_tolerance = simulation.at("verification_relative_tolerance");
  spec.seed = simulation.at("seed");
  spec.telemetry_period_s = request.at("telemetry").at("sample_period_s");
  spec.output_times_s = request.at("outputs").at("at_s").get<std::vector<double>>();
  std::sort(spec.output_times_s.begin(), spec.output_times_s.end());
  return spec;
}

namespace {

// Of the pulses of a channel, at the demand between dead band and saturation at which they come fastest; 0
// without.
double switchings_per_s(const AttitudeSpecification& spec) {
  double most = 0;
  const auto add = [&](const Modulator& modulator, double level) {
    const auto* pwpf = std::get_if<PwpfModulator>(&modulator);
    if (!pwpf) return;
    const PwpfFigures of = figures(*pwpf, level);
    const double demand = 0.5 * (of.dead_band + std::min(of.saturation, std::max(level, 2 * of.dead_band)));
    most = std::max(most, 2 / steady_pulses(*pwpf, level, demand).period_s());
  };
  if (const auto* pairs = std::get_if<AxisThrusters>(&spec.actuator))
    for (const double level : pairs->torque_N_m) add(pairs->modulator, level);
  if (const auto* mounted = std::get_if<MountedThrusters>(&spec.actuator))
    for (const Thruster& thruster : mounted->thrusters) add(mounted->modulator, thruster.thrust_N);
  return most;
}

}  // namespace

std::optional<Violation> why_it_cannot_be_built(const AttitudeSpecification& spec) {
  const double most_per_s = limits().max_steps / spec.duration_s;
  const auto too_fast = [&](double per_s, const char* pointer, const char* what) -> std::optional<Violation> {
    if (per_s <= most_per_s) return std::nullopt;
    return Violation{pointer, std::string("the run would take too many steps: ") + what,
                     number(per_s) + " 1/s", "at most " + number(most_per_s) + " 1/s for this duration"};
  };
  double frequency_rad_s = 0;
  for (const BodySinusoid& one : spec.disturbances.sinusoids)
    frequency_rad_s = std::max(frequency_rad_s, one.frequency_rad_s);
  if (auto violation = too_fast(frequency_rad_s, "/disturbances", "a disturbance is too fast"))
    return violation;
  if (const auto* moving = std::get_if<MrpSinusoids>(&spec.maneuver.reference.shape))
    if (auto violation =
            too_fast(moving->frequency_rad_s.maxCoeff(), "/maneuver/reference", "the reference is too fast"))
      return violation;
  if (spec.sample_period_s) return std::nullopt;
  if (spec.observer)
    if (auto violation =
            too_fast(spec.observer->pole_rad_s, "/estimator/pole_rad_s", "the observer is too fast"))
      return violation;
  return too_fast(switchings_per_s(spec), "/actuator/modulator", "the modulator switches too often");
}

std::vector<std::string> warnings_about(const AttitudeSpecification& spec) {
  std::vector<std::string> warnings;
  const auto* ideal = std::get_if<IdealTorque>(&spec.actuator);
  if (spec.observer && spec.observer->feeding == ObserverFeeding::commanded &&
      !(ideal && !ideal->maximum_N_m))
    warnings.push_back(
        "the observer is fed what is commanded, of which the actuator may give less: it winds up (Kim & "
        "Crassidis "
        "1998, Eq. 35 as printed is for unlimited torque; estimator.feeding \"applied_minus_equivalent\" is "
        "sound)");
  return warnings;
}

}  // namespace slew
