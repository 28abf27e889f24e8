#include "client/slewctl/prepared_request.hpp"

#include <nlohmann/json.hpp>

#include "client/slewctl/connection.hpp"
#include "client/slewctl/terminal.hpp"

namespace slew::ctl {

using nlohmann::json;

std::string value_in_words(const json& value) {
  if (value.is_number()) return number(value.get<double>());
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_array()) return value.dump();
  std::string text;
  for (const json& element : value) text += (text.empty() ? "" : ", ") + value_in_words(element);
  return "[" + text + "]";
}

namespace {

// Numbers of a description, one a line, with the path that leads to them. Curves are for pictures and
// programs.
void add_rows(std::vector<std::vector<std::string>>& rows, const std::string& path, const json& value) {
  const bool is_list = value.is_array() && !value.empty() && value.front().is_object();
  if (value.is_object() || is_list) {
    const std::string prefix = path.empty() ? path : path + ".";
    for (const auto& [key, child] : value.items())
      if (key != "curve") add_rows(rows, prefix + key, child);
  } else {
    rows.push_back({path, value_in_words(value)});
  }
}

}  // namespace

Prepared prepared_request(const Options& options) {
  auto outcome = prepare(request_text(options));
  if (auto* prepared = std::get_if<Prepared>(&outcome)) return std::move(*prepared);
  const auto& rejection = std::get<Rejection>(outcome);
  json violations = json::array();
  for (const Violation& violation : rejection.violations) violations.push_back(to_json(violation));
  if (options.json)
    print_json({{"code", rejection.code},
                {"sentence", rejection.sentence},
                {"violations", violations},
                {"warnings", json::array()}});
  throw Stop{kRefused, rejection.sentence + "\n" + violations_in_words(violations)};
}

std::string rows_in_words(const json& document) {
  std::vector<std::vector<std::string>> rows{{std::string("what"), std::string("value")}};
  for (const auto& [key, value] : document.items()) add_rows(rows, key, value);
  return table(rows);
}

}  // namespace slew::ctl
