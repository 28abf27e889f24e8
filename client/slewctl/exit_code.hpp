// What a program can tell from how slewctl ended. Stable.
#pragma once

#include "idl/wire/phase.hpp"

namespace slew::ctl {

enum ExitCode {
  kDone = 0,
  kRunFailed = 1,
  kRefused = 2,   ///< or bad usage
  kNoServer = 3,  ///< or not permitted
  kTimedOut = 4,
  kCancelled = 5,
  kInterrupted = 6,
  kBusy = 7,
};

/// For a request's last word: its phase and the code in the reply.
ExitCode exit_code(wire::Phase phase, std::string_view code);

}  // namespace slew::ctl
