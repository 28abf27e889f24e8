// What a requested system in three axes is, from closed forms: no flight.
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "server/actuator/thruster_allocation.hpp"
#include "server/experiment/describe_modulator.hpp"
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

// What the law asks for at the maneuver's initial state.
json point_document(const AttitudeSpecification& spec) {
  const Vector3d &p = spec.maneuver.initial_mrp, &w = spec.maneuver.initial_rate_rad_s;
  const auto asked = command<double>(spec.law, {p, w, spec.maneuver.reference.at(0), 0, 0});
  json document = {{"mrp", numbers(p)},
                   {"rate_rad_s", numbers(w)},
                   {"mrp_rate_1_s", numbers(mrp_rate<double>(p, w))},
                   {"torque_N_m", numbers(asked.torque_N_m)}};
  if (const auto q =
          euler_parameter_product<double>(spec.maneuver.final_attitude, euler_parameters<double>(p));
      !spec.plant.is_free())
    document["external_moment_N_m"] =
        numbers(pedestal_moment<double>(spec.plant.weight, spec.plant.springs, q));
  if (!has_surface(spec.law)) return document;
  document["surface_rad_s"] = numbers(asked.surface_rad_s);
  document["equivalent_N_m"] = numbers(asked.equivalent_N_m);
  document["correction_N_m"] = numbers(asked.torque_N_m - asked.equivalent_N_m);
  if (const auto* law = std::get_if<SlidingMode>(&spec.law)) {
    document["manifold_rad_s"] = numbers(w - asked.surface_rad_s);
    if (spec.maneuver.reference.is_fixed())
      document["manifold_gradient_rad_s"] = rows_of(manifold_gradient(*law, p));
  }
  return document;
}

// About each axis, of all that disturbs.
Vector3d largest_disturbance_N_m(const BodyDisturbances& disturbances) {
  Vector3d sum = disturbances.constant_N_m, most = sum.cwiseAbs();
  for (const BodyStepDisturbance& step : disturbances.steps) {
    sum += step.torque_N_m;
    most = most.cwiseMax(sum.cwiseAbs());
  }
  for (const BodySinusoid& sinusoid : disturbances.sinusoids) most += sinusoid.amplitude_N_m.cwiseAbs();
  return most;
}

// |s| <= epsilon (J^ K)^-1 |w|max, axis by axis (Kim & Crassidis 1998, Eq. 20, whose bars stand around a
// matrix).
json surface_bound(const AttitudeSpecification& spec) {
  const auto* law = std::get_if<SlidingMode>(&spec.law);
  if (!law) return nullptr;
  const Matrix3d stiffness = law->inertia_kg_m2 * law->gain_rad_s2.asDiagonal();
  return numbers(law->boundary_layer_rad_s * stiffness.inverse().cwiseAbs() *
                 largest_disturbance_N_m(spec.disturbances));
}

// For 1, t and t^2: K0 of each axis, K1 = l J^ (Kim & Crassidis 1998, Eqs. 34 and 46).
json observer_document(const std::optional<DisturbanceObserver>& observer) {
  if (!observer) return nullptr;
  const auto gains = observer_gains(observer->pole_rad_s);
  json k0 = json::array(), k1 = json::array();
  for (const double gain : gains) {
    k0.push_back(-gain);
    k1.push_back(rows_of(gain * observer->inertia_kg_m2));
  }
  const char* feeding = observer->feeding == ObserverFeeding::commanded       ? "commanded"
                        : observer->feeding == ObserverFeeding::applied_total ? "applied_total"
                                                                              : "applied_minus_equivalent";
  return {{"type", "disturbance_observer"},
          {"pole_rad_s", observer->pole_rad_s},
          {"feeding", feeding},
          {"inertia_kg_m2", rows_of(observer->inertia_kg_m2)},
          {"K0", std::move(k0)},
          {"K1", std::move(k1)},
          {"characteristic_polynomial", {1.0, gains[0], gains[1], gains[2]}}};
}

constexpr const char* kDirections[] = {"+x", "-x", "+y", "-y", "+z", "-z"};

Vector3d direction(std::size_t i) {
  return (i % 2 == 0 ? 1 : -1) * Vector3d::Unit(static_cast<Eigen::Index>(i / 2));
}

json actuator_document(const IdealTorque& ideal, const AttitudeSpecification&) {
  json document = {{"type", "ideal_torque"}};
  for (std::size_t i = 0; i < 6; ++i)
    document["most_torque_N_m"][kDirections[i]] =
        ideal.maximum_N_m ? json((*ideal.maximum_N_m)[static_cast<Eigen::Index>(i / 2)]) : json(nullptr);
  return document;
}

