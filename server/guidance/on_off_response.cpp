#define EIGEN_NO_DEBUG  // as in on_off_flight.cpp
#include "server/guidance/on_off_variation.hpp"

namespace slew {

void OnOffFlight::fly_with_response(const OnOffProgram& program, const RigidState& start, bool with_middles) {
  if (body_->plant.is_free())
    fly_as<Variation<3, 3>>(program, start, 0, with_middles);
  else
    fly_as<Variation<6, 3>>(program, start, 0, with_middles);
}

}  // namespace slew
