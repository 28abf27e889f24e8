// The continuous part of a three-axis loop: its state, and what moves it between two discrete changes.
//   state = attitude (p, or q with the scalar first), w, filters of a pulse-width pulse-frequency modulator,
//           Q of a disturbance observer (three vectors)
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "server/actuator/thruster_allocation.hpp"
#include "server/simulation/attitude.hpp"

namespace slew {

inline constexpr std::size_t kMaxAttitudeState = 4 + 3 + kMaxThrusters + 9;
using AttitudeState = std::array<double, kMaxAttitudeState>;

/// A channel of the modulator: a pair about an axis, or one thruster.
struct ModulatorChannel {
  double level;    ///< N m, or N
  bool is_signed;  ///< a pair
};

/// What is held while the state moves.
struct AttitudeHold {
  double began_s = 0;
  Eigen::Vector3d disturbance_N_m = Eigen::Vector3d::Zero();  ///< its constant part
  /// Torque of thrusters, or held by a sampled law: T + (t - torque_began) slope.
  Eigen::Vector3d torque_N_m = Eigen::Vector3d::Zero(), torque_slope_N_m_s = Eigen::Vector3d::Zero();
  double torque_began_s = 0;
  std::array<int, kMaxThrusters> outputs{};  ///< of the channels
};

/// What the law, and the observer behind it, ask for.
struct AttitudeDemand {
  AttitudeCommand<double> law;
  Eigen::Vector3d estimate_N_m = Eigen::Vector3d::Zero();  ///< of the disturbance
  Eigen::Vector3d torque_N_m = Eigen::Vector3d::Zero();    ///< law minus estimate
};

/// Immutable; what differs between runs of one specification is in state and hold.
class AttitudeLoop {
 public:
  explicit AttitudeLoop(const AttitudeSpecification& specification);

  const AttitudeSpecification& specification() const { return spec_; }
  const Eigen::Matrix3d& inverse_inertia() const { return inverse_inertia_; }
  std::span<const ModulatorChannel> channels() const { return channels_; }
  const PwpfModulator* pwpf() const;
  const Modulator* modulator() const { return modulator_; }
  bool is_sampled() const { return spec_.sample_period_s.has_value(); }
  /// The law acts at every instant, not at its samples only.
  bool acts_within_steps() const { return acts_within_steps_; }

  std::size_t attitude_size() const { return attitude_size_; }
  std::size_t rate_at() const { return attitude_size_; }
  std::size_t filters_at() const { return attitude_size_ + 3; }
  std::size_t filters() const { return filters_; }
  std::size_t observer_at() const { return filters_at() + filters_; }
  /// Filters that no observer looks through follow the body's motion and do not act on it
  /// (attitude_filters.hpp).
  bool filters_are_apart() const { return filters_ > 0 && !observes_; }
  /// How much of the state moves as one: all of it, or the body.
  std::size_t integrated() const { return filters_are_apart() ? filters_at() : size(); }
  std::size_t size() const { return observer_at() + (observes_ ? 9 : 0); }

  AttitudeState initial_state() const;
  /// Scales for a propagator's error below which a component counts as zero: `relative` of what they are
  /// here.
  AttitudeState absolute_tolerances(double relative) const;

  Eigen::Vector3d mrp_of(const double* state) const;
  Eigen::Vector3d rate_of(const double* state) const {
    return Eigen::Map<const Eigen::Vector3d>(state + rate_at());
  }
  /// Of a law evaluated continuously.
  AttitudeDemand demand(const AttitudeHold& hold, double t_s, const double* state) const;
  /// q of the body relative to the frame of reference.
  Vector4<double> attitude_of(const double* state) const;
  /// Of any torque, what each control gives of it, as a part of its most; N m where there is no most.
  Eigen::Vector3d controls(const Eigen::Vector3d& torque_N_m) const;
  /// By channel, N m or N.
  void allocate(const AttitudeHold& hold, double t_s, const Eigen::Vector3d& torque_N_m,
                std::span<double> demands) const;
  /// What the filter of a channel settles at under a demand held for ever.
  double filter_limit(std::size_t channel, double demand, int output) const;
  Eigen::Vector3d limited(const Eigen::Vector3d& torque_N_m) const;
  /// T that acts at t on a state; `demand` is looked at where any torque may be had.
  Eigen::Vector3d torque(const AttitudeHold& hold, double t_s, const AttitudeDemand& demand) const;
  static Eigen::Vector3d held_torque(const AttitudeHold& hold, double t_s) {
    return hold.torque_N_m + (t_s - hold.torque_began_s) * hold.torque_slope_N_m_s;
  }
  void slope(const AttitudeHold& hold, double t_s, const AttitudeState& state, AttitudeState& slope) const;
  /// s of the law at a state; zero where it has none.
  Eigen::Vector3d surface(const AttitudeHold& hold, double t_s, const double* state) const;
  /// The other set of parameters of the same attitude.
  void switch_to_shadow(AttitudeState& state) const;
  /// Keeps what the observer has estimated where s has jumped.
  void jump(AttitudeState& state, const Eigen::Vector3d& surface_jump_rad_s) const;

 private:
  void move_body(const AttitudeHold& hold, double t_s, const Eigen::Vector3d& torque_N_m,
                 const AttitudeState& state, AttitudeState& slope) const;

  const AttitudeSpecification spec_;
  const Eigen::Matrix3d inverse_inertia_;
  const std::optional<Eigen::Matrix3d> demand_of_torque_;
  const IdealTorque* ideal_ = nullptr;
  const Modulator* modulator_ = nullptr;
  std::optional<ThrusterAllocation> allocation_;
  std::vector<ModulatorChannel> channels_;
  std::size_t attitude_size_ = 3, filters_ = 0;
  bool observes_ = false, acts_within_steps_ = false, needs_law_ = false;
};

/// The thrusters that the channels command: of a pair the positive one first.
std::vector<Thruster> thrusters_of(const AttitudeActuator& actuator);
const Propellant* propellant_of(const AttitudeActuator& actuator);

}  // namespace slew
