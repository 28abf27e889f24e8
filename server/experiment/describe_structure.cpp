// What a requested flexible structure is, and what is designed for it: no flight.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/experiment/description.hpp"
#include "server/experiment/law_fields.hpp"
#include "server/experiment/shaper_request.hpp"
#include "server/experiment/structure_request.hpp"
#include "server/simulation/structure_system.hpp"
#include "server/structure/mass_properties.hpp"

namespace slew {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using nlohmann::json;

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr Index kMostFrequencies = 30;  ///< of the whole structure

json numbers(const Eigen::VectorXd& values) {
  return std::vector<double>(values.begin(), values.end());
}

json matrix_document(const MatrixXd& matrix) {
  json rows = json::array();
  for (Index i = 0; i < matrix.rows(); ++i) rows.push_back(numbers(matrix.row(i).transpose()));
  return rows;
}

/// [real, imaginary], the slowest last.
json eigenvalues_document(const Eigen::VectorXcd& values) {
  std::vector<std::complex<double>> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return a.real() != b.real() ? a.real() < b.real() : a.imag() < b.imag();
  });
  json list = json::array();
  for (const auto& value : sorted) list.push_back({value.real(), value.imag()});
  return list;
}

const char* name_of(const ElasticReduction& reduction) {
  if (std::holds_alternative<ClampedModes>(reduction)) return "clamped_modes";
  if (std::holds_alternative<HubFreeModes>(reduction)) return "free_modes";
  if (std::holds_alternative<KrylovVectors>(reduction)) return "krylov_vectors";
  return "all_modes";
}

json damping_document(const StructureSpecification& spec, const Eigen::VectorXd& frequency_rad_s) {
  json ratios = json::array();
  for (const double w : frequency_rad_s) ratios.push_back(damping_ratio(spec.alpha_1_s, spec.beta_s, w));
  return ratios;
}

json command_document(const StructureSpecification& spec) {
  const SineSquaredSlew& command = spec.system->command;
  const SineSquaredPulses& pulses = command.pulses();
  return {{"inertia_kg_m2", pulses.inertia_kg_m2},
          {"coast_rate_deg_s", pulses.coast_rate_rad_s() * kDegPerRad},
          {"pulse_s", pulses.pulse_s()},
          {"stop_pulse_s", pulses.stop_s()},
          {"coast_s", pulses.stop_s() - pulses.pulse_s()},
          {"unshaped_end_s", pulses.end_s()},
          {"impulses", impulses_document(command.impulses())},
          {"arrival_s", command.arrival_s()}};
}

json controller_document(const StructureSpecification& spec) {
  if (!spec.system->controller) return nullptr;
  const StructureController& controller = *spec.system->controller;
  return {{"type", "tracking_sliding_mode"},
          {"states", 2 * spec.system->design.size()},
          {"inputs", controller.law.inputs()},
          {"sensors", controller.filter.sensors()},
          {"tracked_frequencies_rad_s", numbers(controller.tracking.frequency_rad_s)},
          {"tracked_damping_ratios", numbers(controller.tracking.damping_ratio)},
          {"sliding_eigenvalues_rad_s", eigenvalues_document(controller.law.sliding_eigenvalues)},
          {"filter_eigenvalues_rad_s", eigenvalues_document(steady_filter(controller.filter).eigenvalues())}};
}

json reduced_document(const StructureSpecification& spec, const ElasticReduction& reduction,
                      const ReducedStructure& structure) {
  const FreeModes modes = free_modes(structure);
  return {{"type", name_of(reduction)},
          {"degrees_of_freedom", structure.size()},
          {"free_frequencies_rad_s", numbers(modes.frequency_rad_s)},
          {"damping_ratios", damping_document(spec, modes.frequency_rad_s)}};
}

/// The three models between which responses are compared, and their loads.
struct Compared {
  MatrixXd whole, plant, design;  ///< loads over their coordinates
};

