// From bytes to a JSON document, or to the reasons why not. Nothing in the bytes is trusted.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace slew {

/// One thing that is wrong with a request: where (RFC 6901), what, what stood there, what may stand there.
struct Violation {
  std::string pointer;
  std::string problem;
  std::string given;  ///< as JSON text, shortened
  std::string allowed;
};

nlohmann::json to_json(const Violation& violation);

/// The value as JSON text of at most 200 bytes, for Violation::given.
std::string shortened(const nlohmann::json& value);

/// The document, or every violation that could be found: too large, too deep, not UTF-8, not JSON, duplicate
/// keys, numbers beyond double precision's range. Never throws anything but std::bad_alloc.
std::variant<nlohmann::json, std::vector<Violation>> parse_document(std::string_view bytes);

}  // namespace slew
