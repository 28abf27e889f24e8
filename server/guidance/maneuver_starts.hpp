// Where to begin looking for an on-off maneuver. Each control is taken for a double integrator of its own
// that is to be displaced by its share of the eigenaxis rotation, v_i = (B^-1 I l)_i angle (Vadali, Singh &
// Carter 1993, Eq. 6): how often it switches is a choice, when then follows, and the critical control
// switches once.
#pragma once

#include "server/guidance/maneuver_bounds.hpp"
#include "server/guidance/on_off_flight.hpp"
#include "server/random/random_stream.hpp"

namespace slew {

class ManeuverStarts {
 public:
  ManeuverStarts(const ManeuverProblem& problem, const ManeuverBody& body, std::uint64_t seed);

  /// The k-th start. The first ones go through the corners of the control cube in order; all of them are
  /// spread at random about what the double integrators want.
  OnOffProgram start(std::uint64_t k) const;
  /// Of given sequences.
  OnOffProgram start_of(const std::vector<SwitchSequence>& sequences, std::uint64_t k) const;

  /// The eigenaxis maneuver, which always arrives: the controls' means over `slots` equal parts of its time.
  bool turns_about_the_eigenaxis() const;
  OnOffProgram about_the_eigenaxis(int slots) const;

  const EigenaxisManeuver& eigenaxis() const { return eigenaxis_; }

 private:
  double time(double draw) const;
  double share(std::size_t i, double time_s) const;
  OnOffProgram switching(std::uint64_t k) const;
  OnOffProgram anywhere(std::uint64_t k) const;
  OnOffProgram with_coasts(const OnOffProgram& program) const;
  OnOffProgram coasting(std::uint64_t k) const;
  double draw(std::uint64_t k, std::uint32_t which) const;
  double value(std::size_t i, int sign) const;

  const ManeuverProblem* problem_;
  const ManeuverBody* body_;
  RandomStream random_;
  EigenaxisManeuver eigenaxis_;
};

}  // namespace slew
