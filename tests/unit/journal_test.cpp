// The journal: what was accepted is there after reopening; what is foreign is left alone.
#include "server/service/journal.hpp"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <atomic>

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

TEST(Journal, OfANewerVersionIsRefusedUntouched) {
  const test::TemporaryDirectory directory;
  const auto file = directory.path() / "journal.sqlite";
  { const Journal journal(file); }
  sqlite3* database = nullptr;
  sqlite3_open(file.c_str(), &database);
  sqlite3_exec(database, "PRAGMA user_version = 99", nullptr, nullptr, nullptr);
  sqlite3_close(database);
  try {
    const Journal journal(file);
    FAIL() << "it was opened";
  } catch (const JournalError& error) {
    EXPECT_NE(std::string(error.what()).find("version 99"), std::string::npos);
  }
}

}  // namespace