Compared loads_of(const StructureSpecification& spec) {
  const StructureSystem& system = *spec.system;
  const std::vector<NodeMotion> motions = response_motions(spec);
  Compared out;
  out.whole = MatrixXd(system.elements.structure.size(), static_cast<Index>(motions.size()));
  for (std::size_t i = 0; i < motions.size(); ++i)
    out.whole.col(static_cast<Index>(i)) = system.elements.structure.absolute(motions[i].coordinate());
  out.plant = system.plant.basis.transpose() * out.whole;
  out.design = system.design.basis.transpose() * out.whole;
  return out;
}

json motions_document(const std::vector<NodeMotion>& motions) {
  static constexpr const char* kNames[] = {"ux", "uy", "uz", "rx", "ry", "rz"};
  json list = json::array();
  for (const NodeMotion& motion : motions)
    list.push_back({{"node", motion.node}, {"motion", kNames[motion.motion]}});
  return list;
}

/// |a - b| over |b|.
double error_of(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b) {
  return (a - b).norm() / b.norm();
}

json responses_document(const StructureSpecification& spec, const json& frequencies_rad_s) {
  const StructureSystem& system = *spec.system;
  const Compared loads = loads_of(spec);
  json list = json::array();
  for (const json& frequency : frequencies_rad_s) {
    const double w = frequency;
    const auto of = [&](const auto& model, const MatrixXd& at, bool is_damped) {
      return receptance(model.mass, model.stiffness, is_damped ? spec.alpha_1_s : 0,
                        is_damped ? spec.beta_s : 0, at, at, w);
    };
    const Eigen::MatrixXcd whole = of(system.elements.structure, loads.whole, false),
                           damped = of(system.elements.structure, loads.whole, true);
    list.push_back({{"frequency_rad_s", w},
                    {"whole_m_N", matrix_document(whole.real())},
                    {"plant_m_N", matrix_document(of(system.plant, loads.plant, false).real())},
                    {"plant_error", error_of(of(system.plant, loads.plant, false), whole)},
                    {"plant_error_damped", error_of(of(system.plant, loads.plant, true), damped)},
                    {"design_error", error_of(of(system.design, loads.design, false), whole)},
                    {"design_error_damped", error_of(of(system.design, loads.design, true), damped)}});
  }
  return {{"between", motions_document(response_motions(spec))}, {"at", std::move(list)}};
}

/// Of the reduced model's frequencies against as many of the whole structure's.
json frequency_errors(const ReducedStructure& reduced, const Eigen::VectorXd& whole_rad_s) {
  const Eigen::VectorXd own = free_modes(reduced).frequency_rad_s;
  json errors = json::array();
  for (Index i = 0; i < std::min(own.size(), whole_rad_s.size()); ++i)
    errors.push_back(own[i] / whole_rad_s[i] - 1);
  return errors;
}

json slew_document(const StructureSpecification& spec, const json& times_s) {
  json list = json::array();
  for (const json& time : times_s) {
    const SlewState slew = spec.system->command.at(time);
    const Eigen::Matrix<double, 6, 1> loads =
        zero_order_loads(spec.system->elements.structure, slew.acceleration_rad_s2, slew.rate_rad_s);
    list.push_back({{"t_s", time},
                    {"angle_deg", slew.angle_rad * kDegPerRad},
                    {"rate_deg_s", slew.rate_rad_s * kDegPerRad},
                    {"acceleration_deg_s2", slew.acceleration_rad_s2 * kDegPerRad},
                    {"force_N", numbers(loads.head<3>())},
                    {"moment_N_m", numbers(loads.tail<3>())}});
  }
  return list;
}

json mass_document(const StructureSpecification& spec) {
  const MassProperties mass = mass_properties(spec.system->elements.frame);
  return {{"mass_kg", mass.mass_kg},
          {"first_moment_kg_m", numbers(mass.first_moment_kg_m)},
          {"centre_m", numbers(mass.centre_m)},
          {"inertia_about_origin_kg_m2", rows_of(mass.inertia_about_origin_kg_m2)},
          {"inertia_about_centre_kg_m2", rows_of(mass.inertia_about_centre_kg_m2)}};
}

}  // namespace

