// The attitude laws that a request may name: a line for each.
#pragma once

#include <optional>
#include <type_traits>
#include <variant>

#include "server/control/linear_surface.hpp"
#include "server/control/planned_torque.hpp"
#include "server/control/quaternion_feedback.hpp"
#include "server/control/rate_damping.hpp"
#include "server/control/sliding_mode.hpp"
#include "server/control/torque_program.hpp"

namespace slew {

using AttitudeLaw = std::variant<SlidingMode,         //
                                 LinearSurface,       //
                                 QuaternionFeedback,  //
                                 RateDamping,         //
                                 TorqueProgram,       //
                                 PlannedTorque>;

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

/// Where |s| has grown to it the law has a corner; empty for one without.
inline std::optional<double> boundary_layer_rad_s(const AttitudeLaw& law) {
  return std::visit(
      [](const auto& held) -> std::optional<double> {
        if constexpr (requires { held.boundary_layer_rad_s; }) return held.boundary_layer_rad_s;
        return std::nullopt;
      },
      law);
}

inline bool tracks(const AttitudeLaw& law) {
  return std::visit([](const auto& held) { return std::decay_t<decltype(held)>::kTracks; }, law);
}

inline bool is_program(const AttitudeLaw& law) {
  return std::visit([](const auto& held) { return std::decay_t<decltype(held)>::kIsProgram; }, law);
}

}  // namespace slew
