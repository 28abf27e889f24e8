// A seal at a file's end: 8 octets that name it and XXH3-128 over everything before them. Tells a file that
// was cut short, or of which a bit has turned, from the one that was written; it is no protection against
// intent.
#pragma once

#include <filesystem>
#include <vector>

namespace slew {

void seal(std::vector<char>& bytes);

/// False also where the file cannot be read.
bool is_sealed(const std::filesystem::path& file);

}  // namespace slew
