// What the plant of a request is made of: mass properties, modes and their couplings to the hub.
#include <numbers>

#include "server/experiment/description.hpp"
#include "server/experiment/experiment.hpp"
#include "server/experiment/frame_request.hpp"
#include "server/experiment/law_fields.hpp"
#include "server/propagation/modal_basis.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr double kRadPerCycle = 2 * std::numbers::pi;

json numbers(const Eigen::VectorXd& values) {
  return std::vector<double>(values.begin(), values.end());
}

// structure_model tells it.
json flown(const ElasticReduction&) {
  return nullptr;
}

json flown(const RigidBodyPlant& plant) {
  return rigid_body_document(plant);
}

// As it flies: only the modes that are kept.
json flown(const SingleAxisPlant& plant) {
  json clamped = json::array(), ratios = json::array(), couplings = json::array(), free = json::array();
  for (const ElasticMode& mode : plant.modes) {
    clamped.push_back(mode.frequency_rad_s / kRadPerCycle);
    ratios.push_back(mode.damping);
    couplings.push_back(mode.coupling_sqrt_kg_m);
  }
  const ModalBasis basis(plant);
  for (const double w : basis.free_frequencies_rad_s()) free.push_back(w / kRadPerCycle);
  const double residual = residual_inertia_kg_m2(plant);
  return {{"inertia_kg_m2", plant.inertia_kg_m2},  {"modal_inertia_kg_m2", plant.inertia_kg_m2 - residual},
          {"residual_inertia_kg_m2", residual},    {"clamped_frequencies_hz", std::move(clamped)},
          {"damping_ratios", std::move(ratios)},   {"couplings_sqrt_kg_m", std::move(couplings)},
          {"free_frequencies_hz", std::move(free)}};
}

// The frame as it is, all its modes included; inertia_kg_m2 is its own, about the hub's axis.
json whole_frame(const json& plant, const DerivedFrame& frame) {
  const MassProperties mass = mass_properties(frame.assembled);
  const auto kept = plant.at("modes_kept").get<Eigen::Index>();
  const Eigen::VectorXd clamped_hz = frame.clamped.frequency_rad_s / kRadPerCycle;
  return {{"coordinates", frame.assembled.mass.rows()},
          {"moving_coordinates", frame.assembled.moving(FrameBoundary::kClamped).size()},
          {"mass_kg", mass.mass_kg},
          {"centre_m", numbers(mass.centre_m)},
          {"inertia_about_origin_kg_m2", rows_of(mass.inertia_about_origin_kg_m2)},
          {"inertia_about_centre_kg_m2", rows_of(mass.inertia_about_centre_kg_m2)},
          {"axis", numbers(hub_axis(plant))},
          {"inertia_kg_m2", frame.coupling.inertia_kg_m2},
          {"modal_inertia_kg_m2", frame.coupling.modal_inertia_kg_m2},
          {"carried_by_hub_kg_m2", frame.coupling.carried_by_hub_kg_m2},
          {"modes", frame.clamped.size()},
          {"first_left_out_hz", kept < clamped_hz.size() ? json(clamped_hz(kept)) : json(nullptr)},
          {"clamped_frequencies_hz", numbers(clamped_hz)},
          {"couplings_sqrt_kg_m", numbers(frame.coupling.coupling_sqrt_kg_m.cwiseAbs())}};
}

}  // namespace

json model(const Prepared& prepared) {
  json request = json::parse(prepared.resolved);
  if (const auto* structure = std::get_if<StructureSpecification>(&prepared.system)) {
    json document = structure_model(*structure, request.at("outputs"));
    document["frame"] = nullptr;
    document["warnings"] = prepared.warnings;
    document["request"] = std::move(request);
    return document;
  }
  const json& requested = request.at("plant");
  json plant = std::visit([](const auto&spec) { return flown(spec.plant); }, prepared.system), frame;
  plant["type"] = requested.at("type");
  if (is_frame(requested)) {
    const DerivedFrame derived = derive_frame(requested);
    plant["hub_inertia_kg_m2"] = derived.hub_inertia_kg_m2;
    frame = whole_frame(requested, derived);
  }
  return {{"plant", std::move(plant)},
          {"frame", std::move(frame)},
          {"warnings", prepared.warnings},
          {"request", std::move(request)}};
}

}  // namespace slew
