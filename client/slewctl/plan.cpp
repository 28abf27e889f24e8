// plan: a maneuver without flying it; no server needed.
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>

#include "client/slewctl/commands.hpp"
#include "client/slewctl/connection.hpp"
#include "client/slewctl/gnuplot.hpp"
#include "client/slewctl/plan_picture.hpp"
#include "client/slewctl/prepared_request.hpp"
#include "client/slewctl/terminal.hpp"
#include "server/experiment/planning.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

volatile std::sig_atomic_t interrupted = 0;

json planned(const PlanningTask& task, const Options& options) {
  const auto begin = std::chrono::steady_clock::now();
  PlanningTask limited = task;
  if (options.timeout_s)
    limited.time_budget_s = std::min(*options.timeout_s, task.time_budget_s.value_or(*options.timeout_s));
  std::signal(SIGINT, [](int) { interrupted = 1; });
  const bool shows = !options.quiet && isatty(STDERR_FILENO);
  PlanningWatch watch;
  watch.is_called_off = [] { return interrupted != 0; };
  watch.elapsed_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  watch.report = [&](double progress) {
    if (shows) std::cerr << "\r\x1b[K" << bar(progress, 30) << " planning" << std::flush;
  };
  json plan = plan_maneuver(limited, watch);
  if (shows) std::cerr << "\r\x1b[K";
  return plan;
}

}  // namespace

int plan(const Options& options) {
  for (const std::string& file : {options.output, options.cube})
    if (!file.empty()) check_picture_name(file);
  Prepared prepared = prepared_request(options);
  if (!prepared.planning)
    throw Stop{
        kRefused,
        "the request has no guidance that plans: guidance.type \"time_optimal\" or \"given_controls\""};
  const json plan = planned(*prepared.planning, options);
  if (interrupted) throw Stop{kCancelled, "cancelled"};
  const bool is_found = plan.at("time_s").is_number();
  if (options.json) {
    print_json(plan);
  } else {
    json shown = plan;
    shown.at("search").erase("optima");
    std::cout << rows_in_words(shown);
  }
  if (!is_found) throw Stop{kRunFailed, "no maneuver was found: " + plan.at("why").get<std::string>()};
  if (options.output.empty() && options.cube.empty()) return kDone;

  const json curves = plan_curves(*prepared.planning, plan);
  const std::string title = prepared.preset.empty() ? prepared.label : prepared.preset;
  if (!options.output.empty())
    run_gnuplot(plan_history_script(plan, curves, title, options.output), options.output);
  if (!options.cube.empty()) {
    if (curves.at("controls").front().size() != 3)
      throw Stop{kRefused, "the cube is drawn for three controls, and this actuator has another number"};
    run_gnuplot(control_cube_script(plan, curves, title, options.cube), options.cube);
  }
  for (const std::string& file : {options.output, options.cube})
    if (!file.empty() && file != "-") std::cerr << "drawn: " << file << "\n";
  return kDone;
}

}  // namespace slew::ctl
