// presets, schema, validate, describe, model: no server needed.
#include <iostream>
#include <nlohmann/json.hpp>

#include "client/slewctl/commands.hpp"
#include "client/slewctl/connection.hpp"
#include "client/slewctl/design_picture.hpp"
#include "client/slewctl/gnuplot.hpp"
#include "client/slewctl/prepared_request.hpp"
#include "client/slewctl/terminal.hpp"
#include "server/experiment/experiment.hpp"
#include "server/experiment/preset.hpp"
#include "server/experiment/schema.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

// A row for each mode, as clamped and coupled to the hub; hub-free frequencies do not belong to one each, but
// stand in order.
std::string mode_table(const json& plant) {
  const json couplings = plant.value("couplings_sqrt_kg_m", json::array());
  if (couplings.empty()) return "";
  std::vector<std::vector<std::string>> rows{
      {"mode", "clamped, Hz", "damping", "D, kg^1/2 m", "D^2, kg m^2", "hub free, Hz"}};
  for (std::size_t i = 0; i < couplings.size(); ++i) {
    const double coupling = couplings[i];
    rows.push_back({std::to_string(i + 1), value_in_words(plant.at("clamped_frequencies_hz")[i]),
                    value_in_words(plant.at("damping_ratios")[i]), number(coupling),
                    number(coupling * coupling), value_in_words(plant.at("free_frequencies_hz")[i])});
  }
  return "\n" + table(rows);
}

}  // namespace

int presets(const Options& options) {
  if (!options.name.empty()) {
    const json* document = preset_document(options.name);
    if (!document) {
      std::vector<std::string> names;
      for (const Preset& preset : slew::presets()) names.push_back(preset.name);
      const std::string like = nearest(options.name, names);
      throw Stop{kRefused,
                 "there is no preset " + options.name + (like.empty() ? "" : "; did you mean " + like + "?")};
    }
    print_json(*document);
    return kDone;
  }
  if (options.json) {
    json list = json::array();
    for (const Preset& preset : slew::presets())
      list.push_back({{"name", preset.name}, {"summary", preset.summary}, {"source", preset.source}});
    print_json(list);
    return kDone;
  }
  std::vector<std::vector<std::string>> rows{{"preset", "what it shows"}};
  for (const Preset& preset : slew::presets()) rows.push_back({preset.name, preset.summary});
  std::cout << table(rows);
  return kDone;
}

int schema(const Options& options) {
  const auto names = schema_names();
  if (options.name.empty()) {
    if (options.json) {
      print_json(names);
      return kDone;
    }
    for (const std::string& name : names) std::cout << name << "\n";
    return kDone;
  }
  if (std::find(names.begin(), names.end(), options.name) == names.end())
    throw Stop{kRefused, "there is no schema " + options.name + "; slewctl schema lists them"};
  print_json(schema_document(options.name));
  return kDone;
}

int validate(const Options& options) {
  const Prepared prepared = prepared_request(options);
  if (options.json)
    print_json({{"code", "ok"},
                {"sentence", "this is a request"},
                {"violations", json::array()},
                {"warnings", prepared.warnings}});
  for (const std::string& warning : prepared.warnings) std::cerr << "warning: " << warning << "\n";
  if (!options.json) std::cout << "this is a request\n";
  return kDone;
}

int describe(const Options& options) {
  if (!options.output.empty()) check_picture_name(options.output);
  const Prepared prepared = prepared_request(options);
  json description = slew::describe(prepared);
  if (!options.output.empty()) {
    description["design"] = design_curves(prepared);
    draw_design(description, prepared.preset.empty() ? prepared.label : prepared.preset, options.output);
    if (options.output != "-") std::cerr << "drawn: " << options.output << "\n";
  }
  if (options.json) {
    print_json(description);
    return kDone;
  }
  const json warnings = description.at("warnings");
  for (const char* key : {"request", "warnings", "design"}) description.erase(key);
  std::cout << rows_in_words(description);
  for (const json& warning : warnings) std::cout << "warning: " << warning.get<std::string>() << "\n";
  return kDone;
}

int model(const Options& options) {
  const json document = slew::model(prepared_request(options));
  if (options.json) {
    print_json(document);
    return kDone;
  }
  const std::string modes = mode_table(document.at("plant"));
  json shown = json::object();
  if (document.at("plant").at("type") == "flexible_structure")
    for (const char* part : {"maneuvering", "flown", "design_model", "frequency_errors", "responses",
                             "command", "controller", "slew"})
      if (!document.at(part).is_null()) shown[part] = document.at(part);
  for (const char* part : {"plant", "frame"}) {
    if (document.at(part).is_null()) continue;
    shown[part] = document.at(part);
    for (const char* list :
         {"clamped_frequencies_hz", "damping_ratios", "couplings_sqrt_kg_m", "free_frequencies_hz"})
      shown[part].erase(list);
  }
  std::cout << rows_in_words(shown) << modes;
  for (const json& warning : document.at("warnings"))
    std::cout << "warning: " << warning.get<std::string>() << "\n";
  return kDone;
}

}  // namespace slew::ctl
