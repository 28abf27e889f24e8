// watch: live telemetry, as one screen, as lines, or as JSON lines.
#include <unistd.h>

#include <csignal>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "client/library/telemetry.hpp"
#include "client/slewctl/commands.hpp"
#include "client/slewctl/connection.hpp"
#include "client/slewctl/terminal.hpp"
#include "idl/wire/text.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t stopped = 0;

// The latest of one experiment.
struct Seen {
  slew_v1_Experiment status{};
  bool has_status = false;
  double t_s = 0;
  std::vector<double> state;
  std::vector<double> thrusters;
  bool is_new = false;  ///< since it was shown last
};

class Screen {
 public:
  Screen(const Options& options, std::set<wire::Id> wanted)
      : options_(options), wanted_(std::move(wanted)), is_terminal_(isatty(STDOUT_FILENO)) {}

  bool is_wanted(const wire::Id& id) const { return options_.all || wanted_.contains(id); }

  void on_status(const slew_v1_Experiment& status) {
    const auto id = wire::Id::from(status.experiment_id);
    if (!is_wanted(id)) return;
    Seen& seen = seen_[id];
    seen.status = status;
    seen.has_status = seen.is_new = true;
  }
  void on_state(const wire::Id& id, const client::Stream& stream, double t_s, std::span<const double> row) {
    if (!is_wanted(id)) return;
    Seen& seen = seen_[id];
    seen.t_s = t_s;
    seen.state.assign(row.begin(), row.end());
    seen.is_new = true;
    if (options_.csv) csv(id, stream, t_s, row);
  }
  void on_thrusters(const wire::Id& id, std::span<const double> row) {
    if (is_wanted(id)) seen_[id].thrusters.assign(row.begin(), row.end());
  }

  bool all_have_ended() const {
    if (options_.all) return false;
    for (const wire::Id& id : wanted_) {
      const auto place = seen_.find(id);
      if (place == seen_.end() || !place->second.has_status || !wire::is_terminal(place->second.status.phase))
        return false;
    }
    return true;
  }

  void draw(const client::Telemetry& telemetry) {
    if (options_.csv) {
      std::cout.flush();
    } else if (options_.json) {
      json_lines(telemetry);
    } else {
      table_of_all(telemetry);
    }
  }

 private:
  void csv(const wire::Id& id, const client::Stream& stream, double t_s, std::span<const double> row) {
    if (!stream.state.empty() && stream.state.size() == row.size() && has_heading_.insert(id).second) {
      std::cout << "experiment_id,t_s";
      for (const auto& channel : stream.state) std::cout << ',' << channel.name;
      std::cout << '\n';
    }
    std::cout << id.hex() << ',' << json(t_s).dump();
    for (const double value : row) std::cout << ',' << json(value).dump();
    std::cout << '\n';
  }

  void json_lines(const client::Telemetry& telemetry) {
    for (auto& [id, seen] : seen_) {
      if (!seen.is_new) continue;
      seen.is_new = false;
      json line = {{"experiment_id", id.hex()}, {"t_s", seen.t_s}};
      if (seen.has_status) {
        line["phase"] = wire::phase_name(seen.status.phase);
        line["progress"] = seen.status.progress;
        line["t_sim_s"] = seen.status.t_sim_s;
        line["published"] = seen.status.published;
        line["dropped"] = seen.status.dropped;
      }
      if (const auto stream = telemetry.streams().find(id); stream != telemetry.streams().end()) {
        line["lost"] = stream->second.lost;
        for (std::size_t i = 0; i < std::min(stream->second.state.size(), seen.state.size()); ++i)
          line["state"][stream->second.state[i].name] = seen.state[i];
        for (std::size_t i = 0; i < std::min(stream->second.thrusters.size(), seen.thrusters.size()); ++i)
          line["thrusters"][stream->second.thrusters[i].name] = seen.thrusters[i];
      }
      std::cout << line.dump() << '\n';
    }
    std::cout.flush();
  }

  void table_of_all(const client::Telemetry& telemetry) {
    std::vector<std::vector<std::string>> rows{
        {"experiment", "phase", "progress", "t, s", "rate", "late p99, us", "sent", "dropped", "state"}};
    bool any_new = false;
    for (auto& [id, seen] : seen_) {
      any_new |= seen.is_new;
      // Off a terminal only what is new is worth a line.
      if (!is_terminal_ && !seen.is_new) continue;
      seen.is_new = false;
      const auto& status = seen.status;
      std::string state;
      if (const auto stream = telemetry.streams().find(id); stream != telemetry.streams().end())
        for (std::size_t i = 0;
             i < std::min<std::size_t>({3, stream->second.state.size(), seen.state.size()}); ++i)
          state += (i ? "  " : "") + stream->second.state[i].name + " " + number(seen.state[i]);
      rows.push_back({id.hex().substr(0, 16), std::string(wire::phase_name(status.phase)),
                      bar(status.progress, 12), number(std::max(seen.t_s, status.t_sim_s)),
                      number(status.rate_achieved), number(1e6 * status.lateness_p99_s),
                      std::to_string(status.published), std::to_string(status.dropped), state});
    }
    if (is_terminal_) {
      std::cout << "\x1b[H\x1b[2J" << table(rows) << std::flush;
    } else if (any_new) {
      std::string text = table(rows);
      if (lines_ > 0) text.erase(0, text.find('\n') + 1);
      ++lines_;
      std::cout << text << std::flush;
    }
  }

  const Options& options_;
  const std::set<wire::Id> wanted_;
  const bool is_terminal_;
  std::map<wire::Id, Seen> seen_;
  std::set<wire::Id> has_heading_;
  std::size_t lines_ = 0;
};

}  // namespace

int watch(const Options& options) {
  if (!options.all && options.ids.empty()) throw Stop{kRefused, "watch what? Give ids, or --all"};
  const auto session = connect(options);
  std::set<wire::Id> wanted;
  for (const std::string& id : options.ids)
    if (const auto whole =
            wire::Id::parse(ask(*session, "show", {{"id", id}}).at("experiment_id").get<std::string>()))
      wanted.insert(*whole);

  Screen screen(options, std::move(wanted));
  client::Telemetry telemetry(session->domain());
  std::signal(SIGINT, [](int) { stopped = 1; });
  std::signal(SIGTERM, [](int) { stopped = 1; });
  const auto period = seconds(1 / options.rate_hz);
  const auto begin = Clock::now();
  auto next = begin;
  const client::Telemetry::Listener listener{
      .state = [&](const wire::Id& id, const client::Stream& stream, double t_s,
                   std::span<const double> row) { screen.on_state(id, stream, t_s, row); },
      .thrusters = [&](const wire::Id& id, const client::Stream&, double,
                       std::span<const double> row) { screen.on_thrusters(id, row); },
      .experiment = [&](const slew_v1_Experiment& status) { screen.on_status(status); }};
  while (stopped == 0) {
    telemetry.poll(
        std::max(client::Duration(0), std::chrono::duration_cast<client::Duration>(next - Clock::now())),
        listener);
    const bool is_over =
        screen.all_have_ended() || (options.for_s && Clock::now() - begin > seconds(*options.for_s));
    if (Clock::now() < next && !is_over) continue;
    screen.draw(telemetry);
    if (is_over) break;
    next = Clock::now() + period;
  }
  return kDone;
}

}  // namespace slew::ctl
