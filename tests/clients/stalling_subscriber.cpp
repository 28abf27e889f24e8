// A client that nobody should notice: it subscribes to all telemetry, reliably, and after a while takes
// nothing any more; or dies without a word.
#include <thread>

#include "idl/wire/reader.hpp"
#include "idl/wire/waitset.hpp"
#include "tests/clients/arguments.hpp"

int main(int argc, char** argv) {
  using namespace slew;
  using namespace slew::clients;
  Arguments arguments("Subscribes to all telemetry and stops taking it, or dies without saying so.");
  double after_s = 1;
  bool lossless = false, die = false;
  arguments.app.add_option("--after", after_s, "seconds of reading before it stalls")->capture_default_str();
  arguments.app.add_flag("--lossless", lossless, "as a reader that lets nothing give way");
  arguments.app.add_flag("--die", die, "at the end, without leaving the domain");
  if (!arguments.parse(argc, argv)) return arguments.exit_code;
  try {
    const wire::Domain domain(arguments.domain());
    const auto delivery = lossless ? wire::Delivery::lossless : wire::Delivery::reliable;
    wire::Reader<slew_v1_State> state(domain, delivery);
    wire::Reader<slew_v1_Thrusters> thrusters(domain, delivery);
    wire::Waitset waitset(domain);
    waitset.attach(state.entity());
    waitset.attach(thrusters.entity());
    std::size_t taken = 0;
    const auto until = after(arguments.for_s), stall = std::min(until, after(after_s));
    while (Clock::now() < stall) {
      waitset.wait(std::chrono::milliseconds(20));
      state.take([&](const slew_v1_State&, const dds_sample_info_t&) { ++taken; });
      thrusters.take([&](const slew_v1_Thrusters&, const dds_sample_info_t&) { ++taken; });
    }
    std::this_thread::sleep_until(until);
    arguments.report({{"batches_taken", taken}});
    std::cout.flush();
    if (die) std::_Exit(kAllWell);
    // DDS does not let go of a reader while it waits for room in another one's cache.
    state.take([](const slew_v1_State&, const dds_sample_info_t&) {}, SIZE_MAX);
    thrusters.take([](const slew_v1_Thrusters&, const dds_sample_info_t&) {}, SIZE_MAX);
    return kAllWell;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return kNoServer;
  }
}
