// The least time over the switch times of given sequences, as a nonlinear program: switch time optimization
// (Vadali, Singh & Carter 1993, Eqs. 12-15). Its variables are the lengths of all segments but each control's
// last, and the maneuver's time, in units of a time t_ref; rates are in units of 1/t_ref.
#pragma once

#include "server/guidance/on_off_flight.hpp"
#include "server/guidance/sequential_quadratic.hpp"

namespace slew {

class SwitchTimeProgram {
 public:
  /// Of the controls of `program`; its times are only a start. Both must outlive it.
  SwitchTimeProgram(const ManeuverProblem& problem, const ManeuverBody& body, const OnOffProgram& program);

  const NonlinearProgram& nonlinear() const { return nonlinear_; }
  Eigen::VectorXd variables(const OnOffProgram& program) const;
  OnOffProgram program(const Eigen::VectorXd& variables) const;
  double reference_s() const { return reference_s_; }
  Eigen::Index switches() const { return switches_; }
  bool limits_consumption() const { return limits_consumption_; }

  /// In terms of the switch times themselves, control by control, and of the end: the terminal error's slope,
  /// and consumption's (in units of t_ref times consumption), as the conditions of optimality need them.
  struct Slopes {
    Eigen::Matrix<double, 6, 1> error;
    Eigen::MatrixXd error_slope;  ///< 6 rows; the last column is that of the end
    Eigen::VectorXd consumption_slope;
  };
  Slopes slopes(const OnOffProgram& program) const;

 private:
  void evaluate(const Eigen::VectorXd& variables, NonlinearValues& values);

  const ManeuverProblem* problem_;
  const ManeuverBody* body_;
  OnOffProgram shape_;
  double reference_s_;
  double consumption_scale_ = 1;
  bool limits_consumption_;
  Eigen::Index switches_;
  std::vector<Eigen::Index> first_;  ///< of each control, its first variable
  mutable OnOffFlight flight_;
  NonlinearProgram nonlinear_;
};

}  // namespace slew
