// From a start to an extremal: switch times are optimized, segments that vanished are taken out, and where a
// control has the wrong sign (pontryagin.hpp) segments are put in, until the signs are right.
#pragma once

#include <functional>
#include <optional>

#include "server/guidance/singular_arcs.hpp"

namespace slew {

struct OnOffSolution {
  OnOffProgram maneuver;
  SignTest signs;
  double violation = 0;  ///< of the terminal error and the limits, in units of t_ref
  double residual = 0;   ///< of the conditions of optimality
  bool is_consumption_active = false, is_rate_active = false;
};

/// Meets the conditions of optimality, and nothing worth mentioning is left to be saved.
bool is_extremal(const OnOffSolution& solution);
/// Likewise, but for signs that are wrong for a while, and costates that fit less well for it.
bool is_nearly_extremal(const OnOffSolution& solution);
/// Not an extremal, or one that more segments or levels would still make shorter.
bool is_worth_refining(const OnOffSolution& solution);

class OnOffSearch {
 public:
  OnOffSearch(const ManeuverProblem& problem, const ManeuverBody& body, std::function<bool()> keep_going)
      : problem_(&problem), body_(&body), keep_going_(std::move(keep_going)) {}

  /// The best that is found going down from there; nothing where no maneuver that meets the conditions is.
  /// Gives up early when it would not come below `worth_s`.
  std::optional<OnOffSolution> descend(const OnOffProgram& start, double worth_s);
  /// Segments are put in until next to nothing is left to be saved; never slower than the solution.
  OnOffSolution refine(const OnOffSolution& solution);
  /// With its singular arcs throttled; nothing where no arcs are seen, or where that is not faster.
  std::optional<OnOffSolution> throttled(const OnOffSolution& solution);
  /// Of these sequences only: nothing where a segment vanishes.
  std::optional<OnOffSolution> settle(const OnOffProgram& start);
  /// Likewise, by Newton's method alone: also where the extremal beside the start is no minimum, as the
  /// published seven switches for 45 deg are none.
  std::optional<OnOffSolution> settle_beside(const OnOffProgram& start);
  /// Newton's method on the conditions of optimality.
  OnOffSolution polish(const OnOffSolution& solution);

  int evaluations() const { return evaluations_; }
  int programs_solved() const { return solved_; }
  bool was_stopped() const { return was_stopped_; }

 private:
  std::optional<OnOffProgram> optimize(const OnOffProgram& start, double tolerance);
  bool restore(const SwitchTimeProgram& program, Eigen::VectorXd& variables);
  Eigen::VectorXd finished(const SwitchTimeProgram& program, Eigen::VectorXd variables);
  OnOffProgram with_segments(const OnOffSolution& solution, double part, bool is_everywhere);
  OnOffSolution filled(OnOffSolution best, double worth, int most_rounds, bool is_thorough);
  std::optional<OnOffProgram> optimize_levels(const OnOffProgram& start);
  static void leave_room(const OnOffSolution& solution, std::size_t pieces, SingularArc& arc,
                         OnOffProgram& program);
  OnOffSolution mended(const OnOffSolution& solution);
  OnOffSolution settled(const OnOffProgram& maneuver);
  OnOffSolution polished(const OnOffSolution& solution);
  OnOffSolution judge(const OnOffProgram& maneuver, int steps);
  bool may_go_on();

  const ManeuverProblem* problem_;
  const ManeuverBody* body_;
  std::function<bool()> keep_going_;
  int evaluations_ = 0, solved_ = 0;
  bool was_stopped_ = false;
};

/// Without segments shorter than this, and without switches from a value to itself.
OnOffProgram without_short_segments(const OnOffProgram& program, double shortest_s);
/// u_i = value on [from, to].
void insert_segment(OnOffProgram& program, std::size_t control, double value, double from_s, double to_s);

}  // namespace slew
