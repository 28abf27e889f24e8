// The schemas and presets, as they were when the program was built.
#pragma once

#include <span>
#include <string_view>

namespace slew {

/// `name` is the path below schemas/, e.g. "request.schema.json",
/// "presets/agrawal-bang-1995/rigid-single-sided.json".
struct EmbeddedFile {
  std::string_view name;
  std::string_view text;
};

std::span<const EmbeddedFile> embedded_files();

}  // namespace slew
