// What is known of a maneuver before it is planned: the eigenaxis, its critical control (Vadali, Singh &
// Carter 1993, Eq. 6), and bounds on time and consumption.
#pragma once

#include <vector>

#include "server/guidance/variational_body.hpp"

namespace slew {

/// The rotation from one attitude to the other, the shorter way round: about `axis`, in body axes as in the
/// frame of the initial attitude. Any axis where the attitudes are the same.
struct Eigenaxis {
  Eigen::Vector3d axis;
  double angle_rad;  ///< 0 to pi
};
Eigenaxis eigenaxis(const Vector4<double>& from, const Vector4<double>& to);

struct EigenaxisManeuver {
  Eigenaxis eigenaxis;
  Eigen::VectorXd effort_s2;  ///< B^-1 I l: the controls for 1 rad/s^2 about the eigenaxis
  Eigen::Index critical = 0;  ///< the largest of |effort|
  double synthetic_s = 0;     ///< 2 sqrt(angle max |effort|): gyroscopic torque ignored
  /// Accelerating and braking about the eigenaxis as hard as the controls can while they hold the axis
  /// against the gyroscopic torque; an upper bound where the maneuver is from rest to rest and the body free.
  /// Infinite where the controls cannot.
  double time_s = 0;
  /// All controls together could give this about the axis, rad/s^2, if they need not hold it.
  double boldest_rad_s2 = 0;
  std::vector<double> times_s, rates_rad_s;  ///< at equal steps of the angle
  Eigen::VectorXd hold;                      ///< the controls that hold the axis, for 1 rad/s
};
EigenaxisManeuver eigenaxis_maneuver(const ManeuverBody& body, const Eigenaxis& eigenaxis);

/// No maneuver from rest to rest of a free body is shorter: |w| <= sqrt(2 E / least inertia) and the root of
/// the energy grows by no more than the largest |I^-1/2 B u| / sqrt 2. Zero where it does not apply.
double least_time_s(const ManeuverProblem& problem);

/// No maneuver of a free body consumes less: what changes its momentum, and, where it may not last longer
/// than `longest_s`, what brings it round in that time. Zero where it does not apply.
double least_consumption(const ManeuverProblem& problem);

/// Everything that is wrong with a problem; empty: it may be planned.
std::vector<ManeuverFault> maneuver_faults(const ManeuverProblem& problem);

}  // namespace slew
