// The schemas in schemas/, ready to judge documents, to fill in defaults and to say what is allowed.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "server/experiment/document.hpp"

namespace slew {

/// "request", "result", "reply", "query", "limits".
std::vector<std::string> schema_names();
/// Throws std::out_of_range for an unknown name.
const nlohmann::json& schema_document(std::string_view name);

/// Every violation of the schema at once. Where a block has a `type`, only the chosen branch speaks.
std::vector<Violation> schema_violations(std::string_view name, const nlohmann::json& document);

/// Adds what the schema gives a default for and the document leaves out.
void fill_defaults(std::string_view name, nlohmann::json& document);

/// The one of `known` that is most like `name`; empty when none is near.
std::string nearest(std::string_view name, const std::vector<std::string>& known);

}  // namespace slew
