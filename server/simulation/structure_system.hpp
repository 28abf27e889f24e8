// What follows from a specification before anything flies: finite elements, reductions, dynamics, command,
// tracking model, surface and filter. Immutable; runs share it.
#pragma once

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "server/propagation/gain_schedule.hpp"
#include "server/simulation/structure.hpp"

namespace slew {

/// Why something does not exist, and of which part of the specification that is.
enum class StructurePart { frame, plant, design, command, sensors, tracking, surface, filter };
struct StructureFault : std::domain_error {
  StructurePart part;
  StructureFault(StructurePart of, const std::string& sentence) : std::domain_error(sentence), part(of) {}
};

/// Each step of what is derived, so that its cost can be told apart.
struct StructureElements {
  AssembledFrame frame;
  SlewingStructure structure;
};
StructureElements structure_elements(const StructureSpecification& specification);

/// Throws std::domain_error or std::invalid_argument with a sentence.
Eigen::MatrixXd elastic_basis(const StructureElements& elements, const ElasticReduction& reduction);

struct StructureController {
  ElasticTracking tracking;
  ElasticFilter filter;
  TrackingLaw law;
  std::shared_ptr<const GainSchedule> gains;
  /// What the filter knows of the slew: columns for theta'' and theta'^2.
  Eigen::MatrixXd known_loads;
  /// The filter's B.
  Eigen::MatrixXd input;
};

struct StructureSystem {
  StructureElements elements;
  ReducedStructure plant;
  ReducedStructure design;  ///< the plant's where there is no controller
  StructureDynamics plant_dynamics;
  SineSquaredSlew command;
  Eigen::MatrixXd antenna;  ///< rotation of the antenna's node relative to the hub, of z; 3 rows
  Eigen::MatrixXd sensors;  ///< of [z; z'] of the plant
  std::optional<StructureController> controller;

  Eigen::Index tracked() const { return controller ? controller->tracking.modes() : 0; }
  Eigen::Index filtered() const { return controller ? controller->filter.size() : 0; }
};

/// Generalized loads of the actuators over x.
Eigen::MatrixXd actuator_loads(const StructureSpecification& specification,
                               const SlewingStructure& structure);

/// Displacements, then rates, that the sensors see of [z; z'].
Eigen::MatrixXd sensor_rows(const StructureSpecification& specification, const SlewingStructure& structure,
                            const ReducedStructure& reduced);

/// Throws StructureFault.
std::shared_ptr<const StructureSystem> build_structure_system(const StructureSpecification& specification);

/// The same under another command; all that it shares with the specification must be as it was built.
std::shared_ptr<const StructureSystem> with_command(const StructureSystem& system,
                                                    const StructureSpecification& specification);

}  // namespace slew
