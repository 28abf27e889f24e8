// Is an on-off maneuver an extremal? Costates are fitted to its switches, and the sign of every control is
// held against Pontryagin's principle: with S_i = p^T I^-1 B_i and mu >= 0 the price of what is consumed, u_i
// minimises S_i u_i + mu c_i |u_i| at every time. Where it does not, another value for a while would save
// time. A control that is throttled is held against it alike: |S_i| is what is left.
#pragma once

#include <limits>

#include "server/guidance/switch_time_program.hpp"

namespace slew {

/// Multipliers of the terminal error (in units of t_ref) and of consumption, such that moving any switch, or
/// the end, saves nothing to first order.
struct ManeuverMultipliers {
  Eigen::Matrix<double, 6, 1> terminal;
  double consumption = 0;  ///< t_ref mu
  double residual = 0;     ///< of the conditions at switches and end, largest; the end's right side is 1
  Eigen::MatrixXd free;    ///< directions that the conditions leave free, 7 rows; often none
};

ManeuverMultipliers fit_multipliers(const SwitchTimeProgram& program, const OnOffProgram& maneuver,
                                    bool is_consumption_active);

/// An interval in which a control should have another value.
struct SignViolation {
  std::size_t control;
  double from_s, to_s;
  double value;     ///< what the control should be
  double saving_s;  ///< of time, to first order, if it were so throughout
  double peak_s;    ///< where it is worst
};

struct SignTest {
  std::vector<SignViolation> violations;
  double violating_s = 0;  ///< total, counted per control
  double saving_s = 0;     ///< of all violations: what correcting them may save, to first order
  double worst = 0;        ///< excess of the Hamiltonian over its minimum; the Hamiltonian itself is -1
  double throttled_s = 0;  ///< total, counted per control
  /// Of -d(S'')/du of the controls that are throttled at one time, the least eigenvalue, times the square of
  /// the maneuver's time: by the generalised Legendre-Clebsch condition (Kelley, Kopp & Moyer 1967) not
  /// negative. Infinite where none is throttled.
  double legendre_clebsch = std::numeric_limits<double>::infinity();
  ManeuverMultipliers multipliers;
  std::vector<double> times_s;             ///< where it was looked
  std::vector<Eigen::VectorXd> switching;  ///< S there, per second of maneuver time
};

/// `steps`: how many points at least.
SignTest test_signs(const ManeuverProblem& problem, const ManeuverBody& body,
                    const SwitchTimeProgram& program, const OnOffProgram& maneuver,
                    bool is_consumption_active, int steps = 120);

}  // namespace slew
