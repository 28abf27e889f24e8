// cancel, pause, resume, step, rate.
#include <iostream>
#include <nlohmann/json.hpp>

#include "client/slewctl/commands.hpp"
#include "client/slewctl/connection.hpp"
#include "client/slewctl/exit_code.hpp"

namespace slew::ctl {
namespace {

client::Action action_of(Command command) {
  switch (command) {
    case Command::pause:
      return client::Action::pause;
    case Command::resume:
      return client::Action::resume;
    case Command::step:
      return client::Action::step;
    case Command::rate:
      return client::Action::rate;
    default:
      return client::Action::cancel;
  }
}

}  // namespace

int control(const Options& options) {
  const auto session = connect(options);
  // The beginning of an id is enough for people; the wire wants the whole.
  const auto shown = ask(*session, "show", {{"id", options.ids.front()}});
  const auto id = wire::Id::parse(shown.at("experiment_id").get<std::string>());
  if (!id) throw Stop{kRunFailed, "the server's answer has no experiment_id"};
  const auto reply = session->control(action_of(options.command), *id, options.value, seconds(10));
  if (!reply) throw Stop{kTimedOut, "the server did not say anything within 10 s"};
  const auto document = nlohmann::json::parse(reply->json, nullptr, false);
  if (reply->code != "ok")
    throw Stop{exit_code(slew_v1_REJECTED, reply->code), document.value("sentence", reply->code)};
  if (options.json)
    print_json(
        {{"experiment_id", id->hex()}, {"phase", wire::phase_name(reply->phase)}, {"code", reply->code}});
  else if (!options.quiet)
    std::cerr << id->hex() << ": " << document.value("sentence", "") << "\n";
  return kDone;
}

}  // namespace slew::ctl
