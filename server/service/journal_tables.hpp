// The journal's tables, from version to version: made in a new file, brought up to date in an older one after
// a copy was kept, and left alone in a newer one.
#pragma once

#include <filesystem>

struct sqlite3;

namespace slew::service {

inline constexpr int kJournalVersion = 2;

/// Of what is in `file`, opened as `database`. An older journal stays beside it as `<file>.v<version>`.
/// Throws JournalError; then not a byte of the file has changed.
void prepare_tables(sqlite3* database, const std::filesystem::path& file);

}  // namespace slew::service
