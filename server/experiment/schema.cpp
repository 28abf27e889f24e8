#include "server/experiment/schema.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
// The one place that pays for this header.
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include "schemas/embedded.hpp"
#include "server/experiment/limits.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr std::string_view kSuffix = ".schema.json";

const std::map<std::string, json, std::less<>>& documents() {
  static const auto all = [] {
    std::map<std::string, json, std::less<>> schemas;
    for (const EmbeddedFile& file : embedded_files())
      if (file.name.ends_with(kSuffix))
        schemas.emplace(file.name.substr(0, file.name.size() - kSuffix.size()), json::parse(file.text));
    return schemas;
  }();
  return all;
}

// ---- which parts of a schema speak about a value

// "limits.schema.json#/definitions/duration_s" or "#/definitions/…".
const json& resolve(const json& root, const std::string& reference) {
  const auto hash = reference.find('#');
  const std::string file = reference.substr(0, hash);
  const json& document =
      file.empty() ? root : schema_document(std::string_view(file).substr(0, file.size() - kSuffix.size()));
  return document.at(json::json_pointer(reference.substr(hash + 1)));
}

// Our conditions ask for one thing only: that `type` is a given word.
bool condition_holds(const json& condition, const json& value) {
  for (const auto& [key, wanted] : condition.at("properties").items())
    if (!value.is_object() || !value.contains(key) || value.at(key) != wanted.at("const")) return false;
  return true;
}

// The schema itself and all that it refers to, combines, or chooses for this value.
void applicable(const json& root, const json& schema, const json& value,
                std::vector<const json*>& fragments) {
  fragments.push_back(&schema);
  if (const auto reference = schema.find("$ref"); reference != schema.end())
    applicable(root, resolve(root, *reference), value, fragments);
  if (const auto all = schema.find("allOf"); all != schema.end())
    for (const json& part : *all) applicable(root, part, value, fragments);
  if (const auto condition = schema.find("if");
      condition != schema.end() && condition_holds(*condition, value))
    applicable(root, schema.at("then"), value, fragments);
}

std::vector<const json*> applicable(const json& root, const json& schema, const json& value) {
  std::vector<const json*> fragments;
  applicable(root, schema, value, fragments);
  return fragments;
}

// What a map says of its members, whose names are free.
const json* schema_of_others(const json& schema) {
  const auto others = schema.find("additionalProperties");
  return others != schema.end() && others->is_object() ? &*others : nullptr;
}

// ---- what a schema allows, in words

std::string listed(const json& values) {
  std::string text;
  for (const json& value : values) text += (text.empty() ? "" : ", ") + value.dump();
  return text;
}

std::string type_in_words(const json& type) {
  if (type.is_array()) {
    std::string text;
    for (const json& one : type) text += (text.empty() ? "" : " or ") + type_in_words(one);
    return text;
  }
  const auto& name = type.get_ref<const std::string&>();
  if (name == "null") return name;
  return (name == "integer" || name == "array" || name == "object" ? "an " : "a ") + name;
}

std::string allowed_in_words(const std::vector<const json*>& fragments) {
  static const std::vector<std::pair<const char*, std::function<std::string(const json&)>>> kWords = {
      {"type", type_in_words},
      {"enum", [](const json& value) { return "one of " + listed(value); }},
      {"const", [](const json& value) { return value.dump(); }},
      {"minimum", [](const json& value) { return "at least " + value.dump(); }},
      {"exclusiveMinimum", [](const json& value) { return "greater than " + value.dump(); }},
      {"maximum", [](const json& value) { return "at most " + value.dump(); }},
      {"exclusiveMaximum", [](const json& value) { return "less than " + value.dump(); }},
      {"maxLength", [](const json& value) { return "at most " + value.dump() + " characters"; }},
      {"maxProperties", [](const json& value) { return "at most " + value.dump() + " fields"; }},
      {"minItems", [](const json& value) { return "at least " + value.dump() + " items"; }},
      {"maxItems", [](const json& value) { return "at most " + value.dump() + " items"; }}};
  std::vector<std::string> parts;
  for (const auto& [keyword, words] : kWords)
    for (const json* fragment : fragments)
      if (const auto place = fragment->find(keyword); place != fragment->end())
        if (std::string part = words(*place); std::find(parts.begin(), parts.end(), part) == parts.end())
          parts.push_back(std::move(part));
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : ", ") + part;
  return text;
}

std::vector<std::string> known_properties(const std::vector<const json*>& fragments) {
  std::vector<std::string> known;
  for (const json* fragment : fragments)
    if (const auto properties = fragment->find("properties"); properties != fragment->end())
      for (const auto& [name, ignored] : properties->items())
        if (std::find(known.begin(), known.end(), name) == known.end()) known.push_back(name);
  return known;
}

