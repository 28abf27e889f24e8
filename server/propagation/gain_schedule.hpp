// The gain of a Kalman filter over time, its Riccati equation integrated by SUNDIALS. No flight changes it,
// so it is known before the first; in between its places it is a polynomial of the fifth degree through gain,
// slope and curvature.
#pragma once

#include <vector>

#include "server/estimation/elastic_filter.hpp"

namespace slew {

/// Steps times the cube of the states that the integration may take.
inline constexpr double kMostFilterWork = 2.5e8;

/// Throws std::domain_error where it would be more until then.
void check_filter_work(const ElasticFilter& filter, double until_s);

class GainSchedule {
 public:
  /// From 0 to `until_s`, or to where the gain is the steady one to the tolerance, which it is from then on.
  /// Throws std::domain_error when there is no steady one.
  GainSchedule(const ElasticFilter& filter, double until_s, double relative_tolerance);

  /// L, one column for each sensor.
  void gain_at(double t_s, Eigen::MatrixXd& gain) const;
  const Eigen::MatrixXd& steady_gain() const { return steady_; }
  std::size_t steps() const { return times_s_.size() - 1; }

 private:
  void keep(const ElasticFilter& filter, double t_s, const Eigen::MatrixXd& covariance);

  std::vector<double> times_s_;
  std::vector<Eigen::MatrixXd> gains_, slopes_, curvatures_;
  Eigen::MatrixXd steady_;
};

}  // namespace slew
