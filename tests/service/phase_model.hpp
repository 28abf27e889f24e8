// What is known of an experiment's phase from what was done to it: the rules, without threads, clocks or
// wires.
#pragma once

#include <string>

#include "idl/wire/phase.hpp"

namespace slew::test {

/// One experiment as the rules see it. It never ends by itself, unless it is a short one that is let go.
struct PhaseModel {
  bool is_paced = false;
  bool starts_held = false;
  bool runs_again = false;  ///< when it is paced: after a restart
  bool expires = false;     ///< if it does not begin soon

  wire::Phase phase = slew_v1_HELD;
  bool has_begun = false;

  void submitted() {
    has_begun = !starts_held;
    phase = starts_held ? slew_v1_HELD : flies();
    if (expires && starts_held) phase = slew_v1_EXPIRED;
  }
  bool has_ended() const { return wire::is_terminal(phase); }

  // ---- controls, each with the code that it is answered with ----------------------------------------------
  std::string cancel() { return alive(slew_v1_CANCELLED); }
  std::string pause() { return alive(phase == slew_v1_RUNNING ? slew_v1_PAUSED : phase); }
  std::string resume() {
    has_begun = has_begun || !has_ended();
    return alive(flies());
  }
  /// By less than what is left of it.
  std::string step() {
    has_begun = has_begun || !has_ended();
    return alive(slew_v1_PAUSED);
  }
  std::string rate() const { return has_ended() || !is_paced ? "not_possible" : "ok"; }

  void restarted() {
    if (has_ended()) return;
    if (is_paced && !runs_again)
      phase = slew_v1_INTERRUPTED;
    else
      submitted();
  }

 private:
  wire::Phase flies() const { return is_paced ? slew_v1_RUNNING : slew_v1_COMPLETED; }
  std::string alive(wire::Phase next) {
    if (has_ended()) return "not_possible";
    phase = next;
    return "ok";
  }
};

}  // namespace slew::test
