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

// Goes through the text before a document is made of it, and notes what the document would not show (keys
// that come twice, of which nlohmann keeps the last one silently) or should not contain (arrays without end).
// A pass of its own: nlohmann's parser with a callback takes quadratic time for many small objects.
class Scout final : public json::json_sax_t {
 public:
  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(json::number_integer_t) override { return value(); }
  bool number_unsigned(json::number_unsigned_t) override { return value(); }
  bool number_float(json::number_float_t, const json::string_t&) override { return value(); }
  bool string(json::string_t&) override { return value(); }
  bool binary(json::binary_t&) override { return value(); }
  bool start_object(std::size_t) override {
    open_.push_back({true, 0, {}, {}});
    return true;
  }
  bool key(json::string_t& name) override {
    Container& object = open_.back();
    object.key = name;
    if (!object.keys.insert(name).second) note("the key stands more than once", "", "every key once");
    return violations.size() <= limits().max_violations;
  }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override {
    open_.push_back({false, 0, {}, {}});
    return true;
  }
  bool end_array() override { return close(); }
  bool parse_error(std::size_t byte, const std::string&, const json::exception& error) override {
    stopped_at = byte > 0 ? byte - 1 : 0;
    // nlohmann's 406: "number overflow parsing '1e999'".
    is_overflow = error.id == 406;
    return false;
  }

  std::string pointer() const {
    json::json_pointer pointer;
    for (const Container& container : open_)
      container.is_object ? pointer.push_back(container.key)
                          : pointer.push_back(std::to_string(container.index));
    return pointer.to_string();
  }

  std::vector<Violation> violations;
  std::optional<std::size_t> stopped_at;
  bool is_overflow = false;

 private:
  struct Container {
    bool is_object;
    std::size_t index;  // of the element to come
    std::string key;    // of the member to come
    std::set<std::string> keys;
  };

  bool close() {
    open_.pop_back();
    return value();
  }
  bool value() {
    if (open_.empty() || open_.back().is_object) return true;
    const std::size_t most = limits().max_items;
    if (++open_.back().index <= most) return true;
    open_.pop_back();
    note("the array is too long", "more than " + std::to_string(most) + " items",
         "at most " + std::to_string(most) + " items");
    return false;
  }
  void note(const char* problem, std::string given, std::string allowed) {
    violations.push_back({pointer(), problem, std::move(given), std::move(allowed)});
  }

  std::vector<Container> open_;
};

// As many languages write them into what they call JSON.
bool is_not_finite(std::string_view text) {
  return text.starts_with("NaN") || text.starts_with("Infinity");
}

// The number that ends at the offset.
std::string_view number_before(std::string_view bytes, std::size_t offset) {
  const auto text = bytes.substr(0, std::min(offset + 1, bytes.size()));
  const auto end = text.find_last_of("0123456789");
  if (end == std::string_view::npos) return {};
  const auto begin = text.substr(0, end).find_last_not_of("0123456789+-.eE");
  return text.substr(begin == std::string_view::npos ? 0 : begin + 1, end - begin);
}

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
  // nlohmann takes the first one for the end of the text and what follows for nothing.
  if (const auto null = bytes.find('\0'); null != std::string_view::npos)
    return one(
        {"", "the text has a NUL byte at " + place(bytes, null), "0x00", "one JSON object (RFC 8259)"});
  Scout scout;
  const bool is_json = json::sax_parse(bytes, &scout);
  if (!scout.violations.empty()) return std::move(scout.violations);
  if (scout.stopped_at && scout.is_overflow)
    return one({scout.pointer(), "the number is too large for double precision",
                cut(std::string(number_before(bytes, *scout.stopped_at))),
                "finite numbers of at most 1.797e308 in size"});
  if (!is_json) {
    const std::size_t offset = std::min(scout.stopped_at.value_or(0), bytes.size());
    const auto rest = bytes.substr(offset, 40);
    if (is_not_finite(rest))
      return one({scout.pointer(), "not-a-number and infinity are no JSON numbers: " + place(bytes, offset),
                  shortened(std::string(rest)), "a finite number"});
    return one({"", "the text is not JSON at " + place(bytes, offset), shortened(std::string(rest)),
                "one JSON object (RFC 8259)"});
  }
  json document = json::parse(bytes);
  if (!document.is_object())
    return one({"", "the text is JSON, but not an object", shortened(document), "an object"});
  return document;
}

}  // namespace slew
