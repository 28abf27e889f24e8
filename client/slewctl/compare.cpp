// compare: several presets flown at once, side by side.
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "client/slewctl/commands.hpp"
#include "client/slewctl/connection.hpp"
#include "client/slewctl/gnuplot.hpp"
#include "client/slewctl/terminal.hpp"
#include "server/experiment/preset.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr const char* kColors[] = {"#1f4e9c", "#b71c1c", "#2e7d32", "#ef6c00", "#6a1b9a", "#00838f"};

// "benchmark/comparison-*" is every preset whose name begins so.
std::vector<std::string> named(const std::vector<std::string>& patterns) {
  std::vector<std::string> names;
  for (const std::string& pattern : patterns) {
    const std::size_t before = names.size();
    for (const Preset& preset : slew::presets()) {
      const bool fits = pattern.ends_with('*')
                            ? preset.name.starts_with(pattern.substr(0, pattern.size() - 1))
                            : preset.name == pattern;
      if (fits) names.push_back(preset.name);
    }
    if (names.size() == before) throw Stop{kRefused, "there is no preset " + pattern};
  }
  return names;
}

// The angle that is left, deg, over time: of one axis or of three.
std::string error_over_time(const json& series) {
  const json& columns = series.at("columns");
  std::string points;
  for (std::size_t k = 0; k < series.at("t_s").size(); ++k) {
    double error = 0;
    if (columns.contains("mrp_1")) {
      double square = 0;
      for (const char* name : {"mrp_1", "mrp_2", "mrp_3"})
        square += std::pow(columns.at(name)[k].get<double>(), 2);
      error = 4 * std::atan(std::min(std::sqrt(square), 1 / std::sqrt(std::max(square, 1e-300))));
    } else if (columns.contains("error_rad")) {
      error = std::abs(columns.at("error_rad")[k].get<double>());
    }
    points += in_full(series.at("t_s")[k]) + ' ' + in_full(error * kDegPerRad) + '\n';
  }
  return points;
}

void draw(client::Session& session, const std::vector<json>& results, const std::string& file) {
  std::string blocks, plots;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const json series =
        ask(session, "series", {{"id", results[i].at("experiment_id")}, {"max_samples", 2000}});
    const std::string name = "$run" + std::to_string(i);
    blocks += name + " << EOD\n" + error_over_time(series) + "EOD\n";
    plots += (i > 0 ? ", " : "plot ") + name + " using 1:2 with lines lw 2 lc rgb '" +
             kColors[i % std::size(kColors)] + "' title " +
             quoted(results[i].at("provenance").at("preset").get<std::string>());
  }
  run_gnuplot(terminal_for(file, 1000, 700) +
                  "set encoding utf8\nset grid\nset key below vertical\nset xlabel 't, s'\n"
                  "set ylabel 'angle to the final attitude, deg'\n" +
                  blocks + plots + "\n",
              file);
}

}  // namespace

int compare(const Options& options) {
  if (!options.output.empty()) check_picture_name(options.output);
  const std::vector<std::string> names = named(options.ids);
  const auto session = connect(options);
  std::vector<client::Reply> replies;
  for (const std::string& name : names) {
    Options one = options;
    one.preset = name;
    const auto reply = session->submit(request_text(one), wire::Id::make(), seconds(30));
    if (!reply) throw Stop{kTimedOut, "the server did not say anything within 30 s"};
    if (reply->phase == slew_v1_REJECTED) {
      const json why = json::parse(reply->json, nullptr, false);
      throw Stop{exit_code(reply->phase, reply->code), name + ": " + why.value("sentence", reply->code)};
    }
    replies.push_back(*reply);
  }
  std::vector<json> results;
  std::vector<std::vector<std::string>> rows{{"preset", "phase", "settling, s", "final error, deg",
                                              "residual rate, deg/s", "peak rate, deg/s", "impulse, N m s",
                                              "gas, m³", "plan, s"}};
  bool all_completed = true;
  for (std::size_t i = 0; i < replies.size(); ++i) {
    Progress progress(options.quiet);
    const auto last = session->wait_for_end(
        replies[i].request_id, options.timeout_s ? seconds(*options.timeout_s) : client::Duration::max(),
        [&](const slew_v1_Experiment& status) { progress.show(status); }, [] { return true; });
    progress.finish();
    if (!last)
      throw Stop{kTimedOut,
                 names[i] + " is not finished yet; slewctl result " + replies[i].experiment_id.hex()};
    const json& result = results.emplace_back(ask(*session, "result", {{"id", last->experiment_id.hex()}}));
    all_completed = all_completed && last->phase == slew_v1_COMPLETED;
    const auto cell = [&](const char* metric) -> std::string {
      if (!result.at("metrics").is_object() || !result.at("metrics").at(metric).is_number()) return "-";
      return number(result.at("metrics").at(metric).get<double>());
    };
    const bool is_planned = result.at("plan").is_object() && result.at("plan").at("time_s").is_number();
    rows.push_back({names[i], result.at("phase").get<std::string>(), cell("settling_time_s"),
                    cell("final_error_deg"), cell("residual_rate_deg_s"), cell("peak_rate_deg_s"),
                    cell("angular_impulse_N_m_s"), cell("gas_volume_m3"),
                    is_planned ? number(result.at("plan").at("time_s").get<double>()) : "-"});
  }
  if (options.json)
    print_json(results);
  else
    std::cout << table(rows);
  if (!options.output.empty()) {
    draw(*session, results, options.output);
    if (options.output != "-") std::cerr << "drawn: " << options.output << "\n";
  }
  return all_completed ? kDone : kRunFailed;
}

}  // namespace slew::ctl
