// The journal: what was accepted is there after reopening; what is foreign is left alone.
#include "server/service/journal.hpp"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <atomic>
#include <fstream>
#include <sstream>

#include "tests/service/process.hpp"

namespace {

using namespace slew;
using namespace slew::service;

JournalEntry entry(const std::string& request = "{}") {
  JournalEntry made;
  made.experiment_id = wire::Id::make();
  made.request_id = wire::Id::make();
  made.request = request;
  made.fingerprint = "f";
  made.accepted_unix_ns = 1;
  return made;
}

TEST(Journal, KeepsWhatWasAcceptedAndWhatEnded) {
  const test::TemporaryDirectory directory;
  const auto file = directory.path() / "journal.sqlite";
  JournalEntry first = entry("first"), second = entry("second");
  {
    Journal journal(file);
    std::atomic<int> committed{0};
    for (const JournalEntry& made : {first, second})
      journal.accept(made, [&](const std::string& error) { committed += error.empty(); });
    first.phase = slew_v1_COMPLETED;
    first.ended_unix_ns = 5;
    first.result = "{\"a\":1}";
    journal.finish(first, [&](const std::string& error) { committed += error.empty(); });
    journal.flush();
    EXPECT_EQ(committed, 3);
  }
  const Journal again(file);
  JournalReader reader(file);
  const auto unfinished = reader.unfinished();
  ASSERT_EQ(unfinished.size(), 1u);
  EXPECT_EQ(unfinished[0].request, "second");
  const auto found = reader.by_prefix(first.request_id.hex());
  ASSERT_EQ(found.matches, 1u);
  EXPECT_EQ(found.entry->result, "{\"a\":1}");
  EXPECT_EQ(found.entry->phase, slew_v1_COMPLETED);
  EXPECT_EQ(reader.count(), 2u);
  EXPECT_EQ(reader.by_prefix("ffffffff").matches, 0u);
}

TEST(Journal, OneBadEntryDoesNotTakeItsNeighboursAlong) {
  const test::TemporaryDirectory directory;
  const auto file = directory.path() / "journal.sqlite";
  Journal journal(file);
  const JournalEntry good = entry();
  JournalEntry twin = entry();
  twin.request_id = good.request_id;  // unique in the table
  std::atomic<int> well{0}, badly{0};
  const auto count = [&](const std::string& error) { ++(error.empty() ? well : badly); };
  journal.accept(good, count);
  journal.accept(twin, count);
  journal.accept(entry(), count);
  journal.flush();
  EXPECT_EQ(well, 2);
  EXPECT_EQ(badly, 1);
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return bytes.str();
}

// A connection of the test's own, which leaves its log behind as a killed program does.
class Database {
 public:
  explicit Database(const std::filesystem::path& file) {
    sqlite3_open(file.c_str(), &database_);
    sqlite3_db_config(database_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  ~Database() { sqlite3_close(database_); }
  void execute(const char* sql) {
    EXPECT_EQ(sqlite3_exec(database_, sql, nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(database_);
  }

 private:
  sqlite3* database_ = nullptr;
};

std::string why_refused(const std::filesystem::path& file) {
  try {
    const Journal journal(file);
    return "";
  } catch (const JournalError& error) {
    return error.what();
  }
}

TEST(Journal, OfANewerVersionIsRefusedUntouched) {
  const test::TemporaryDirectory directory;
  const auto file = directory.path() / "journal.sqlite", log = directory.path() / "journal.sqlite-wal";
  { const Journal journal(file); }
  Database(file).execute("PRAGMA user_version = 99; CREATE TABLE newer (a); INSERT INTO newer VALUES (1)");
  const std::string before = bytes_of(file), log_before = bytes_of(log);
  ASSERT_FALSE(log_before.empty());
  EXPECT_NE(why_refused(file).find("version 99"), std::string::npos);
  EXPECT_EQ(bytes_of(file), before);
  EXPECT_EQ(bytes_of(log), log_before);
}

TEST(Journal, OfAnotherProgramIsRefusedUntouched) {
  const test::TemporaryDirectory directory;
  const auto file = directory.path() / "journal.sqlite";
  Database(file).execute("CREATE TABLE accounts (a); INSERT INTO accounts VALUES (1)");
  const std::string before = bytes_of(file);
  EXPECT_NE(why_refused(file).find("another program"), std::string::npos);
  EXPECT_EQ(bytes_of(file), before);
}

// As version 1 wrote it, with something in its log that is in no file yet.
void write_version_1(const std::filesystem::path& file) {
  Database database(file);
  database.execute(R"sql(
    PRAGMA journal_mode = WAL;
    CREATE TABLE experiment (
      experiment_id BLOB PRIMARY KEY NOT NULL, request_id BLOB NOT NULL UNIQUE, experiment_hex TEXT NOT NULL,
      request_hex TEXT NOT NULL, client_id TEXT NOT NULL, sender TEXT NOT NULL, label TEXT NOT NULL,
      preset TEXT NOT NULL, timing_mode TEXT NOT NULL, request TEXT NOT NULL, fingerprint TEXT NOT NULL,
      duration_s REAL NOT NULL, accepted_unix_ns INTEGER NOT NULL, started_unix_ns INTEGER NOT NULL DEFAULT 0,
      ended_unix_ns INTEGER NOT NULL DEFAULT 0, phase INTEGER NOT NULL, t_sim_s REAL NOT NULL DEFAULT 0,
      result TEXT NOT NULL DEFAULT '') STRICT, WITHOUT ROWID;
    CREATE UNIQUE INDEX experiment_by_hex ON experiment (experiment_hex);
    CREATE UNIQUE INDEX experiment_by_request_hex ON experiment (request_hex);
    CREATE INDEX experiment_by_time ON experiment (accepted_unix_ns);
    CREATE INDEX experiment_unfinished ON experiment (accepted_unix_ns) WHERE ended_unix_ns = 0;
    PRAGMA user_version = 1;
    INSERT INTO experiment VALUES (x'000102030405060708090a0b0c0d0e0f', x'100102030405060708090a0b0c0d0e0f',
      '000102030405060708090a0b0c0d0e0f', '100102030405060708090a0b0c0d0e0f', 'c', 's', 'l', 'p', 'real_time',
      'the request', 'f', 2.5, 7, 0, 0, 2, 0, ''))sql");
}

TEST(Journal, OfAnOlderVersionIsMigratedAndACopyKept) {
  const test::TemporaryDirectory directory;
  const auto file = directory.path() / "journal.sqlite", copy = directory.path() / "journal.sqlite.v1";
  write_version_1(file);
  // What an attempt that was killed left of its copy is in nobody's way.
  std::ofstream(copy.string() + ".tmp") << "half a copy";
  const auto id = *wire::Id::parse("000102030405060708090a0b0c0d0e0f");
  {
    const Journal journal(file, {id});
    JournalReader reader(file);
    const auto unfinished = reader.unfinished();
    ASSERT_EQ(unfinished.size(), 1u);
    EXPECT_EQ(unfinished[0].request, "the request");
    EXPECT_EQ(unfinished[0].duration_s, 2.5);
    EXPECT_EQ(unfinished[0].crashes, 1);
  }
  EXPECT_FALSE(std::filesystem::exists(copy.string() + ".tmp"));
  ASSERT_TRUE(std::filesystem::exists(copy));
  sqlite3* kept = nullptr;
  sqlite3_open_v2(copy.c_str(), &kept, SQLITE_OPEN_READONLY, nullptr);
  std::string text;
  sqlite3_exec(
      kept, "SELECT request || (SELECT user_version FROM pragma_user_version) FROM experiment",
      [](void* into, int, char** columns, char**) {
        *static_cast<std::string*>(into) = columns[0];
        return 0;
      },
      &text, nullptr);
  sqlite3_close(kept);
  EXPECT_EQ(text, "the request1");
}

// The same whether it was made today or has come all the way.
TEST(Journal, MigratedAndNewAreAlike) {
  const test::TemporaryDirectory directory;
  const auto old = directory.path() / "old.sqlite", fresh = directory.path() / "fresh.sqlite";
  write_version_1(old);
  const auto schema = [](const std::filesystem::path& file) {
    { const Journal journal(file); }
    sqlite3* database = nullptr;
    sqlite3_open_v2(file.c_str(), &database, SQLITE_OPEN_READONLY, nullptr);
    std::string columns;
    sqlite3_exec(
        database, "SELECT name || ' ' || type || ' ' || \"notnull\" FROM pragma_table_info('experiment')",
        [](void* into, int, char** row, char**) {
          *static_cast<std::string*>(into) += std::string(row[0]) + "\n";
          return 0;
        },
        &columns, nullptr);
    sqlite3_close(database);
    return columns;
  };
  const std::string of_fresh = schema(fresh);
  EXPECT_NE(of_fresh.find("crashes INTEGER 1"), std::string::npos) << of_fresh;
  EXPECT_EQ(schema(old), of_fresh);
}

}  // namespace
