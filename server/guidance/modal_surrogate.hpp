// A surrogate for the vibration that a maneuver leaves behind: modes that the body's angular acceleration
// drives, eta'' + 2 zeta W eta' + W^2 eta = -n.w'. Figs. 6 and 7 of Vadali, Singh & Carter 1993 come from a
// finite-element model that is not printed; with its frequencies (3.4, 4.8, 10.25 Hz) this tells maneuvers
// apart, and no more.
#pragma once

#include "server/control/control_history.hpp"
#include "server/guidance/maneuver_problem.hpp"

namespace slew {

struct SurrogateMode {
  double frequency_rad_s = 1;
  double damping_ratio = 0;                         ///< |zeta| < 1
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< n, of norm 1
};

struct SurrogateResponse {
  double peak_rad = 0;      ///< the largest |eta| during the maneuver
  double residual_rad = 0;  ///< amplitude at its end
};

/// At rest to begin with; exact for an acceleration that is linear between a few points of each period.
std::vector<SurrogateResponse> surrogate_responses(const ManeuverProblem& problem,
                                                   const ControlHistory& history,
                                                   const std::vector<SurrogateMode>& modes);

/// eta of every mode at `times_s` (ascending, within the maneuver), rad.
std::vector<std::vector<double>> surrogate_histories(const ManeuverProblem& problem,
                                                     const ControlHistory& history,
                                                     const std::vector<SurrogateMode>& modes,
                                                     const std::vector<double>& times_s);

}  // namespace slew
