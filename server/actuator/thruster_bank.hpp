// Thrusters at work: valves that open and close late, thrust that rises and falls, noise, faults, a tank that
// runs empty. Between two of its times the torque is linear in time.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/actuator/thruster_set.hpp"
#include "server/random/random_stream.hpp"

namespace slew {

/// Expects at most kMaxThrusters. Misalignment and noise are drawn from `seed`; copies go on with the same
/// draws. Nothing allocates after construction.
class ThrusterBank {
 public:
  ThrusterBank(std::vector<Thruster> thrusters, const Propellant& propellant, std::uint64_t seed);

  std::size_t size() const { return model_->thrusters.size(); }
  const Thruster& thruster(std::size_t j) const { return model_->thrusters[j]; }
  /// The shortest command that the minimum on-time lets pass, s.
  double shortest_command_s(std::size_t j) const;

  /// The valve of j is told at t to open or to close. A closing that would reach the valve before its opening
  /// takes the opening back. False where too many commands are on their way already.
  [[nodiscard]] bool command(double t_s, std::size_t j, bool is_open);
  /// Everything that is due at t.
  void arrive(double t_s);
  /// The next time at which something is due; infinity where nothing is.
  double next_s() const { return next_s_; }
  bool is_open(std::size_t j) const { return states_[j].is_open; }
  bool is_empty() const { return is_empty_; }

  /// T and dT/dt of the piece that began at the latest arrive() or command(), N m and N m/s.
  const Eigen::Vector3d& torque_N_m() const { return torque_N_m_; }
  const Eigen::Vector3d& torque_slope_N_m_s() const { return slope_N_m_s_; }
  double piece_began_s() const { return began_s_; }
  Eigen::Vector3d torque_at(double t_s) const { return torque_N_m_ + (t_s - began_s_) * slope_N_m_s_; }
  /// Of full thrust.
  double level_at(std::size_t j, double t_s) const;

  double on_time_s(std::size_t j, double t_s) const;
  std::uint64_t firings(std::size_t j) const { return states_[j].firings; }
  /// Integral of the thrust over full thrust, s.
  double impulse_s(std::size_t j, double t_s) const;
  /// Empty without specific impulse.
  std::optional<double> propellant_kg(double t_s) const;

 private:
  struct Model {
    std::vector<Thruster> thrusters;
    std::vector<Eigen::Vector3d> torque_N_m;  ///< at full thrust, as mounted in truth
    Propellant propellant;
    std::vector<RandomStream> noise;
  };
  static constexpr std::size_t kOnTheirWay = 16;
  struct Arrival {
    double at_s;
    bool is_open;
  };
  struct State {
    std::array<Arrival, kOnTheirWay> arrivals{};
    std::size_t first = 0, count = 0;
    bool is_told_open = false;  ///< by what has arrived; a stuck valve does not listen
    bool is_open = false;
    double opened_s = 0;   ///< when, if it is open
    double on_time_s = 0;  ///< of the firings that have ended
    std::uint64_t firings = 0;
    double full = 1;  ///< level of the present firing
    // Level from `since_s` on: level + slope (t - since), until `until_s`.
    double level = 0, slope_1_s = 0, since_s = 0, until_s = 0;
    double impulse_s = 0;  ///< until since_s
  };

  double mass_flow_kg_s(std::size_t j) const;
  void set_valve(double t_s, std::size_t j);
  void move_to(double t_s, std::size_t j, double target);
  void begin_piece(double t_s);
  double empty_s(double t_s) const;

  std::shared_ptr<const Model> model_;
  std::array<State, kMaxThrusters> states_{};
  bool is_empty_ = false;
  double next_s_ = 0;
  double began_s_ = 0;
  Eigen::Vector3d torque_N_m_ = Eigen::Vector3d::Zero(), slope_N_m_s_ = Eigen::Vector3d::Zero();
};

}  // namespace slew
