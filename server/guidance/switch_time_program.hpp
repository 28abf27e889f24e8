// The least time over the switch times of given sequences, as a nonlinear program: switch time optimization
// (Vadali, Singh & Carter 1993, Eqs. 12-15). Its variables are the lengths of all segments but each control's
// last, and the maneuver's time, in units of a time t_ref; rates are in units of 1/t_ref.
//
// A control strictly between its bounds, and not zero, is throttled, and its level is a variable too.
// Throttled segments of one length in a row are pieces of one singular arc: they share their length, whatever
// becomes of it.
#pragma once

#include "server/guidance/on_off_flight.hpp"
#include "server/guidance/sequential_quadratic.hpp"

namespace slew {

/// Whether u_i is a level that is free: no bound, and not zero.
bool is_throttled(const RigidManeuverPlant& plant, std::size_t control, double u);

class SwitchTimeProgram {
 public:
  /// Of the controls of `program`; its times and levels are only a start. Both must outlive it.
  SwitchTimeProgram(const ManeuverProblem& problem, const ManeuverBody& body, const OnOffProgram& program);

  const NonlinearProgram& nonlinear() const { return nonlinear_; }
  /// Lengths, time, levels.
  Eigen::VectorXd variables(const OnOffProgram& program) const;
  OnOffProgram program(const Eigen::VectorXd& variables) const;
  /// The maneuver's time among the variables, and among the parameters.
  Eigen::Index time_at() const { return switches_; }
  double reference_s() const { return reference_s_; }
  bool limits_consumption() const { return limits_consumption_; }

  /// The switch times themselves, control by control, but for those within an arc; the end; the levels. Times
  /// are in units of t_ref.
  Eigen::VectorXd parameters(const OnOffProgram& program) const;
  OnOffProgram program_of_parameters(const Eigen::VectorXd& parameters) const;
  Eigen::Index parameter_count() const { return switches_ + 1 + levels(); }
  Eigen::Index levels() const { return static_cast<Eigen::Index>(levels_.size()); }

  /// In terms of the parameters: the terminal error's slope, and consumption's (in units of t_ref times
  /// consumption), as the conditions of optimality need them.
  struct Slopes {
    Eigen::Matrix<double, 6, 1> error;
    Eigen::MatrixXd error_slope;        ///< 6 rows
    Eigen::VectorXd consumption_slope;  ///< empty where it is not limited
  };
  Slopes slopes(const OnOffProgram& program) const;

 private:
  // A segment, or the pieces of a singular arc.
  struct Arc {
    std::size_t first, pieces;
  };
  // A switch moves by `part` of what the parameter `after` does, and by the rest of what `before` does.
  struct Place {
    Eigen::Index before, after;  // below 0: the start, which does not move
    double part;
  };
  struct Level {
    std::size_t control, segment;
  };

  // Points of the flight between which a level lasts.
  struct Span {
    std::size_t begin, end;
  };

  void find_arcs();
  void place_pieces(OnOffProgram& program) const;
  void fly(const OnOffProgram& program, bool with_middles) const;
  std::vector<Span> level_spans() const;
  Eigen::VectorXd consumption_slope(const OnOffProgram& program) const;
  template <typename Column>
  void add_switch(const FlownSwitch& flown, const Column& change, Eigen::MatrixXd& slope) const;
  Eigen::MatrixXd in_lengths(Eigen::MatrixXd rows) const;
  void evaluate(const Eigen::VectorXd& variables, NonlinearValues& values);
  void limit_rates(const OnOffProgram& flown, Eigen::Index row, NonlinearValues& values);

  const ManeuverProblem* problem_;
  const ManeuverBody* body_;
  OnOffProgram shape_;
  double reference_s_;
  double consumption_scale_ = 1;
  bool limits_consumption_;
  Eigen::Index switches_ = 0;                // that are free
  std::vector<Eigen::Index> first_, count_;  // of each control, its first variable and how many
  std::vector<std::vector<Arc>> arcs_;       // of each control
  std::vector<std::vector<Place>> places_;   // of each control's switches
  std::vector<Level> levels_;
  mutable OnOffFlight flight_;
  NonlinearProgram nonlinear_;
};

}  // namespace slew
