// A maneuver under controls that are constant between switches, and how it ends when a switch is moved: a
// switch of u_i from u- to u+ that comes later by dt changes the rate by I^-1 B_i (u- - u+) dt, and the
// transition matrix takes that to the end (Vadali, Singh & Carter 1993, Eqs. 18-20). What a level does while
// it lasts is the forced response to a constant angular acceleration.
#pragma once

#include <vector>

#include "server/control/control_history.hpp"
#include "server/guidance/variational_body.hpp"

namespace slew {

/// Integral of the sum of consumption |u_i|.
double consumption_of(const OnOffProgram& program, const RigidManeuverPlant& plant);

/// A switch in flight.
struct FlownSwitch {
  double time_s;
  int control, index;  ///< the index-th switch of that control
  double before, after;
};

/// Something seen on the way: the transition matrix from the start brings (phi, dw) at t = 0 here.
struct FlownPoint {
  double time_s;
  Vector4<double> attitude;
  Eigen::Vector3d rate_rad_s;
  Eigen::Matrix<double, 6, 6> transition;
};

class OnOffFlight {
 public:
  explicit OnOffFlight(const ManeuverBody& body) : body_(&body) {}

  /// Points are the start, the switches in order of time, the middles of long arcs where `with_middles`, and
  /// the end.
  void fly(const OnOffProgram& program, const RigidState& start, bool with_middles = false);
  /// Likewise, and with the forced response at every point.
  void fly_with_response(const OnOffProgram& program, const RigidState& start, bool with_middles = false);
  /// No step is longer than `finest_s`, and every step's end is a point.
  void fly_finely(const OnOffProgram& program, const RigidState& start, double finest_s);

  const std::vector<FlownSwitch>& switches() const { return switches_; }
  const std::vector<FlownPoint>& points() const { return points_; }
  /// The point at switch k, and the point of the end.
  const FlownPoint& at_switch(std::size_t k) const { return points_[switch_points_[k]]; }
  std::size_t switch_point(std::size_t k) const { return switch_points_[k]; }
  const FlownPoint& end() const { return points_.back(); }
  /// (phi, dw) at a point, by columns: of an angular acceleration of 1 rad/s^2 about each body axis from t =
  /// 0 on.
  const Eigen::Matrix<double, 6, 3>& response(std::size_t point) const { return responses_[point]; }
  const Eigen::VectorXd& controls_at_end() const { return control_; }
  /// (C^T w, w'): what time itself does to (phi, w) there.
  Eigen::Matrix<double, 6, 1> drift_at(const FlownPoint& point, const Eigen::VectorXd& control) const;

 private:
  template <typename Moving>
  void fly_as(const OnOffProgram& program, const RigidState& start, double finest_s, bool with_middles);
  void fly(const OnOffProgram& program, const RigidState& start, double finest_s, bool with_middles);

  const ManeuverBody* body_;
  std::vector<FlownSwitch> switches_;
  std::vector<FlownPoint> points_;
  std::vector<Eigen::Matrix<double, 6, 3>> responses_;
  std::vector<std::size_t> switch_points_;
  Eigen::VectorXd control_;
};

/// Of a transition matrix. For a free body that of the attitude alone is 1.
Eigen::Matrix<double, 6, 6> inverse_transition(const Eigen::Matrix<double, 6, 6>& transition, bool is_free);

}  // namespace slew
