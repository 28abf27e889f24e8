#include "server/plant/astrex.hpp"

namespace slew {

namespace {

Eigen::Vector3d centre_of_mass_m() {
  return {-0.0035, 0.00025, -0.00017};
}

bool fires(const AstrexThruster& thruster, AstrexThrusters chosen) {
  if (chosen == AstrexThrusters::eight_lbf) return thruster.number <= 6;
  return thruster.number >= 5;
}

Eigen::Vector3d force_N(const AstrexThruster& thruster) {
  return thruster.sign * thruster.force_lbf * kNewtonPerPoundForce * thruster.direction;
}

}  // namespace

std::array<AstrexThruster, 10> astrex_thrusters() {
  const Eigen::Vector3d down(-.5, 0, -.867), up(.5, 0, .867), left(0, 1, 0), right(0, -1, 0);
  return {{
      {1, 8, {-1.35, -2.7, -.25}, down, 0, 1},
      {2, 8, {1.35, -2.7, -.25}, up, 1, -1},
      {3, 8, {1.35, 2.7, -.25}, down, 0, -1},
      {4, 8, {-1.35, 2.7, -.25}, up, 1, 1},
      {5, 8, {-2.83, 0, -.05}, left, 2, -1},    // printed (-.5, 0, -.867): a couple in pitch, none in roll
      {6, 8, {2.83, 0, -.05}, right, 2, -1},    // printed (.5, 0, .867): likewise
      {7, 200, {-1.35, 2.55, -.25}, up, 1, 1},  // printed with y = -2.55, where no. 8 is
      {8, 200, {-1.35, -2.55, -.25}, down, 0, 1},
      {9, 200, {1.35, 2.55, -.25}, down, 0, -1},
      {10, 200, {1.35, -2.55, -.25}, up, 1, -1},  // printed with y = 2.55, where no. 9 is
  }};
}

Eigen::Matrix3d astrex_influence_from_table(AstrexThrusters thrusters) {
  Eigen::Matrix3d influence = Eigen::Matrix3d::Zero();
  for (const AstrexThruster& thruster : astrex_thrusters())
    if (fires(thruster, thrusters))
      influence.col(thruster.control) += thruster.location_m.cross(force_N(thruster));
  return influence;
}

Eigen::Vector3d astrex_net_force(AstrexThrusters thrusters, const Eigen::Vector3d& u) {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (const AstrexThruster& thruster : astrex_thrusters())
    if (fires(thruster, thrusters)) force += u[thruster.control] * force_N(thruster);
  return force;
}

Eigen::Matrix3d astrex_influence(AstrexThrusters thrusters) {
  Eigen::Matrix3d influence;
  if (thrusters == AstrexThrusters::eight_lbf)
    influence << 167.14, 167.14, 0,  //
        -83.21, 83.21, 0,            // printed -83.21 twice: r x F has opposite signs, and det B is not 0
        -96.5, -96.5, 201.17;
  else
    influence << 3924.08, 3924.08, 0,  //
        -2080.31, 2080.31, 0,          //
        -2265.57, -2265.57, 201.17;
  return influence;
}

Eigen::Matrix3d astrex_inertia_about_pivot() {
  Eigen::Matrix3d inertia;
  inertia << 22239.3, -14.63, -211.02,  //
      -14.63, 15680.13, -8.164,         //
      -211.02, -8.164, 22270.42;
  return inertia;
}

Eigen::Matrix3d astrex_inertia_about_centre() {
  const Eigen::Matrix3d pivot = astrex_inertia_about_pivot();
  const Eigen::Matrix3d diagonal = pivot.diagonal().asDiagonal();
  const Eigen::Vector3d r = centre_of_mass_m();
  const Eigen::Matrix3d shift = r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose();
  return 2 * diagonal - pivot - kAstrexMass_kg * shift;
}

Eigen::Vector3d astrex_air_ft3_s(AstrexThrusters thrusters) {
  Eigen::Vector3d force_lbf = Eigen::Vector3d::Zero();
  for (const AstrexThruster& thruster : astrex_thrusters())
    if (fires(thruster, thrusters)) force_lbf[thruster.control] += thruster.force_lbf;
  return 14.0 / 60 * force_lbf;
}

RigidManeuverPlant astrex_floating(AstrexThrusters thrusters) {
  RigidManeuverPlant plant;
  plant.inertia_kg_m2 = astrex_inertia_about_centre();
  plant.influence_N_m = astrex_influence(thrusters);
  plant.consumption_1_s = astrex_air_ft3_s(thrusters);
  return plant;
}

RigidManeuverPlant astrex_on_pedestal(AstrexThrusters thrusters) {
  RigidManeuverPlant plant = astrex_floating(thrusters);
  plant.inertia_kg_m2 = astrex_inertia_about_pivot();
  plant.weight = PivotWeight{kAstrexMass_kg, centre_of_mass_m()};
  plant.springs = PedestalSprings{2000, 1000};
  return plant;
}

}  // namespace slew
