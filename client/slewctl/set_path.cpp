#include "client/slewctl/set_path.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

namespace slew::ctl {
namespace {

using nlohmann::json;

std::vector<std::string> split(const std::string& path) {
  std::vector<std::string> steps;
  std::size_t begin = 0;
  while (true) {
    const auto dot = path.find('.', begin);
    steps.push_back(path.substr(begin, dot - begin));
    if (steps.back().empty()) throw std::invalid_argument("\"" + path + "\" is not a path: a step is empty");
    if (dot == std::string::npos) return steps;
    begin = dot + 1;
  }
}

bool is_index(const std::string& step) {
  return step.size() <= 9 &&
         std::all_of(step.begin(), step.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

void set_path(json& document, const json& base, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0)
    throw std::invalid_argument("\"" + assignment + "\" is not of the form path=value");
  const std::string text = assignment.substr(equals + 1);
  json value = json::parse(text, nullptr, false);
  if (value.is_discarded()) value = text;

  static const json nothing;
  json* target = &document;
  const json* beneath = &base;
  const std::string in_assignment = " in \"" + assignment + "\" ";
  for (const std::string& step : split(assignment.substr(0, equals))) {
    if (target->is_null() && beneath->is_array()) *target = *beneath;
    if (target->is_array()) {
      if (!is_index(step))
        throw std::invalid_argument("\"" + step + "\"" + in_assignment + "should be an index into an array");
      const std::size_t index = std::stoul(step);
      if (index > target->size())
        throw std::invalid_argument("index " + step + in_assignment + "is beyond the end: the array has " +
                                    std::to_string(target->size()));
      if (index == target->size()) target->push_back(nullptr);
      beneath = &nothing;
      target = &(*target)[index];
      continue;
    }
    if (!target->is_object()) *target = json::object();
    beneath = beneath->is_object() && beneath->contains(step) ? &beneath->at(step) : &nothing;
    target = &(*target)[step];
  }
  *target = std::move(value);
}

}  // namespace slew::ctl
