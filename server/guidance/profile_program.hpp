// The least time over the parameters of a smooth family, as a nonlinear program (Vadali, Singh & Carter 1993,
// Eqs. 12-15): variables are the parameters that are free, and the maneuver's time in units of its start.
#pragma once

#include "server/guidance/profile_flight.hpp"
#include "server/guidance/sequential_quadratic.hpp"

namespace slew {

/// What a problem says of its family, parameter by parameter.
ProfileLayout profile_layout(const ManeuverProblem& problem);
std::vector<ProfileParameter> profile_parameters(const ManeuverProblem& problem, const ProfileLayout& layout);

class ProfileProgram {
 public:
  /// Both must outlive it.
  ProfileProgram(const ManeuverProblem& problem, const ManeuverBody& body, const ProfileLayout& layout,
                 std::vector<ProfileParameter> parameters, double reference_s);

  const NonlinearProgram& nonlinear() const { return nonlinear_; }
  Eigen::VectorXd start() const;
  std::vector<double> parameters(const Eigen::VectorXd& variables) const;
  double time_s(const Eigen::VectorXd& variables) const {
    return reference_s_ * variables[variables.size() - 1];
  }

 private:
  void evaluate(const Eigen::VectorXd& variables, NonlinearValues& values);

  const ManeuverProblem* problem_;
  std::vector<ProfileParameter> parameters_;
  std::vector<std::size_t> free_;
  double reference_s_;
  ProfileFlight flight_;
  NonlinearProgram nonlinear_;
};

}  // namespace slew
