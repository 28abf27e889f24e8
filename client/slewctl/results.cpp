// result, show, list, history, series, export.
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "client/slewctl/commands.hpp"
#include "client/slewctl/connection.hpp"
#include "client/slewctl/report.hpp"
#include "client/slewctl/terminal.hpp"
#include "server/series/series_file.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

std::string local_time(std::int64_t unix_ns) {
  if (unix_ns == 0) return "-";
  const std::time_t time = unix_ns / 1000000000;
  std::tm local{};
  localtime_r(&time, &local);
  char text[32];
  std::strftime(text, sizeof text, "%F %T", &local);
  return text;
}

// Experiments begin with the time they were made at, so their first digits differ late; sixteen are enough.
std::string short_id(const std::string& id) {
  return id.substr(0, 16);
}

void write_csv(std::ostream& out, const json& series) {
  out << "t_s";
  std::vector<const json*> columns;
  for (const json& channel : series.at("channels")) {
    out << ',' << channel.at("name").get<std::string>();
    columns.push_back(&series.at("columns").at(channel.at("name").get<std::string>()));
  }
  out << '\n';
  char text[32];
  for (std::size_t i = 0; i < series.at("t_s").size(); ++i) {
    std::snprintf(text, sizeof text, "%.17g", series.at("t_s")[i].get<double>());
    out << text;
    for (const json* column : columns) {
      std::snprintf(text, sizeof text, ",%.17g", (*column)[i].get<double>());
      out << text;
    }
    out << '\n';
  }
}

void write_hdf5(std::ostream& out, const json& series) {
  ChannelTable table;
  for (const json& channel : series.at("channels")) {
    auto& group = channel.at("group") == "state" ? table.state : table.thrusters;
    group.push_back({channel.at("name"), channel.at("unit"), channel.at("frame"), channel.at("description")});
  }
  std::vector<std::string> names;
  for (const Channel& channel : table.state) names.push_back(channel.name);
  for (const Channel& channel : table.thrusters) names.push_back(channel.name);
  const auto image = series_image(table, [&](std::size_t index) {
    return (index == 0 ? series.at("t_s") : series.at("columns").at(names.at(index - 1)))
        .get<std::vector<double>>();
  });
  out.write(image.data(), static_cast<std::streamsize>(image.size()));
}

json series_arguments(const Options& options) {
  json arguments = {
      {"id", options.ids.front()}, {"channels", options.channels}, {"max_samples", options.max_samples}};
  if (options.from_s) arguments["from_s"] = *options.from_s;
  if (options.to_s) arguments["to_s"] = *options.to_s;
  return arguments;
}

}  // namespace

int result(const Options& options) {
  const auto session = connect(options);
  const json document = ask(*session, "result", {{"id", options.ids.front()}});
  if (options.json)
    print_json(document);
  else
    std::cout << result_in_words(document);
  return kDone;
}

int show(const Options& options) {
  const auto session = connect(options);
  print_json(ask(*session, "show", {{"id", options.ids.front()}}));
  return kDone;
}

int list(const Options& options) {
  const auto session = connect(options);
  json arguments = {{"limit", options.limit}, {"offset", options.offset}};
  if (!options.phase.empty()) arguments["phase"] = options.phase;
  const bool is_history = options.command == Command::history;
  const json document = ask(*session, is_history ? "history" : "list", arguments);
  if (options.json) {
    print_json(document);
    return kDone;
  }
  std::vector<std::vector<std::string>> rows{
      {"experiment", "phase", "progress", "accepted", "pace", "preset"}};
  if (is_history) rows.front().insert(rows.front().end(), {"client", "sender (as claimed)"});
  for (const json& entry : document.at("experiments")) {
    rows.push_back({short_id(entry.at("experiment_id")), entry.at("phase"),
                    number(100 * entry.at("progress").get<double>()) + " %",
                    local_time(entry.at("accepted_unix_ns")), entry.at("timing_mode"),
                    entry.at("label").get<std::string>().empty() ? entry.at("preset") : entry.at("label")});
    if (is_history) rows.back().insert(rows.back().end(), {entry.at("client_id"), entry.at("sender")});
  }
  std::cout << table(rows);
  const auto shown = document.at("experiments").size();
  std::cerr << shown << " of " << document.at("total") << "\n";
  return kDone;
}

int series(const Options& options) {
  const auto session = connect(options);
  const json document = ask(*session, "series", series_arguments(options));
  if (options.json)
    print_json(document);
  else
    write_csv(std::cout, document);
  return kDone;
}

int export_series(const Options& options) {
  const auto session = connect(options);
  const json document = ask(*session, "series", series_arguments(options));
  json files = json::array();
  const auto save = [&](const std::string& name, const auto& write) {
    if (name.empty()) return;
    std::ofstream file(name, std::ios::binary);
    write(file);
    if (!file.flush()) throw Stop{kRunFailed, "the file " + name + " cannot be written"};
    files.push_back(name);
  };
  save(options.output, [&](std::ostream& file) { write_csv(file, document); });
  save(options.hdf5, [&](std::ostream& file) { write_hdf5(file, document); });
  if (options.json) print_json({{"files", files}, {"samples", document.at("t_s").size()}});
  return kDone;
}

}  // namespace slew::ctl