// ---- valijson's findings, made readable

// {"<root>", "[plant]", "[modes]", "[0]"} to a pointer.
json::json_pointer pointer_of(const std::vector<std::string>& context) {
  json::json_pointer pointer;
  for (std::size_t i = 1; i < context.size(); ++i) {
    const std::string& part = context[i];
    pointer.push_back(part.size() >= 2 && part.front() == '[' ? part.substr(1, part.size() - 2) : part);
  }
  return pointer;
}

// The fragments that speak about a member or an element, given those that speak about the whole.
std::vector<const json*> fragments_below(const json& root, const std::vector<const json*>& fragments,
                                         const json& value, const std::string& step, const json& child) {
  std::vector<const json*> below;
  for (const json* fragment : fragments) {
    const auto properties = fragment->find("properties");
    if (value.is_object() && properties != fragment->end() && properties->contains(step))
      applicable(root, properties->at(step), child, below);
    else if (const json* others = schema_of_others(*fragment); others && value.is_object())
      applicable(root, *others, child, below);
    if (const auto items = fragment->find("items"); value.is_array() && items != fragment->end())
      applicable(root, *items, child, below);
  }
  return below;
}

// The schema fragments that speak about the value at the pointer.
std::vector<const json*> fragments_at(const json& root, const json& document,
                                      const json::json_pointer& pointer) {
  std::vector<std::string> path;
  for (json::json_pointer rest = pointer; !rest.empty(); rest.pop_back()) path.push_back(rest.back());
  std::reverse(path.begin(), path.end());
  const json* value = &document;
  auto fragments = applicable(root, root, document);
  for (const std::string& step : path) {
    static const json nothing;
    const json& child = value->is_object() && value->contains(step) ? value->at(step)
                        : value->is_array()                         ? value->at(std::stoul(step))
                                                                    : nothing;
    fragments = fragments_below(root, fragments, *value, step, child);
    value = &child;
  }
  return fragments;
}

// ---- fields that nobody knows: valijson names one in an object, we name all

Violation unknown_field(const json::json_pointer& object, const std::string& name, const json& value,
                        const std::vector<const json*>& fragments) {
  const auto known = known_properties(fragments);
  const std::string like = nearest(name, known);
  return {(object / name).to_string(),
          "there is no field " + shortened(name) + " here" +
              (like.empty() ? std::string() : "; did you mean \"" + like + "\"?"),
          shortened(value), "one of " + listed(known)};
}

void find_unknown_fields(const json& root, const std::vector<const json*>& fragments, const json& value,
                         const json::json_pointer& pointer, std::vector<Violation>& found) {
  const std::size_t most = limits().max_violations;
  if (value.is_object()) {
    for (const auto& [name, child] : value.items()) {
      if (found.size() > most) return;
      const bool is_unknown =
          std::any_of(fragments.begin(), fragments.end(), [&key = name](const json* fragment) {
            return fragment->value("additionalProperties", json()) == false &&
                   !fragment->at("properties").contains(key);
          });
      if (is_unknown)
        found.push_back(unknown_field(pointer, name, child, fragments));
      else
        find_unknown_fields(root, fragments_below(root, fragments, value, name, child), child, pointer / name,
                            found);
    }
  }
  if (value.is_array())
    for (std::size_t i = 0; i < value.size() && found.size() <= most; ++i)
      find_unknown_fields(root, fragments_below(root, fragments, value, "", value[i]), value[i], pointer / i,
                          found);
}

std::optional<std::string> quoted_name(const std::string& description, std::string_view before) {
  const auto begin = description.find(before);
  if (begin == std::string::npos) return std::nullopt;
  const auto open = description.find('\'', begin + before.size());
  const auto close = description.rfind('\'');
  if (open == std::string::npos || close <= open) return std::nullopt;
  return description.substr(open + 1, close - open - 1);
}

// What is said again, and better, elsewhere: in the branch that failed, or in the list of unknown fields.
bool is_said_elsewhere(const std::string& description) {
  return description.starts_with("Failed to validate") ||
         description.find("'additionalProperties' constraints:") != std::string::npos;
}

std::string problem_in_words(const std::string& description) {
  if (description.starts_with("Value type")) return "the value is of the wrong type";
  if (description.starts_with("Expected number")) return "the number is out of range";
  if (description.find("enum") != std::string::npos || description.find("const") != std::string::npos)
    return "the value is not one of those possible";
  if (description.starts_with("Array should")) return "the array is of the wrong length";
  if (description.starts_with("Object should")) return "the object has too many fields";
  if (description.starts_with("String should")) return "the text is of the wrong length";
  return "the value does not fit";
}

