// What a requested system in three axes is, from closed forms: no flight.
#include <Eigen/Eigenvalues>
#include <nlohmann/json.hpp>

#include "server/experiment/description.hpp"
#include "server/experiment/law_fields.hpp"

namespace slew {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using nlohmann::json;

json numbers(const Vector3d& values) {
  return {values[0], values[1], values[2]};
}

json law_document(const AttitudeLaw& law) {
  LawWriter writer;
  AttitudeLaw copy = law;
  std::visit([&](auto& one) { one.fields(writer); }, copy);
  json document = writer.document();
  document["type"] = type_name(law);
  return document;
}

}  // namespace

json rigid_body_document(const RigidBodyPlant& plant) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(plant.inertia_kg_m2);
  json axes = json::array();
  for (Eigen::Index i = 0; i < 3; ++i) axes.push_back(numbers(solver.eigenvectors().col(i)));
  return {{"type", "rigid_body"},
          {"inertia_kg_m2", rows_of(plant.inertia_kg_m2)},
          {"principal_moments_kg_m2", numbers(solver.eigenvalues())},
          {"principal_axes", std::move(axes)}};
}

json system_document(const AttitudeSpecification& spec) {
  return {{"plant", rigid_body_document(spec.plant)}, {"law", law_document(spec.law)}};
}

json design_document(const AttitudeSpecification&) {
  return nullptr;
}

}  // namespace slew
