// A client that listens: counts every sample of every experiment, checks what can be checked of a stream, and
// compares its counts with what the server says it sent.
#include <cmath>
#include <map>

#include "client/library/telemetry.hpp"
#include "idl/wire/phase.hpp"
#include "idl/wire/text.hpp"
#include "tests/clients/arguments.hpp"

namespace {

using namespace slew;
using namespace slew::clients;
using nlohmann::json;

struct Recorded {
  std::uint64_t states = 0, thrusters = 0;
  double last_state_s = -1, last_thrusters_s = -1;
  std::uint64_t out_of_order = 0, not_finite = 0, wrong_width = 0, without_unit = 0;
  slew_v1_Experiment status{};
  bool has_status = false;

  bool is_sound() const { return out_of_order + not_finite + wrong_width + without_unit == 0; }
  bool has_ended() const { return has_status && wire::is_terminal(status.phase); }
};

class Recorder {
 public:
  Recorder(const wire::Domain& domain, wire::Delivery delivery) : telemetry_(domain, delivery) {}

  void listen(double for_s, std::size_t until_ended) {
    const auto until = after(for_s);
    const client::Telemetry::Listener listener{
        .state =
            [this](const wire::Id& id, const client::Stream& stream, double t_s,
                   std::span<const double> row) {
              Recorded& one = recorded_[id];
              ++one.states;
              check(one, stream.state, one.last_state_s, t_s, row);
            },
        .thrusters =
            [this](const wire::Id& id, const client::Stream& stream, double t_s,
                   std::span<const double> row) {
              Recorded& one = recorded_[id];
              ++one.thrusters;
              check(one, stream.thrusters, one.last_thrusters_s, t_s, row);
            },
        .experiment =
            [this](const slew_v1_Experiment& status) {
              Recorded& one = recorded_[wire::Id::from(status.experiment_id)];
              const bool had_ended = one.has_ended();
              one.status = status;
              one.has_status = true;
              ended_ += !had_ended && one.has_ended();
            }};
    while (Clock::now() < until && (until_ended == 0 || ended_ < until_ended))
      telemetry_.poll(std::chrono::milliseconds(100), listener);
    // What was sent before the last word may still be on its way.
    const auto settled = std::min(until, after(0.3));
    while (Clock::now() < settled) telemetry_.poll(std::chrono::milliseconds(50), listener);
  }

  json report() const {
    json experiments = json::array();
    for (const auto& [id, one] : recorded_) {
      const auto stream = telemetry_.streams().find(id);
      const bool is_known = stream != telemetry_.streams().end();
      experiments.push_back({{"experiment_id", id.hex()},
                             {"phase", one.has_status ? json(wire::phase_name(one.status.phase)) : json()},
                             {"received", one.states},
                             {"thrusters_received", one.thrusters},
                             {"lost", is_known ? stream->second.lost : 0},
                             {"published", one.status.published},
                             {"dropped", one.status.dropped},
                             {"sampled", one.status.sampled},
                             {"slices", one.status.slices},
                             {"lateness_p50_s", one.status.lateness_p50_s},
                             {"lateness_p99_s", one.status.lateness_p99_s},
                             {"lateness_max_s", one.status.lateness_max_s},
                             {"out_of_order", one.out_of_order},
                             {"not_finite", one.not_finite},
                             {"wrong_width", one.wrong_width},
                             {"without_unit", one.without_unit}});
    }
    return {{"experiments", std::move(experiments)},
            {"ended", ended_},
            {"sound", is_sound()},
            {"missing", missing()}};
  }

  bool is_sound() const {
    return std::all_of(recorded_.begin(), recorded_.end(),
                       [](const auto& entry) { return entry.second.is_sound(); });
  }
  /// Samples that ended experiments published and that did not arrive here.
  std::uint64_t missing() const {
    std::uint64_t total = 0;
    for (const auto& [id, one] : recorded_)
      if (one.has_ended() && one.status.published > one.states) total += one.status.published - one.states;
    return total;
  }

 private:
  static void check(Recorded& one, const std::vector<client::ChannelName>& channels, double& last_s,
                    double t_s, std::span<const double> row) {
    one.out_of_order += t_s <= last_s;
    last_s = t_s;
    one.wrong_width += row.size() != channels.size();
    one.not_finite += !std::isfinite(t_s);
    for (const double value : row) one.not_finite += !std::isfinite(value);
    for (const client::ChannelName& channel : channels)
      one.without_unit += channel.name.empty() || channel.unit.empty();
  }

  client::Telemetry telemetry_;
  std::map<wire::Id, Recorded> recorded_;
  std::size_t ended_ = 0;
};

void print_table(const json& report) {
  std::printf("%-32s %-11s %9s %9s %6s %8s %9s %9s %9s\n", "experiment", "phase", "received", "published",
              "lost", "dropped", "p50, us", "p99, us", "max, us");
  for (const json& one : report.at("experiments"))
    std::printf("%-32s %-11s %9ld %9ld %6ld %8ld %9.0f %9.0f %9.0f\n",
                one.at("experiment_id").get<std::string>().c_str(),
                one.at("phase").is_string() ? one.at("phase").get<std::string>().c_str() : "-",
                one.at("received").get<long>(), one.at("published").get<long>(), one.at("lost").get<long>(),
                one.at("dropped").get<long>(), 1e6 * one.at("lateness_p50_s").get<double>(),
                1e6 * one.at("lateness_p99_s").get<double>(), 1e6 * one.at("lateness_max_s").get<double>());
  std::printf("%ld ended, %ld samples missing, %s\n", report.at("ended").get<long>(),
              report.at("missing").get<long>(),
              report.at("sound").get<bool>() ? "all of them sound" : "NOT ALL SOUND");
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments(
      "Records all telemetry and checks units, order, widths and counts.\n"
      "Exit code 1 when a check failed, and with --strict when a published sample did not arrive.");
  std::size_t until_ended = 0;
  bool best_effort = false, lossless = false, strict = false;
  auto& app = arguments.app;
  app.add_option("--until-ended", until_ended, "stop when so many experiments have ended");
  app.add_flag("--best-effort", best_effort, "do not ask for what was lost");
  app.add_flag("--lossless", lossless, "hold up lossless streams rather than lose a sample");
  app.add_flag("--strict", strict, "a missing sample is a failure");
  if (!arguments.parse(argc, argv)) return arguments.exit_code;
  try {
    const wire::Domain domain(arguments.domain());
    Recorder recorder(domain, lossless      ? wire::Delivery::lossless
                              : best_effort ? wire::Delivery::best_effort
                                            : wire::Delivery::reliable);
    recorder.listen(arguments.for_s, until_ended);
    const json report = recorder.report();
    if (arguments.json)
      arguments.report(report);
    else
      print_table(report);
    return recorder.is_sound() && (!strict || recorder.missing() == 0) ? kAllWell : kSomethingLost;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return kNoServer;
  }
}
