// Presets: requests with a name, a summary and a source. Data, not code: schemas/presets/.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace slew {

struct Preset {
  std::string name;     ///< "agrawal-bang-1995/rigid-single-sided"
  std::string summary;  ///< what it shows
  std::string source;   ///< equation, figure or table row
};

/// All of them, by name.
const std::vector<Preset>& presets();
/// The whole file; null when there is no such preset. Names are looked up in a list, never on the disk.
const nlohmann::json* preset_document(std::string_view name);

}  // namespace slew
