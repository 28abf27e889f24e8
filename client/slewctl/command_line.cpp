// The one place that knows CLI11.
#include <CLI/CLI.hpp>

#include "client/slewctl/exit_code.hpp"
#include "client/slewctl/options.hpp"
#include "idl/wire/domain.hpp"

namespace slew::ctl {
namespace {

class Commands {
 public:
  Commands(CLI::App& app, Options& options) : app_(app), options_(options) {}

  CLI::App* add(Command command, const char* name, const std::string& help, const std::string& example) {
    CLI::App* sub = app_.add_subcommand(name, help);
    sub->footer("Example: " + example);
    sub->fallthrough();
    sub->callback([this, command] { options_.command = command; });
    return sub;
  }

 private:
  CLI::App& app_;
  Options& options_;
};

void add_request(CLI::App* sub, Options& options) {
  sub->add_option("file", options.file, "the request as JSON; - for standard input");
  sub->add_option("--preset", options.preset, "start from this preset");
  sub->add_option("--set", options.set, "path=value, e.g. timing.mode=real_time; may be repeated")
      ->allow_extra_args(false);
}

void add_request_id(CLI::App* sub, Options& options) {
  sub->add_option("--request-id", options.request_id,
                  "32 hexadecimal digits: the same request is never run twice");
}

void add_id(CLI::App* sub, Options& options) {
  sub->add_option_function<std::string>(
         "id", [&options](const std::string& id) { options.ids = {id}; },
         "experiment or request id, or the beginning of one")
      ->required();
}

}  // namespace

std::optional<int> parse_command_line(int argc, char** argv, Options& options) {
  CLI::App app{"slewctl talks to slewd: submit maneuvers, watch them fly, get their results."};
  app.require_subcommand(1);
  app.set_version_flag("--version", SLEW_VERSION);
  app.set_config("--config", "", "read options from this file (name=value)");
  app.add_option("--domain", options.domain, "DDS domain, 1 to 99")
      ->envname("SLEW_DOMAIN")
      ->check(CLI::Range(1u, wire::kLargestDomain))
      ->capture_default_str();
  app.add_option("--dds-profile", options.dds_profile,
                 "Cyclone DDS configuration (XML); without it: loopback only")
      ->envname("SLEW_DDS_PROFILE")
      ->check(CLI::ExistingFile);
  app.add_option("--client-id", options.client_id, "the name under which as-fast work is shared out")
      ->capture_default_str();
  app.add_option("--connect", options.connect_s, "seconds to look for a server")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  app.add_flag("--json", options.json, "one JSON document on standard output");
  app.add_flag("-q,--quiet", options.quiet, "no progress");
  app.footer(
      "Exit codes: 0 done, 1 the run failed, 2 bad usage or refused, 3 no server or not permitted,\n"
      "            4 timed out, 5 cancelled, 6 interrupted, 7 busy");

  Commands commands(app, options);
  const auto positive = CLI::Range(1e-9, 1e12);

  auto* run = commands.add(Command::run, "run", "submit a maneuver, wait for it, print the result",
                           "slewctl run --preset agrawal-bang-1995/rigid-single-sided --plot slew.png");
  add_request(run, options);
  add_request_id(run, options);
  run->add_option("--plot", options.output, "draw it: FILE.png, FILE.svg, or - for the terminal");
  run->add_flag("--verify", options.verify, "fly it through SUNDIALS too and report the differences");
  run->add_option("--timeout", options.timeout_s, "give up waiting after so many seconds (the run goes on)")
      ->check(positive);

  auto* submit = commands.add(Command::submit, "submit", "submit a maneuver and go",
                              "slewctl submit request.json --set simulation.duration_s=20");
  add_request(submit, options);
  add_request_id(submit, options);
  submit->add_flag("--verify", options.verify, "fly it through SUNDIALS too");
  submit
      ->add_option("--timeout", options.timeout_s, "give up waiting for the acceptance after so many seconds")
      ->check(positive);

  auto* compare = commands.add(Command::compare, "compare", "fly several presets and set them side by side",
                               "slewctl compare 'benchmark/comparison-*' --plot comparison.png");
  compare->add_option("presets", options.ids, "names; * at the end for all that begin so")->required();
  compare->add_option("--set", options.set, "path=value in each of them; may be repeated")
      ->allow_extra_args(false);
  compare->add_option("--plot", options.output, "draw the angle that is left: FILE.png, FILE.svg, or -");
  compare->add_option("--timeout", options.timeout_s, "give up waiting after so many seconds")
      ->check(positive);

  add_id(commands.add(Command::result, "result", "the result of an experiment that has ended",
                      "slewctl result 0193"),
         options);
  add_id(
      commands.add(Command::show, "show", "an experiment: phase and complete request", "slewctl show 0193"),
      options);
  for (auto* sub :
       {commands.add(Command::list, "list", "what the server holds now, newest first",
                     "slewctl list --phase running"),
        commands.add(Command::history, "history", "everything that was ever accepted, newest first",
                     "slewctl history --limit 5")}) {
    sub->add_option("--limit", options.limit, "how many")->check(CLI::Range(1, 1000))->capture_default_str();
    sub->add_option("--offset", options.offset, "how many to pass over")->check(CLI::NonNegativeNumber);
    if (sub->get_name() == "list") sub->add_option("--phase", options.phase, "only those in this phase");
  }
  auto* series = commands.add(Command::series, "series", "the recorded samples: CSV, or JSON with --json",
                              "slewctl series 0193 --channels angle_rad,torque_N_m --max-samples 500");
  auto* export_series = commands.add(Command::export_series, "export", "the recorded samples to a file",
                                     "slewctl export 0193 --csv slew.csv");
  auto* formats = export_series->add_option_group("format");
  formats->add_option("--csv", options.output, "a CSV file");
  formats->add_option("--hdf5", options.hdf5, "an HDF5 file, with units and descriptions as attributes");
  formats->require_option(1, 2);
  for (auto* sub : {series, export_series}) {
    add_id(sub, options);
    sub->add_option("--channels", options.channels, "names, separated by commas; all without it")
        ->delimiter(',');
    sub->add_option("--from", options.from_s, "simulated seconds");
    sub->add_option("--to", options.to_s, "simulated seconds");
    sub->add_option("--max-samples", options.max_samples, "thin evenly to at most so many; 0: all")
        ->check(CLI::NonNegativeNumber);
  }
  auto* plot =
      commands.add(Command::plot, "plot", "draw an experiment that has ended", "slewctl plot 0193 slew.svg");
  add_id(plot, options);
  plot->add_option("picture", options.output, "FILE.png, FILE.svg; without it: in the terminal");

  auto* watch = commands.add(Command::watch, "watch", "live telemetry", "slewctl watch --all");
  watch->add_option("id", options.ids, "experiments; ends when they have ended");
  watch->add_flag("--all", options.all, "everything, until Ctrl-C");
  watch->add_flag("--csv", options.csv, "every sample as a line");
  watch->add_option("--rate", options.rate_hz, "screens or lines a second")->check(CLI::Range(0.1, 1000.0));
  watch->add_option("--for", options.for_s, "stop after so many seconds")->check(positive);

  add_id(commands.add(Command::cancel, "cancel", "end an experiment now", "slewctl cancel 0193"), options);
  add_id(commands.add(Command::pause, "pause", "stop its clock", "slewctl pause 0193"), options);
  add_id(commands.add(Command::resume, "resume", "let its clock go on, or start a held one",
                      "slewctl resume 0193"),
         options);
  auto* step = commands.add(Command::step, "step", "fly on for so much simulated time, then pause",
                            "slewctl step 0193 0.5");
  add_id(step, options);
  step->add_option("seconds", options.value, "simulated seconds")->required()->check(positive);
  auto* rate =
      commands.add(Command::rate, "rate", "change the pace of a paced experiment", "slewctl rate 0193 2.0");
  add_id(rate, options);
  rate->add_option("rate", options.value, "simulated seconds in a wall second")->required()->check(positive);

  auto* presets = commands.add(Command::presets, "presets", "the presets; no server needed",
                               "slewctl presets show agrawal-bang-1995/rigid-single-sided");
  auto* show = presets->add_subcommand("show", "one preset, whole");
  show->add_option("preset", options.name, "its name")->required();
  show->fallthrough();
  auto* schema =
      commands.add(Command::schema, "schema", "a schema; their names without one; no server needed",
                   "slewctl schema request");
  schema->add_option("name", options.name, "request, result, reply, query, limits");
  add_request(commands.add(Command::validate, "validate", "is this a request? no server needed",
                           "slewctl validate request.json"),
              options);
  auto* describe = commands.add(Command::describe, "describe", "what is this system? no server needed",
                                "slewctl describe --preset agrawal-bang-1995/rigid-single-sided");
  add_request(describe, options);
  describe->add_option(
      "--plot", options.output,
      "draw its design: FILE.png, FILE.svg, or - for the terminal; with --json its curves too");
  add_request(
      commands.add(Command::model, "model", "modes and couplings from beams and masses; no server needed",
                   "slewctl model --preset agrawal-bang-1995/flexible-frame-elbow-heavy"),
      options);
  auto* plan = commands.add(Command::plan, "plan", "plan a maneuver without flying it; no server needed",
                            "slewctl plan --preset vadali-singh-carter-1993/on-off-200-lbf --plot plan.png");
  add_request(plan, options);
  plan->add_option("--plot", options.output, "draw controls, rates and attitude: FILE.png, FILE.svg, or -");
  plan->add_option("--cube", options.cube, "draw the path on the control cube: FILE.png, FILE.svg, or -");
  plan->add_option("--timeout", options.timeout_s, "take the best that is found in so many seconds")
      ->check(positive);
  commands.add(Command::server, "server", "who serves this domain", "slewctl server");
  commands.add(Command::doctor, "doctor", "why do I see nothing? one check after the other",
               "slewctl doctor --domain 7");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kRefused;
  }
  return std::nullopt;
}

}  // namespace slew::ctl
