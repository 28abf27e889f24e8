// References p_d(t) that an attitude law follows, with their first two derivatives.
#pragma once

#include <memory>
#include <variant>

#include "server/control/mrp_table.hpp"

namespace slew {

/// p_d = 0: the final attitude.
struct FinalAttitude {};

/// A sin(W t + phi), in each of the three parameters.
struct MrpSinusoids {
  Eigen::Vector3d amplitude = Eigen::Vector3d::Zero();
  Eigen::Vector3d frequency_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d phase_rad = Eigen::Vector3d::Zero();
};

/// A rest-to-rest rotation about a fixed axis: p_d = n tan(theta/4) with
///   theta = theta_0 + (theta_1 - theta_0) (10 x^3 - 15 x^4 + 6 x^5),   x = (t - from) / duration,
/// and at rest before and after. theta' and theta'' are continuous. Angles within +-2 pi.
struct EigenaxisRotation {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< n, of norm 1
  double initial_angle_rad = 0, final_angle_rad = 0;
  double from_s = 0, duration_s = 1;
};

/// The motion of a maneuver that was planned. Null as long as there is no plan: the final attitude.
struct PlannedMotion {
  std::shared_ptr<const MrpTable> table;
};

struct MrpTrajectory {
  std::variant<FinalAttitude, MrpSinusoids, EigenaxisRotation, PlannedMotion> shape;

  /// As a step of the loop sees it that began at `step_began_s`.
  MrpReference<double> at(double t_s, double step_began_s) const;
  MrpReference<double> at(double t_s) const { return at(t_s, t_s); }
  bool is_fixed() const { return std::holds_alternative<FinalAttitude>(shape); }
  /// The first time after t at which a second or third derivative jumps; infinity when there is none.
  double next_change_s(double t_s) const;
};

}  // namespace slew
