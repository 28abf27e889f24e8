// A maneuver under smooth controls, and how its end moves with their parameters and with its time: x' = t_f f
// and V' = t_f (df/dx V + df/dp) over the time 0 to 1 (Vadali, Singh & Carter 1993, Eqs. 12, 19, 20).
#pragma once

#include "server/control/control_profile.hpp"
#include "server/guidance/variational_body.hpp"

namespace slew {

/// On the way: sensitivities are columns of (phi, dw), one for each parameter asked for, the time's last.
struct ProfilePoint {
  double t;  ///< of the maneuver's time
  Vector4<double> attitude;
  Eigen::Vector3d rate_rad_s;
  Eigen::Matrix<double, 6, Eigen::Dynamic> sensitivity;
};

class ProfileFlight {
 public:
  static constexpr std::size_t kMostColumns = 32;

  ProfileFlight(const ManeuverBody& body, ProfileLayout layout) : body_(&body), layout_(std::move(layout)) {}

  /// `free`: places of the parameters whose sensitivities are wanted. Every step's end is a point where
  /// `with_points`; the end always is.
  void fly(std::span<const double> parameters, double time_s, const RigidState& start,
           std::span<const std::size_t> free, bool with_points = false);

  const ProfilePoint& end() const { return points_.back(); }
  const std::vector<ProfilePoint>& points() const { return points_; }
  double consumption() const { return consumption_; }
  /// With the parameters asked for, and with the time.
  const Eigen::VectorXd& consumption_slope() const { return consumption_slope_; }

 private:
  const ManeuverBody* body_;
  ProfileLayout layout_;
  std::vector<ProfilePoint> points_;
  double consumption_ = 0;
  Eigen::VectorXd consumption_slope_;
};

}  // namespace slew
