// References p_d(t) that an attitude law follows, with their first two derivatives.
#pragma once

#include <variant>

#include "server/control/attitude_sight.hpp"

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

struct MrpTrajectory {
  std::variant<FinalAttitude, MrpSinusoids, EigenaxisRotation> shape;

  MrpReference<double> at(double t_s) const;
  bool is_fixed() const { return std::holds_alternative<FinalAttitude>(shape); }
  /// The first time after t at which a third derivative jumps; infinity when there is none.
  double next_change_s(double t_s) const;
};

}  // namespace slew
