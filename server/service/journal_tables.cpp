#include "server/service/journal_tables.hpp"

#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <array>
#include <string>
#include <system_error>

#include "server/service/journal.hpp"

namespace slew::service {
namespace {

// What version 1 was; later ones are made from it, so that new and migrated journals are alike.
constexpr const char* kFirstTables = R"sql(
CREATE TABLE experiment (
  experiment_id BLOB PRIMARY KEY NOT NULL,
  request_id BLOB NOT NULL UNIQUE,
  experiment_hex TEXT NOT NULL,
  request_hex TEXT NOT NULL,
  client_id TEXT NOT NULL,
  sender TEXT NOT NULL,
  label TEXT NOT NULL,
  preset TEXT NOT NULL,
  timing_mode TEXT NOT NULL,
  request TEXT NOT NULL,
  fingerprint TEXT NOT NULL,
  duration_s REAL NOT NULL,
  accepted_unix_ns INTEGER NOT NULL,
  started_unix_ns INTEGER NOT NULL DEFAULT 0,
  ended_unix_ns INTEGER NOT NULL DEFAULT 0,
  phase INTEGER NOT NULL,
  t_sim_s REAL NOT NULL DEFAULT 0,
  result TEXT NOT NULL DEFAULT ''
) STRICT, WITHOUT ROWID;
CREATE UNIQUE INDEX experiment_by_hex ON experiment (experiment_hex);
CREATE UNIQUE INDEX experiment_by_request_hex ON experiment (request_hex);
CREATE INDEX experiment_by_time ON experiment (accepted_unix_ns);
CREATE INDEX experiment_unfinished ON experiment (accepted_unix_ns) WHERE ended_unix_ns = 0;
)sql";

// From version i to i + 1.
constexpr std::array kSteps{
    kFirstTables,
    // How often the server went down while it flew this.
    "ALTER TABLE experiment ADD COLUMN crashes INTEGER NOT NULL DEFAULT 0;",
};
static_assert(kSteps.size() == kJournalVersion);

void execute(sqlite3* database, const std::string& sql) {
  if (sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
    throw JournalError(sqlite3_errmsg(database));
}

int number(sqlite3* database, const char* sql) {
  int value = 0;
  const auto keep = [](void* into, int, char** columns, char**) {
    *static_cast<int*>(into) = columns[0] ? std::atoi(columns[0]) : 0;
    return 0;
  };
  if (sqlite3_exec(database, sql, keep, &value, nullptr) != SQLITE_OK)
    throw JournalError(sqlite3_errmsg(database));
  return value;
}

void set_checkpoint_on_close(sqlite3* database, bool yes) {
  sqlite3_db_config(database, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, yes ? 0 : 1, nullptr);
}

// Whole under its final name, whatever happens while it is written.
void keep_copy(sqlite3* database, const std::filesystem::path& copy) {
  const std::string unfinished = copy.string() + ".tmp";
  std::filesystem::remove(unfinished);
  char* sql = sqlite3_mprintf("VACUUM INTO %Q", unfinished.c_str());
  const std::string statement = sql;
  sqlite3_free(sql);
  execute(database, statement);
  const int fd = ::open(unfinished.c_str(), O_RDWR | O_CLOEXEC);
  const bool is_durable = fd >= 0 && ::fsync(fd) == 0;
  if (fd >= 0) ::close(fd);
  if (!is_durable) throw JournalError("the copy " + unfinished + " could not be made durable");
  std::filesystem::rename(unfinished, copy);
}

}  // namespace

void prepare_tables(sqlite3* database, const std::filesystem::path& file) try {
  // Closing would otherwise write what a newer program left in its log into its file.
  set_checkpoint_on_close(database, false);
  const int version = number(database, "PRAGMA user_version");
  if (version > kJournalVersion)
    throw JournalError("it is of version " + std::to_string(version) + ", this program knows up to " +
                       std::to_string(kJournalVersion) +
                       "; it was left untouched. Start the newer program, or give another --state-dir");
  if (version < 0 || (version == 0 && number(database, "SELECT count(*) FROM sqlite_schema") > 0))
    throw JournalError("it is a database of another program; it was left untouched");
  set_checkpoint_on_close(database, true);
  // The promise: a commit is on the disk when it returns.
  execute(database, "PRAGMA journal_mode = WAL");
  execute(database, "PRAGMA synchronous = FULL");
  if (version == kJournalVersion) return;
  if (version > 0) keep_copy(database, file.string() + ".v" + std::to_string(version));
  std::string sql = "BEGIN IMMEDIATE;";
  for (std::size_t step = static_cast<std::size_t>(version); step < kSteps.size(); ++step)
    sql += kSteps[step];
  execute(database, sql + "PRAGMA user_version = " + std::to_string(kJournalVersion) + "; COMMIT;");
} catch (const std::filesystem::filesystem_error& error) {
  throw JournalError(error.what());
}

}  // namespace slew::service
