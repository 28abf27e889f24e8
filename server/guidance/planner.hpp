// Near-minimum-time maneuvers of a rigid body (Vadali, Singh & Carter 1993; time-optimal slews of Kim &
// Crassidis 1998): many starts go down to local optima, the shortest is taken, and a certificate says by
// other means what it is worth. The same problem, options and build give the same bits.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>

#include "server/control/control_history.hpp"
#include "server/control/torque_program.hpp"
#include "server/guidance/maneuver_problem.hpp"
#include "server/guidance/on_off_flight.hpp"

namespace slew {

struct PlannerOptions {
  std::uint64_t seed = 1;
  int most_evaluations = 20000;  ///< of the motion with its sensitivities
  int least_starts = 24;         ///< before the search is content
  int most_starts = 200;
  int enough_hits = 3;  ///< starts that end at the same shortest maneuver
  double met = 1e-6;    ///< terminal errors may be so large: rad, and rad per maneuver time
};

struct PlannerState {
  int starts, evaluations;
  double best_s;  ///< infinite where none was found yet
};

/// What the caller hears and says meanwhile; either may be empty.
struct PlannerProgress {
  std::function<bool()> keep_going;
  std::function<void(const PlannerState&)> report;
};

enum class PlanStatus {
  extremal,  ///< meets everything, and the conditions of optimality of its family: no small change is faster
  /// Meets everything; some control has the wrong sign for a while, which would save no more than a few
  /// millionths of the time: where controls may not be throttled one switches often along a singular arc,
  /// which no finite number of switches follows.
  nearly_extremal,
  best_found,  ///< meets everything; shown to be no more than that
  none,        ///< nothing that meets the conditions was found
  refused      ///< see faults
};

/// A local optimum that was met.
struct FoundOptimum {
  double time_s;
  std::vector<int> switches;  ///< of each control
  int hits;
  bool is_extremal;
};

enum class SearchEnd { content, starts, evaluations, caller };

struct SearchLog {
  int starts = 0, failed_starts = 0, programs_solved = 0;
  int evaluations = 0;  ///< against the budget; judging and polishing what was found comes on top
  std::vector<FoundOptimum> optima;  ///< ascending in time, the first 16
  SearchEnd ended_by = SearchEnd::content;
};

struct PlanCertificate {
  // By SUNDIALS at 1e-12, which shares the equations of motion with the planner and nothing else.
  double attitude_error_rad = 0;
  double rate_error_rad_s = 0;
  Eigen::Vector3d peak_rate_rad_s = Eigen::Vector3d::Zero();
  double consumption = 0;
  double consumption_margin = 0;  ///< of the limit; 0 where there is none
  double rate_margin_rad_s = 0;   ///< the least over the axes
  bool meets_all = false;

  // Conditions of optimality, in units in which the Hamiltonian is -1.
  double residual = 0;     ///< of the fitted costates (on-off) or multipliers (smooth families)
  double violating_s = 0;  ///< on-off: how long controls have the wrong sign
  double worst_sign = 0;   ///< on-off: the largest excess of the Hamiltonian
  double saving_s = 0;     ///< on-off: what setting them right may save, to first order
  double throttled_s = 0;  ///< on-off: how long controls are throttled, along singular arcs
  /// On-off: the generalised Legendre-Clebsch condition along these, to be no less than 0 (pontryagin.hpp);
  /// infinite where there are none.
  double legendre_clebsch = std::numeric_limits<double>::infinity();
  Eigen::Matrix<double, 6, 1> final_costate = Eigen::Matrix<double, 6, 1>::Zero();
  double price = 0;                ///< of consumption: s that a unit more would save
  bool signs_were_tested = false;  ///< not where a rate is on its limit

  // What is known besides.
  double eigenaxis_s = 0;  ///< a maneuver that exists, from rest to rest of a free body; infinite: none
  double least_s = 0;      ///< no maneuver is shorter; 0: not known
  Eigen::Index critical_control = 0;
};

/// What was found is the control history itself.
struct Plan : ControlHistory {
  PlanStatus status = PlanStatus::none;
  std::string why;                    ///< a sentence
  std::vector<ManeuverFault> faults;  ///< of a problem that was refused
  double consumption = 0;
  PlanCertificate certificate;
  SearchLog log;
};

Plan plan(const ManeuverProblem& problem, const PlannerOptions& options = {},
          const PlannerProgress& progress = {});

/// u at t of the maneuver; zero from its end on.
Eigen::VectorXd control_at(const ControlHistory& history, const RigidManeuverPlant& plant, double t_s);

/// The plan as a torque about body axes; nothing where it coasts, where a control is throttled, where a
/// control is not about one body axis, or where the two signs of a control differ in size.
std::optional<TorqueProgram> torque_program(const Plan& plan, const RigidManeuverPlant& plant);

}  // namespace slew
