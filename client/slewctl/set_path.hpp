// --set plant.modes.0.frequency_hz=0.139: one value at a dotted path.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace slew::ctl {

/// Sets the value in the document, making objects on the way; numbers are indices where the path meets an
/// array. The value is JSON, or text when it is not. `base` is what an index counts in while the document has
/// no array there yet (the preset's request); it is copied, because a merge patch replaces arrays whole.
/// Throws std::invalid_argument with a sentence.
void set_path(nlohmann::json& document, const nlohmann::json& base, const std::string& assignment);

}  // namespace slew::ctl