json actuator_document(const AxisThrusters& pairs, const AttitudeSpecification& spec) {
  const bool are_couples = !pairs.axes.isIdentity(0) || pairs.net_force_N;
  json document = {{"type", are_couples ? "thruster_couples" : "axis_thrusters"}};
  if (are_couples) document["influence_N_m"] = rows_of(pairs.axes * pairs.torque_N_m.asDiagonal());
  if (pairs.net_force_N) document["net_force_N"] = rows_of(*pairs.net_force_N);
  for (std::size_t i = 0; i < 6; ++i)
    document["most_torque_N_m"][kDirections[i]] = pairs.torque_N_m[static_cast<Eigen::Index>(i / 2)];
  std::vector<double> levels(pairs.torque_N_m.begin(), pairs.torque_N_m.end());
  document["modulator"] = modulator_document(pairs.modulator, levels, spec.sample_period_s);
  return document;
}

// What each thruster does, what each is asked for by a torque of 1 N m, and how much of it there is until the
// first of them is at its level.
json actuator_document(const MountedThrusters& mounted, const AttitudeSpecification& spec) {
  json document = {{"type", "thruster_set"}};
  document["allocation"]["type"] = mounted.allocation == AllocationMethod::linear_programme
                                       ? "linear_programme"
                                       : "non_negative_least_squares";
  const ThrusterAllocation allocation(mounted.thrusters, mounted.allocation);
  std::vector<double> thrust_N(mounted.thrusters.size()), levels;
  for (const Thruster& thruster : mounted.thrusters) {
    document["torques_N_m"].push_back(numbers(torque_N_m(thruster)));
    levels.push_back(thruster.thrust_N);
  }
  for (std::size_t i = 0; i < 6; ++i) {
    allocation.allocate(direction(i), thrust_N);
    double most = std::numeric_limits<double>::infinity(), total = 0;
    Vector3d force = Vector3d::Zero();
    for (std::size_t j = 0; j < thrust_N.size(); ++j) {
      if (thrust_N[j] > 0) most = std::min(most, levels[j] / thrust_N[j]);
      total += thrust_N[j];
      force += thrust_N[j] * mounted.thrusters[j].direction;
    }
    document["allocation"]["thrust_N_of_1_N_m"][kDirections[i]] = thrust_N;
    document["allocation"]["total_thrust_N_of_1_N_m"][kDirections[i]] = total;
    document["allocation"]["force_N_of_1_N_m"][kDirections[i]] = numbers(force);
    document["most_torque_N_m"][kDirections[i]] = most;
  }
  document["modulator"] = modulator_document(mounted.modulator, levels, spec.sample_period_s);
  return document;
}

json size(const AttitudeSpecification& spec) {
  return {{"most_control_steps",
           spec.sample_period_s ? json(std::ceil(spec.duration_s / *spec.sample_period_s)) : json(nullptr)},
          {"most_telemetry_samples", std::floor(spec.duration_s / spec.telemetry_period_s) + 2}};
}

}  // namespace

// Principal axes right-handed, the largest component of the first two positive.
json rigid_body_document(const RigidBodyPlant& plant) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(plant.inertia_kg_m2);
  Matrix3d axes = solver.eigenvectors();
  for (Eigen::Index i = 0; i < 2; ++i) {
    Eigen::Index largest = 0;
    axes.col(i).cwiseAbs().maxCoeff(&largest);
    if (axes(largest, i) < 0) axes.col(i) *= -1;
  }
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return {{"type", "rigid_body"},
          {"inertia_kg_m2", rows_of(plant.inertia_kg_m2)},
          {"principal_moments_kg_m2", numbers(solver.eigenvalues())},
          {"principal_axes", rows_of(axes.transpose())}};
}

json system_document(const AttitudeSpecification& spec) {
  return {
      {"plant", rigid_body_document(spec.plant)},
      {"law", law_document(spec.law)},
      {"at_initial_state", point_document(spec)},
      {"surface_bound_rad_s", surface_bound(spec)},
      {"observer", observer_document(spec.observer)},
      {"actuator", std::visit([&](const auto& one) { return actuator_document(one, spec); }, spec.actuator)},
      {"size", size(spec)}};
}

// Of the first channel: those of thrusters that differ have the same curve over a demand in their levels.
json design_document(const AttitudeSpecification& spec) {
  if (const auto* pairs = std::get_if<AxisThrusters>(&spec.actuator))
    return modulator_design(pairs->modulator, pairs->torque_N_m[0], "N m", spec.sample_period_s);
  if (const auto* mounted = std::get_if<MountedThrusters>(&spec.actuator))
    return modulator_design(mounted->modulator, mounted->thrusters.front().thrust_N, "N",
                            spec.sample_period_s);
  return {
      {"type", "none"},
      {"sentence", "torque of any size has no modulator, and only that of a design in three axes is drawn"}};
}

}  // namespace slew
