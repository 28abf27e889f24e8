#include "client/slewctl/exit_code.hpp"

namespace slew::ctl {

ExitCode exit_code(wire::Phase phase, std::string_view code) {
  switch (phase) {
    case slew_v1_REJECTED:
      return code == "busy" || code == "draining" || code == "unavailable" ? kBusy : kRefused;
    case slew_v1_FAILED:
      return kRunFailed;
    case slew_v1_CANCELLED:
      return kCancelled;
    case slew_v1_INTERRUPTED:
      return kInterrupted;
    case slew_v1_EXPIRED:
      return kTimedOut;
    default:
      return kDone;
  }
}

}  // namespace slew::ctl
