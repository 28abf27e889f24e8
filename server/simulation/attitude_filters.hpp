// The lags of a pulse-width pulse-frequency modulator under a law evaluated continuously. Thrust is held
// while the body moves, so the body does not feel what the law asks for; the law is asked at a few places of
// a step of the body's, and the lags follow what it asks for in closed form.
#pragma once

#include <array>
#include <functional>
#include <optional>

#include "server/propagation/dormand_prince.hpp"
#include "server/propagation/lagged_input.hpp"
#include "server/simulation/attitude_loop.hpp"

namespace slew {

/// Over one step. Nothing allocates.
class AttitudeFilters {
 public:
  using Body = DormandPrince<kMaxAttitudeState>;
  struct Crossing {
    double x;  ///< of the step
    std::size_t channel;
    int output;
  };

  struct Outcome {
    bool is_taken;  ///< or to be tried again, over `length`
    double length;  ///< s
    double next;    ///< what a quartic would follow, s
  };
  /// Asks the law where a step begins. Returns when the first filter would change its channel if what is
  /// asked for stayed as it is; infinity where none would.
  double begin(const AttitudeLoop& loop, const AttitudeHold& hold, double t_s, const AttitudeState& state,
               const std::array<bool, kMaxThrusters>& is_free);
  /// Through the body's step of length h from there on, with what is held. A corner of the law ends a step,
  /// and so does what a quartic does not follow. Expects begin().
  Outcome step(const AttitudeLoop& loop, const AttitudeHold& hold, double t_s, double h, Body& body,
               const double* filters);
  /// The first of the channels that are free to change it.
  std::optional<Crossing> first_crossing(const AttitudeLoop& loop, const AttitudeHold& hold,
                                         const std::array<bool, kMaxThrusters>& is_free) const;
  double at(std::size_t channel, double x) const { return lags_[channel].at(x); }

 private:
  struct Place {
    std::array<double, kMaxThrusters> demands;
    Eigen::Vector3d surface_rad_s;
  };
  static void ask(const AttitudeLoop& loop, const AttitudeHold& hold, double t_s, const double* state,
                  Place& place);
  std::optional<double> first_corner(const AttitudeLoop& loop) const;

  std::array<Place, 5> places_;
  std::array<LaggedInput, kMaxThrusters> lags_;
};

}  // namespace slew