json structure_model(const StructureSpecification& spec, const json& outputs) {
  const StructureSystem& system = *spec.system;
  const SlewingStructure& structure = system.elements.structure;
  const ReducedStructure every = reduce(structure, clamped_basis(system.elements.frame, structure));
  const Eigen::VectorXd whole = free_modes(every).frequency_rad_s;
  const Index elastic = structure.size() - 6;
  json plant = mass_document(spec);
  plant["type"] = "flexible_structure";
  plant["axis"] = numbers(structure.axis);
  plant["inertia_about_axis_kg_m2"] = system.command.pulses().inertia_kg_m2;
  plant["degrees_of_freedom"] = structure.size();
  plant["rigid_modes"] = 6;
  plant["free_frequencies_rad_s"] = numbers(whole.head(std::min(whole.size(), kMostFrequencies)));
  plant["clamped_frequencies_rad_s"] = numbers(every.stiffness.diagonal()
                                                   .tail(every.elastic())
                                                   .cwiseSqrt()
                                                   .head(std::min(every.elastic(), kMostFrequencies)));
  return {{"plant", std::move(plant)},
          {"maneuvering",
           {{"gyroscopic_norm", structure.gyroscopic.norm()},
            {"tangential_norm", structure.tangential.norm()},
            {"centrifugal_norm", structure.centrifugal.norm()},
            {"tangential_load_norm", structure.tangential_load.tail(elastic).norm()},
            {"centrifugal_load_norm", structure.centrifugal_load.tail(elastic).norm()}}},
          {"flown", reduced_document(spec, spec.plant, system.plant)},
          {"design_model",
           spec.control ? reduced_document(spec, spec.control->design, system.design) : json(nullptr)},
          {"frequency_errors",
           {{"flown", frequency_errors(system.plant, whole)},
            {"design", frequency_errors(system.design, whole)}}},
          {"responses", responses_document(spec, outputs.at("responses_at_rad_s"))},
          {"command", command_document(spec)},
          {"controller", controller_document(spec)},
          {"slew", slew_document(spec, outputs.at("at_s"))}};
}

json system_document(const StructureSpecification& spec) {
  json plant = mass_document(spec);
  plant["type"] = "flexible_structure";
  plant["degrees_of_freedom"] = spec.system->elements.structure.size();
  return {{"plant", std::move(plant)},
          {"flown", reduced_document(spec, spec.plant, spec.system->plant)},
          {"design_model",
           spec.control ? reduced_document(spec, spec.control->design, spec.system->design) : json(nullptr)},
          {"command", command_document(spec)},
          {"law", controller_document(spec)},
          {"size",
           {{"most_boundaries", std::ceil(10 * spec.duration_s)},
            {"states", 2 * spec.system->plant.size() + 2 * spec.system->tracked() + spec.system->filtered()},
            {"most_telemetry_samples", std::floor(spec.duration_s / spec.telemetry_period_s) + 2}}}};
}

// Damped receptances of the whole structure and of what flies and is designed on: their norms.
json design_document(const StructureSpecification& spec) {
  constexpr int kPoints = 200;
  const StructureSystem& system = *spec.system;
  const Compared loads = loads_of(spec);
  const Eigen::VectorXd own = free_modes(system.plant).frequency_rad_s;
  const double from = 0.3 * own[0], to = 3 * own[std::min<Index>(own.size(), 8) - 1];
  json curve = json::array();
  for (int i = 0; i <= kPoints; ++i) {
    const double w = from * std::pow(to / from, static_cast<double>(i) / kPoints);
    const auto size = [&](const auto& model, const MatrixXd& at) {
      return receptance(model.mass, model.stiffness, spec.alpha_1_s, spec.beta_s, at, at, w).norm();
    };
    curve.push_back({{"frequency_rad_s", w},
                     {"whole_m_N", size(system.elements.structure, loads.whole)},
                     {"flown_m_N", size(system.plant, loads.plant)},
                     {"design_m_N", size(system.design, loads.design)}});
  }
  return {{"type", "structure"}, {"has_design", spec.control.has_value()}, {"curve", std::move(curve)}};
}

}  // namespace slew
