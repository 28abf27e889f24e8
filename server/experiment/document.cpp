#include "server/experiment/document.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "server/experiment/limits.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr std::size_t kGivenBytes = 200;

std::string cut(std::string text) {
  if (text.size() <= kGivenBytes) return text;
  std::size_t end = kGivenBytes - 3;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

// Depth by counting brackets outside strings: a parser must not be asked to go that deep.
std::size_t nesting_depth(std::string_view bytes) {
  std::size_t depth = 0, deepest = 0;
  bool in_string = false, escaped = false;
  for (const char c : bytes) {
    if (in_string) {
      if (escaped)
        escaped = false;
      else if (c == '\\')
        escaped = true;
      else if (c == '"')
        in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      deepest = std::max(deepest, ++depth);
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return deepest;
}

// Where the first byte is that cannot be UTF-8.
std::optional<std::size_t> first_bad_utf8(std::string_view bytes) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
  for (std::size_t i = 0; i < bytes.size();) {
    const unsigned char lead = byte(i);
    std::size_t length = 0;
    unsigned low = 0x80, high = 0xBF;
    if (lead < 0x80) {
      ++i;
      continue;
    }
    if (lead >= 0xC2 && lead <= 0xDF) length = 2;
    if (lead >= 0xE0 && lead <= 0xEF) length = 3;
    if (lead >= 0xF0 && lead <= 0xF4) length = 4;
    // Overlong forms, surrogates, beyond U+10FFFF.
    if (lead == 0xE0) low = 0xA0;
    if (lead == 0xED) high = 0x9F;
    if (lead == 0xF0) low = 0x90;
    if (lead == 0xF4) high = 0x8F;
    if (length == 0 || i + length > bytes.size()) return i;
    if (byte(i + 1) < low || byte(i + 1) > high) return i;
    for (std::size_t k = 2; k < length; ++k)
      if ((byte(i + k) & 0xC0) != 0x80) return i;
    i += length;
  }
  return std::nullopt;
}

std::string place(std::string_view bytes, std::size_t offset) {
  offset = std::min(offset, bytes.size());
  const auto before = bytes.substr(0, offset);
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const auto newline = before.rfind('\n');
  const auto column = newline == std::string_view::npos ? offset + 1 : offset - newline;
  return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

// Keeps the path while the parser goes along, and notes keys that come twice: nlohmann would keep the last
// one silently.
class DuplicateKeys {
 public:
  bool operator()(int, json::parse_event_t event, json& parsed) {
    switch (event) {
      case json::parse_event_t::object_start:
        open_.push_back({true, 0, {}, {}});
        break;
      case json::parse_event_t::array_start:
        open_.push_back({false, 0, {}, {}});
        break;
      case json::parse_event_t::key: {
        auto& object = open_.back();
        object.key = parsed.get<std::string>();
        if (!object.keys.insert(object.key).second) found.push_back(pointer());
        break;
      }
      case json::parse_event_t::object_end:
      case json::parse_event_t::array_end:
        open_.pop_back();
        next_element();
        break;
      case json::parse_event_t::value:
        next_element();
        break;
    }
    return true;
  }

  std::vector<std::string> found;

 private:
  struct Container {
    bool is_object;
    std::size_t index;
    std::string key;
    std::set<std::string> keys;
  };

  void next_element() {
    if (!open_.empty() && !open_.back().is_object) ++open_.back().index;
  }
  std::string pointer() const {
    json::json_pointer pointer;
    for (const Container& container : open_)
      container.is_object ? pointer.push_back(container.key)
                          : pointer.push_back(std::to_string(container.index));
    return pointer.to_string();
  }

  std::vector<Container> open_;
};

std::vector<Violation> one(Violation violation) {
  return {std::move(violation)};
}

}  // namespace

json to_json(const Violation& violation) {
  return {{"pointer", violation.pointer},
          {"problem", violation.problem},
          {"given", violation.given},
          {"allowed", violation.allowed}};
}

std::string shortened(const json& value) {
  // A large value is not written out just to be cut.
  if (value.is_structured() && value.size() > 100)
    return (value.is_array() ? "an array of " : "an object of ") + std::to_string(value.size());
  return cut(value.dump(-1, ' ', false, json::error_handler_t::replace));
}

std::variant<json, std::vector<Violation>> parse_document(std::string_view bytes) {
  const Limits& most = limits();
  if (bytes.size() > most.max_request_bytes)
    return one({"", "the text is too large", std::to_string(bytes.size()) + " bytes",
                "at most " + std::to_string(most.max_request_bytes) + " bytes"});
  if (const std::size_t depth = nesting_depth(bytes); depth > most.max_nesting_depth)
    return one({"", "the text is nested too deeply", std::to_string(depth) + " levels",
                "at most " + std::to_string(most.max_nesting_depth) + " levels"});
  if (const auto bad = first_bad_utf8(bytes)) {
    char hex[8];
    std::snprintf(hex, sizeof hex, "0x%02X", static_cast<unsigned char>(bytes[*bad]));
    return one({"", "the text is not UTF-8 at byte " + std::to_string(*bad) + " (" + place(bytes, *bad) + ")",
                hex, "UTF-8"});
  }
  DuplicateKeys duplicates;
  json document;
  try {
    document = json::parse(bytes, std::ref(duplicates));
  } catch (const json::parse_error& error) {
    const std::size_t offset = error.byte > 0 ? error.byte - 1 : 0;
    const auto from = std::min(offset, bytes.size());
    return one({"", "the text is not JSON at " + place(bytes, offset),
                shortened(std::string(bytes.substr(from, 40))), "one JSON object (RFC 8259)"});
  } catch (const json::out_of_range&) {
    return one({"", "a number is too large for double precision", "",
                "finite numbers of at most 1.797e308 in size"});
  }
  if (!duplicates.found.empty()) {
    std::vector<Violation> violations;
    for (const std::string& pointer : duplicates.found)
      violations.push_back({pointer, "the key stands more than once", "", "every key once"});
    return violations;
  }
  if (!document.is_object())
    return one({"", "the text is JSON, but not an object", shortened(document), "an object"});
  return document;
}

}  // namespace slew
