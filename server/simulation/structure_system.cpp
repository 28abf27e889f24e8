#include "server/simulation/structure_system.hpp"

#include <stdexcept>
#include <string>

namespace slew {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Of the largest displacement of a mode: below, its sensors' signal is rounding.
constexpr double kUnseen = 1e-9;

/// What `make` gives; what it throws, as a fault of this part.
template <typename Make>
auto part_of(StructurePart part, const Make& make) {
  try {
    return make();
  } catch (const StructureFault&) {
    throw;
  } catch (const std::logic_error& error) {  // domain_error and invalid_argument
    throw StructureFault(part, error.what());
  } catch (const std::runtime_error& error) {  // SUNDIALS'
    throw StructureFault(part, error.what());
  }
}

std::vector<Impulse> impulses_for(const StructureGuidance& guidance, const ReducedStructure& design,
                                  double alpha_1_s, double beta_s) {
  if (!guidance.shaper.is_there()) return {};
  std::vector<VibratingMode> modes;
  for (const double frequency : free_modes(design).frequency_rad_s)
    modes.push_back({frequency, damping_ratio(alpha_1_s, beta_s, frequency)});
  return impulses_of(guidance.shaper, modes);
}

SineSquaredSlew command_of(const StructureSpecification& spec, const SlewingStructure& structure,
                           const ReducedStructure& design) {
  const double inertia = spec.axis.normalized().dot(structure.tangential_load.segment<3>(3));
  return SineSquaredSlew({.torque_N_m = spec.guidance.torque_N_m,
                          .pulse_rad_s = spec.guidance.pulse_rad_s,
                          .inertia_kg_m2 = inertia,
                          .angle_rad = spec.guidance.angle_rad},
                         impulses_for(spec.guidance, design, spec.alpha_1_s, spec.beta_s));
}

/// Every mode that the filter estimates must show in what is measured.
void check_observability(const ReducedStructure& design, const MatrixXd& output) {
  const FreeModes free = free_modes(design);
  const Index n = design.elastic();
  for (Index mode = 0; mode < n; ++mode) {
    const auto shape = free.shapes.col(mode);
    const double seen = (output.leftCols(n) * shape).norm() + (output.rightCols(n) * shape).norm();
    const double most =
        (design.basis.bottomRightCorner(design.basis.rows() - 6, n) * shape).cwiseAbs().maxCoeff();
    if (!(seen > kUnseen * most))
      throw std::domain_error("the sensors do not see mode " + std::to_string(mode + 1) +
                              " of the design model, at " + std::to_string(free.frequency_rad_s[mode]) +
                              " rad/s");
  }
}

StructureController controller_of(const StructureSpecification& spec, const SlewingStructure& structure,
                                  const ReducedStructure& design) {
  const StructureControl& control = *spec.control;
  const StructureDynamics dynamics = structure_dynamics(design, spec.alpha_1_s, spec.beta_s,
                                                        actuator_loads(spec, structure), ZeroOrderLoads::all);
  const Index n = design.elastic();
  if (control.tracked_modes > n)
    throw StructureFault(StructurePart::tracking,
                         "the design model has only " + std::to_string(n) + " modes to track");
  const MatrixXd rows = sensor_rows(spec, structure, design);
  MatrixXd output(rows.rows(), 2 * n);
  output << rows.middleCols(6, n), rows.rightCols(n);
  part_of(StructurePart::sensors, [&] { return check_observability(design, output); });
  ElasticTracking tracking = elastic_tracking(design, spec.alpha_1_s, spec.beta_s, control.tracked_modes,
                                              control.tracking_scale, control.rigid_reference);
  ElasticFilter filter = elastic_filter(dynamics, output, control.intensities);
  part_of(StructurePart::filter, [&] { return check_filter_work(filter, spec.duration_s); });
  TrackingLaw law = part_of(StructurePart::surface, [&] {
    return tracking_law(design, dynamics, tracking.shapes, output, control.gains);
  });
  MatrixXd known = MatrixXd::Zero(2 * n, 2);
  if (control.filter_knows_loads)
    known.bottomRows(n) << -dynamics.tangential_load.tail(n), -dynamics.centrifugal_load.tail(n);
  MatrixXd input = MatrixXd::Zero(2 * n, dynamics.inputs());
  input.bottomRows(n) = dynamics.input.bottomRows(n);
  auto gains = part_of(StructurePart::filter, [&] {
    return std::make_shared<const GainSchedule>(filter, spec.duration_s, spec.relative_tolerance);
  });
  return {std::move(tracking), std::move(filter), std::move(law),
          std::move(gains),    std::move(known),  std::move(input)};
}

}  // namespace

