// The searches behind a plan, one for each kind of family.
#pragma once

#include "server/guidance/maneuver_bounds.hpp"
#include "server/guidance/planner.hpp"

namespace slew {

/// What a search may still spend, and what it met.
class SearchBudget {
 public:
  SearchBudget(const PlannerOptions& options, const PlannerProgress& progress)
      : options_(&options), progress_(&progress) {}

  /// To be asked before every evaluation of the motion.
  bool spend() {
    if (evaluations_ >= options_->most_evaluations)
      end_ = SearchEnd::evaluations;
    else if (progress_->keep_going && !progress_->keep_going())
      end_ = SearchEnd::caller;
    else
      return ++evaluations_, true;
    is_spent_ = true;
    return false;
  }
  bool is_spent() const { return is_spent_; }
  SearchEnd end() const { return end_; }
  int evaluations() const { return evaluations_; }

  /// Counts an optimum, of which up to `slack_s` may be left to be saved. True where it is the shortest so
  /// far.
  bool met(SearchLog& log, double time_s, double slack_s, std::vector<int> switches, bool is_extremal);
  void report(const SearchLog& log) const;
  /// Whether the shortest was met so often that more starts are not worth their time.
  bool is_content(const SearchLog& log) const;

 private:
  const PlannerOptions* options_;
  const PlannerProgress* progress_;
  int evaluations_ = 0;
  bool is_spent_ = false;
  SearchEnd end_ = SearchEnd::content;
};

/// Fills times, status and certificate but for the flight; returns false where nothing was found.
bool search_on_off(const ManeuverProblem& problem, const ManeuverBody& body, const PlannerOptions& options,
                   SearchBudget& budget, Plan& plan);
bool search_profile(const ManeuverProblem& problem, const ManeuverBody& body, const PlannerOptions& options,
                    SearchBudget& budget, Plan& plan);

}  // namespace slew
