// The time from a command to its torque (Bryson 1994, Fig. 3.5): commands on their way through a valve.
#pragma once

#include <array>
#include <cstddef>

namespace slew {

/// Holds a fixed number of commands, so that a step allocates nothing.
class SwitchingDelay {
 public:
  static constexpr std::size_t kCommands = 64;

  bool is_idle() const { return count_ == 0; }
  bool is_full() const { return count_ == kCommands; }
  /// When the next one arrives. Expects one on its way.
  double next_s() const { return commands_[first_].at_s; }
  /// Expects room, and a time not before those of the commands on their way.
  void send(double at_s, int u) { commands_[(first_ + count_++) % kCommands] = {at_s, u}; }
  int arrive() {
    const int u = commands_[first_].u;
    first_ = (first_ + 1) % kCommands;
    --count_;
    return u;
  }

 private:
  struct Command {
    double at_s;
    int u;
  };
  std::array<Command, kCommands> commands_{};
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace slew