StructureElements structure_elements(const StructureSpecification& spec) {
  AssembledFrame frame = assemble(spec.frame);
  SlewingStructure structure = slewing_structure(frame, spec.axis);
  return {std::move(frame), std::move(structure)};
}

MatrixXd elastic_basis(const StructureElements& elements, const ElasticReduction& reduction) {
  const auto& [frame, structure] = elements;
  if (const auto* clamped = std::get_if<ClampedModes>(&reduction))
    return clamped_basis(frame, structure, clamped->count);
  if (const auto* free = std::get_if<HubFreeModes>(&reduction))
    return free_basis(frame, structure, free->count);
  if (const auto* krylov = std::get_if<KrylovVectors>(&reduction)) {
    MatrixXd loads(structure.size(), static_cast<Index>(krylov->loads.size()));
    for (std::size_t i = 0; i < krylov->loads.size(); ++i)
      loads.col(static_cast<Index>(i)) = structure.absolute(krylov->loads[i].coordinate());
    return krylov_basis(structure, loads, krylov->shifts_rad_s);
  }
  return clamped_basis(frame, structure);
}

MatrixXd actuator_loads(const StructureSpecification& spec, const SlewingStructure& structure) {
  std::size_t count = 0;
  for (const ActuatorGroup& group : spec.actuators) count += group.motions.size();
  MatrixXd loads(structure.size(), static_cast<Index>(count));
  Index column = 0;
  for (const ActuatorGroup& group : spec.actuators)
    for (const NodeMotion& motion : group.motions)
      loads.col(column++) = structure.absolute(motion.coordinate());
  return loads;
}

MatrixXd sensor_rows(const StructureSpecification& spec, const SlewingStructure& structure,
                     const ReducedStructure& reduced) {
  const Index n = reduced.size();
  std::size_t count = 0;
  for (const SensorGroup& group : spec.sensors)
    count += group.motions.size() *
             (static_cast<std::size_t>(group.sees_displacement) + static_cast<std::size_t>(group.sees_rate));
  MatrixXd rows = MatrixXd::Zero(static_cast<Index>(count), 2 * n);
  Index row = 0;
  for (const bool is_rate : {false, true})
    for (const SensorGroup& group : spec.sensors)
      for (const NodeMotion& motion : group.motions)
        if (is_rate ? group.sees_rate : group.sees_displacement)
          rows.row(row++).segment(is_rate ? n : 0, n) =
              structure.relative(motion.coordinate()).transpose() * reduced.basis;
  return rows;
}

std::shared_ptr<const StructureSystem> build_structure_system(const StructureSpecification& spec) {
  StructureElements elements = part_of(StructurePart::frame, [&] { return structure_elements(spec); });
  const SlewingStructure& structure = elements.structure;
  ReducedStructure plant =
      part_of(StructurePart::plant, [&] { return reduce(structure, elastic_basis(elements, spec.plant)); });
  ReducedStructure design = !spec.control ? plant : part_of(StructurePart::design, [&] {
    return reduce(structure, elastic_basis(elements, spec.control->design));
  });
  StructureDynamics dynamics = structure_dynamics(plant, spec.alpha_1_s, spec.beta_s,
                                                  actuator_loads(spec, structure), spec.guidance.loads);
  SineSquaredSlew command =
      part_of(StructurePart::command, [&] { return command_of(spec, structure, design); });
  MatrixXd antenna(3, plant.size());
  for (std::size_t i = 0; i < 3; ++i)
    antenna.row(static_cast<Index>(i)) =
        structure.relative(NodeMotion{spec.antenna_node, 3 + i}.coordinate()).transpose() * plant.basis;
  MatrixXd sensors = sensor_rows(spec, structure, plant);
  std::optional<StructureController> controller;
  if (spec.control) controller = controller_of(spec, structure, design);
  return std::make_shared<const StructureSystem>(
      StructureSystem{std::move(elements), std::move(plant), std::move(design), std::move(dynamics),
                      std::move(command), std::move(antenna), std::move(sensors), std::move(controller)});
}

std::shared_ptr<const StructureSystem> with_command(const StructureSystem& system,
                                                    const StructureSpecification& spec) {
  auto out = std::make_shared<StructureSystem>(system);
  out->command = part_of(StructurePart::command,
                         [&] { return command_of(spec, system.elements.structure, system.design); });
  return out;
}

}  // namespace slew