Violation translate(const json& schema, const json& document,
                    const valijson::ValidationResults::Error& error) {
  json::json_pointer pointer = pointer_of(error.context);
  const json& value = document.at(pointer);
  const auto fragments = fragments_at(schema, document, pointer);
  // valijson puts the name last in its sentence.
  if (const auto name = quoted_name(error.description, "Missing required property")) {
    pointer.push_back(*name);
    return {pointer.to_string(), "a required field is missing", "",
            allowed_in_words(fragments_at(schema, document, pointer))};
  }
  return {pointer.to_string(), problem_in_words(error.description), shortened(value),
          allowed_in_words(fragments)};
}

// A schema compiled once; judging with it is const.
const valijson::Schema& compiled(std::string_view name) {
  using Adapter = valijson::adapters::NlohmannJsonAdapter;
  static const auto all = [] {
    std::map<std::string, std::unique_ptr<valijson::Schema>, std::less<>> schemas;
    for (const auto& [schema_name, document] : documents()) {
      auto schema = std::make_unique<valijson::Schema>();
      valijson::SchemaParser parser;
      parser.populateSchema(
          Adapter(document), *schema,
          [](const std::string& uri) -> const json* {
            return &schema_document(std::string_view(uri).substr(0, uri.size() - kSuffix.size()));
          },
          [](const json*) {});
      schemas.emplace(schema_name, std::move(schema));
    }
    return schemas;
  }();
  return *all.find(name)->second;
}

void fill_defaults(const json& root, const json& schema, json& value) {
  if (!value.is_object() && !value.is_array()) return;
  // A type that was filled in says what more belongs there: again, until nothing is added.
  for (std::size_t before = value.size() + 1; before != value.size();) {
    before = value.size();
    for (const json* fragment : applicable(root, schema, value)) {
      if (const auto properties = fragment->find("properties");
          properties != fragment->end() && value.is_object())
        for (const auto& [name, property] : properties->items()) {
          if (!value.contains(name) && property.contains("default")) value[name] = property.at("default");
          if (value.contains(name)) fill_defaults(root, property, value[name]);
        }
      if (const json* others = schema_of_others(*fragment); others && value.is_object())
        for (json& member : value) fill_defaults(root, *others, member);
      if (const auto items = fragment->find("items"); items != fragment->end() && value.is_array())
        for (json& item : value) fill_defaults(root, *items, item);
    }
  }
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row.back();
}

}  // namespace

std::vector<std::string> schema_names() {
  std::vector<std::string> names;
  for (const auto& [name, ignored] : documents()) names.push_back(name);
  return names;
}

const json& schema_document(std::string_view name) {
  const auto place = documents().find(name);
  if (place == documents().end()) throw std::out_of_range("there is no schema " + std::string(name));
  return place->second;
}

std::vector<Violation> schema_violations(std::string_view name, const json& document) {
  valijson::Validator validator(valijson::Validator::kStrongTypes);
  valijson::ValidationResults results;
  const valijson::adapters::NlohmannJsonAdapter target(document);
  if (validator.validate(compiled(name), target, &results)) return {};
  const json& root = schema_document(name);
  std::vector<Violation> violations;
  find_unknown_fields(root, applicable(root, root, document), document, json::json_pointer(), violations);
  for (const auto& error : results) {
    if (violations.size() > limits().max_violations) break;
    if (is_said_elsewhere(error.description)) continue;
    Violation violation = translate(root, document, error);
    const auto same = [&](const Violation& other) {
      return other.pointer == violation.pointer && other.allowed == violation.allowed;
    };
    if (std::none_of(violations.begin(), violations.end(), same)) violations.push_back(std::move(violation));
  }
  if (violations.empty())
    violations.push_back(
        {"", "the document does not fit the schema", "", "see slewctl schema " + std::string(name)});
  std::stable_sort(violations.begin(), violations.end(),
                   [](const Violation& a, const Violation& b) { return a.pointer < b.pointer; });
  return violations;
}

void fill_defaults(std::string_view name, json& document) {
  const json& schema = schema_document(name);
  fill_defaults(schema, schema, document);
}

std::string nearest(std::string_view name, const std::vector<std::string>& known) {
  std::string best;
  name = name.substr(0, 200);
  // Half of the letters may differ; beyond that a guess is only confusing.
  std::size_t least = std::max<std::size_t>(2, name.size() / 2) + 1;
  for (const std::string& candidate : known) {
    const std::size_t distance = edit_distance(name, candidate);
    if (distance < least) {
      least = distance;
      best = candidate;
    }
  }
  return best;
}

}  // namespace slew
