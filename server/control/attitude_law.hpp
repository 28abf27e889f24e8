// The attitude laws that a request may name: a line for each.
#pragma once

#include <type_traits>
#include <variant>

#include "server/control/linear_surface.hpp"
#include "server/control/quaternion_feedback.hpp"
#include "server/control/rate_damping.hpp"
#include "server/control/sliding_mode.hpp"
#include "server/control/torque_program.hpp"

namespace slew {

using AttitudeLaw = std::variant<SlidingMode,         //
                                 LinearSurface,       //
                                 QuaternionFeedback,  //
                                 RateDamping,         //
                                 TorqueProgram>;

template <typename Scalar>
AttitudeCommand<Scalar> command(const AttitudeLaw& law, const AttitudeSight<Scalar>& sight) {
  return std::visit([&](const auto& held) { return held.command(sight); }, law);
}

/// The first time after t at which the law itself changes; infinity for one that does not depend on time.
inline double next_change_s(const AttitudeLaw& law, double t_s) {
  return std::visit([&](const auto& held) { return held.next_change_s(t_s); }, law);
}

inline const char* type_name(const AttitudeLaw& law) {
  return std::visit([](const auto& held) { return std::decay_t<decltype(held)>::kType; }, law);
}

inline bool has_surface(const AttitudeLaw& law) {
  return std::visit([](const auto& held) { return std::decay_t<decltype(held)>::kHasSurface; }, law);
}

inline bool tracks(const AttitudeLaw& law) {
  return std::visit([](const auto& held) { return std::decay_t<decltype(held)>::kTracks; }, law);
}

inline bool is_program(const AttitudeLaw& law) {
  return std::visit([](const auto& held) { return std::decay_t<decltype(held)>::kIsProgram; }, law);
}

}  // namespace slew
