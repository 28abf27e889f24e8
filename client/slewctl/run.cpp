// run and submit.
#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>

#include "client/slewctl/commands.hpp"
#include "client/slewctl/connection.hpp"
#include "client/slewctl/gnuplot.hpp"
#include "client/slewctl/picture.hpp"
#include "client/slewctl/report.hpp"
#include "client/slewctl/terminal.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

constexpr double kAcceptance_s = 30;

volatile std::sig_atomic_t interrupted = 0;

// A refusal in the form that was asked for.
int refuse(const Options& options, const client::Reply& reply) {
  json document = json::parse(reply.json, nullptr, false);
  if (!document.is_object()) document = {{"code", reply.code}, {"sentence", reply.code}};
  std::cerr << document.value("sentence", reply.code) << "\n"
            << violations_in_words(document.value("violations", json::array()));
  if (options.json) {
    document["request_id"] = reply.request_id.hex();
    document["phase"] = wire::phase_name(reply.phase);
    print_json(document);
  }
  return exit_code(reply.phase, reply.code);
}

client::Reply hand_in(client::Session& session, const Options& options, const std::string& text) {
  wire::Id request_id = wire::Id::make();
  if (!options.request_id.empty()) {
    const auto given = wire::Id::parse(options.request_id);
    if (!given || given->is_zero())
      throw Stop{kRefused, "a request id is 32 hexadecimal digits, not all of them 0"};
    request_id = *given;
    session.forget(request_id);
  }
  const double most_s = options.timeout_s.value_or(kAcceptance_s);
  const auto reply = session.submit(text, request_id, seconds(most_s));
  if (!reply) throw Stop{kTimedOut, "the server did not say anything within " + number(most_s) + " s"};
  return *reply;
}

void draw(client::Session& session, const Options& options, const json& result) {
  const json series = ask(session, "series", {{"id", result.at("experiment_id")}, {"max_samples", 4000}});
  std::string title = result.at("provenance").at("preset").get<std::string>();
  if (title.empty()) title = "experiment " + result.at("experiment_id").get<std::string>();
  draw_run(result, series, title, options.output);
}

}  // namespace

int submit(const Options& options) {
  const std::string text = request_text(options);
  const auto session = connect(options);
  const client::Reply reply = hand_in(*session, options, text);
  if (reply.phase == slew_v1_REJECTED) return refuse(options, reply);
  if (options.json)
    print_json({{"request_id", reply.request_id.hex()},
                {"experiment_id", reply.experiment_id.hex()},
                {"phase", wire::phase_name(reply.phase)}});
  else
    std::cout << reply.experiment_id.hex() << "\n";
  return kDone;
}

int run(const Options& options) {
  if (!options.output.empty()) check_picture_name(options.output);
  const std::string text = request_text(options);
  const auto session = connect(options);
  const auto begin = std::chrono::steady_clock::now();
  client::Reply reply = hand_in(*session, options, text);
  if (reply.phase == slew_v1_REJECTED) return refuse(options, reply);

  std::signal(SIGINT, [](int) { interrupted = 1; });
  const std::string id = reply.experiment_id.hex();
  if (!wire::is_terminal(reply.phase)) {
    Progress progress(options.quiet);
    const auto spent = std::chrono::steady_clock::now() - begin;
    const auto left = options.timeout_s ? seconds(*options.timeout_s) - spent : client::Duration::max();
    const auto last = session->wait_for_end(
        reply.request_id, left, [&](const slew_v1_Experiment& status) { progress.show(status); },
        [] { return interrupted == 0; });
    progress.finish();
    if (!last && interrupted)
      throw Stop{kInterrupted, "not waited for any longer; the experiment goes on: slewctl result " + id +
                                   ", slewctl cancel " + id};
    if (!last)
      throw Stop{kTimedOut, "not finished within " + number(options.timeout_s.value_or(0)) +
                                " s; the experiment goes on: slewctl result " + id + ", slewctl cancel " +
                                id};
    reply = *last;
  }
  // Of the server that has said the last word, where there are two.
  const json result = ask(*session, "result", {{"id", reply.experiment_id.hex()}});
  if (options.json)
    print_json(result);
  else
    std::cout << result_in_words(result);
  if (reply.phase == slew_v1_FAILED && result.at("failure").is_object())
    std::cerr << result.at("failure").value("sentence", "failed") << "\n";
  if (!options.output.empty() && reply.phase == slew_v1_COMPLETED) {
    draw(*session, options, result);
    if (options.output != "-") std::cerr << "drawn: " << options.output << "\n";
  }
  return exit_code(reply.phase, reply.code);
}

int plot(const Options& options) {
  Options drawn = options;
  if (drawn.output.empty()) drawn.output = "-";
  check_picture_name(drawn.output);
  const auto session = connect(options);
  draw(*session, drawn, ask(*session, "result", {{"id", options.ids.front()}}));
  return kDone;
}

}  // namespace slew::ctl
