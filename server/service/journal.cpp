#include "server/service/journal.hpp"

#include <sqlite3.h>

#include "server/service/journal_tables.hpp"

namespace slew::service {
namespace {

constexpr const char* kShortColumns =
    "experiment_id, request_id, client_id, sender, label, preset, timing_mode, fingerprint, duration_s, "
    "accepted_unix_ns, started_unix_ns, ended_unix_ns, phase, t_sim_s, crashes";

sqlite3* open(const std::filesystem::path& file, int flags) {
  sqlite3* database = nullptr;
  if (sqlite3_open_v2(file.c_str(), &database, flags | SQLITE_OPEN_NOMUTEX, nullptr) != SQLITE_OK) {
    const std::string why = database ? sqlite3_errmsg(database) : "out of memory";
    sqlite3_close(database);
    throw JournalError("the journal " + file.string() + " could not be opened: " + why);
  }
  sqlite3_busy_timeout(database, 5000);
  return database;
}

std::string execute(sqlite3* database, const char* sql) {
  if (sqlite3_exec(database, sql, nullptr, nullptr, nullptr) == SQLITE_OK) return "";
  return sqlite3_errmsg(database);
}

// A prepared statement; parameters and columns are taken in order.
class Statement {
 public:
  Statement(sqlite3* database, const std::string& sql) : database_(database) {
    if (sqlite3_prepare_v2(database, sql.c_str(), static_cast<int>(sql.size()), &statement_, nullptr) !=
        SQLITE_OK)
      throw JournalError(sqlite3_errmsg(database));
  }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  ~Statement() { sqlite3_finalize(statement_); }

  Statement& bind(const wire::Id& id) {
    sqlite3_bind_blob(statement_, ++bound_, id.octets.data(), 16, SQLITE_TRANSIENT);
    return *this;
  }
  Statement& bind(const std::string& text) {
    sqlite3_bind_text(statement_, ++bound_, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
    return *this;
  }
  Statement& bind(std::int64_t value) {
    sqlite3_bind_int64(statement_, ++bound_, value);
    return *this;
  }
  Statement& bind(double value) {
    sqlite3_bind_double(statement_, ++bound_, value);
    return *this;
  }

  bool step() {
    read_ = 0;
    const int code = sqlite3_step(statement_);
    if (code == SQLITE_ROW) return true;
    if (code == SQLITE_DONE) return false;
    throw JournalError(sqlite3_errmsg(database_));
  }

  wire::Id id() {
    wire::Id id;
    if (sqlite3_column_bytes(statement_, read_) == 16)
      std::memcpy(id.octets.data(), sqlite3_column_blob(statement_, read_), 16);
    ++read_;
    return id;
  }
  std::string text() {
    const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_, read_));
    std::string text(bytes ? bytes : "", static_cast<std::size_t>(sqlite3_column_bytes(statement_, read_)));
    ++read_;
    return text;
  }
  std::int64_t integer() { return sqlite3_column_int64(statement_, read_++); }
  double real() { return sqlite3_column_double(statement_, read_++); }

 private:
  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
  int read_ = 0;
};

JournalEntry read_short(Statement& row) {
  JournalEntry entry;
  entry.experiment_id = row.id();
  entry.request_id = row.id();
  entry.client_id = row.text();
  entry.sender = row.text();
  entry.label = row.text();
  entry.preset = row.text();
  entry.timing_mode = row.text();
  entry.fingerprint = row.text();
  entry.duration_s = row.real();
  entry.accepted_unix_ns = row.integer();
  entry.started_unix_ns = row.integer();
  entry.ended_unix_ns = row.integer();
  entry.phase = static_cast<wire::Phase>(row.integer());
  entry.t_sim_s = row.real();
  entry.crashes = row.integer();
  return entry;
}

JournalEntry read_whole(Statement& row) {
  JournalEntry entry = read_short(row);
  entry.request = row.text();
  entry.result = row.text();
  return entry;
}

std::string select_whole() {
  return std::string("SELECT ") + kShortColumns + ", request, result ";
}

void insert(sqlite3* database, const JournalEntry& entry) {
  Statement statement(
      database,
      "INSERT INTO experiment (experiment_id, request_id, experiment_hex, request_hex, client_id, "
      "sender, label, preset, timing_mode, request, fingerprint, duration_s, accepted_unix_ns, phase) "
      "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  statement.bind(entry.experiment_id)
      .bind(entry.request_id)
      .bind(entry.experiment_id.hex())
      .bind(entry.request_id.hex())
      .bind(entry.client_id)
      .bind(entry.sender)
      .bind(entry.label)
      .bind(entry.preset)
      .bind(entry.timing_mode)
      .bind(entry.request)
      .bind(entry.fingerprint)
      .bind(entry.duration_s)
      .bind(entry.accepted_unix_ns)
      .bind(static_cast<std::int64_t>(slew_v1_ACCEPTED))
      .step();
}

void update(sqlite3* database, const JournalEntry& entry) {
  Statement statement(database,
                      "UPDATE experiment SET phase = ?, started_unix_ns = ?, ended_unix_ns = ?, t_sim_s = ?, "
                      "result = ? WHERE experiment_id = ?");
  statement.bind(static_cast<std::int64_t>(entry.phase))
      .bind(entry.started_unix_ns)
      .bind(entry.ended_unix_ns)
      .bind(entry.t_sim_s)
      .bind(entry.result)
      .bind(entry.experiment_id)
      .step();
}

void note_crash(sqlite3* database, const wire::Id& id) {
  Statement(database,
            "UPDATE experiment SET crashes = crashes + 1 WHERE experiment_id = ? AND ended_unix_ns = 0")
      .bind(id)
      .step();
}

// Acceptance comes before the end, so its index leads to the candidates.
std::vector<wire::Id> remove_ended(sqlite3* database, std::int64_t before_unix_ns, std::size_t most) {
  std::vector<wire::Id> ids;
  {
    Statement row(
        database,
        "SELECT experiment_id FROM experiment WHERE accepted_unix_ns < ?1 AND ended_unix_ns != 0 AND "
        "ended_unix_ns < ?1 ORDER BY accepted_unix_ns LIMIT ?2");
    row.bind(before_unix_ns).bind(static_cast<std::int64_t>(most));
    while (row.step()) ids.push_back(row.id());
  }
  for (const wire::Id& id : ids)
    Statement(database, "DELETE FROM experiment WHERE experiment_id = ?").bind(id).step();
  return ids;
}

}  // namespace

Journal::Journal(const std::filesystem::path& file, const std::vector<wire::Id>& suspects)
    : database_(open(file, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE)) {
  try {
    prepare_tables(database_, file);
    for (const wire::Id& id : suspects) note_crash(database_, id);
  } catch (const JournalError& error) {
    sqlite3_close(database_);
    throw JournalError("the journal " + file.string() + " cannot be used: " + error.what());
  }
  thread_ = std::thread([this] { run(); });
}

Journal::~Journal() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  thread_.join();
  sqlite3_close(database_);
}

void Journal::accept(JournalEntry entry, Committed committed) {
  {
    const std::lock_guard lock(mutex_);
    pending_.push_back({Kind::accept, std::move(entry), std::move(committed)});
  }
  wake_.notify_one();
}

void Journal::finish(JournalEntry entry, Committed committed) {
  {
    const std::lock_guard lock(mutex_);
    pending_.push_back({Kind::finish, std::move(entry), std::move(committed)});
  }
  wake_.notify_one();
}

void Journal::remove_ended_before(std::int64_t unix_ns, std::size_t most,
                                  std::function<void(const std::vector<wire::Id>&)> removed) {
  auto ids = std::make_shared<std::vector<wire::Id>>();
  {
    const std::lock_guard lock(mutex_);
    pending_.push_back({Kind::remove,
                        {},
                        [ids, removed = std::move(removed)](const std::string& error) {
                          if (error.empty()) removed(*ids);
                        },
                        unix_ns,
                        most,
                        ids});
  }
  wake_.notify_one();
}

void Journal::flush() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] { return pending_.empty() && !is_committing_; });
}

void Journal::run() {
  std::vector<Operation> batch;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      is_committing_ = false;
      if (pending_.empty()) idle_.notify_all();
      wake_.wait(lock, [this] { return stopping_ || !pending_.empty(); });
      if (pending_.empty()) return;
      is_committing_ = true;
      batch.swap(pending_);
    }
    std::string error = commit(batch);
    if (!error.empty() && batch.size() > 1) {
      // One bad entry must not take its neighbours along.
      for (Operation& operation : batch) {
        std::vector<Operation> alone;
        alone.push_back(std::move(operation));
        const std::string why = commit(alone);
        alone.front().committed(why);
      }
    } else {
      for (const Operation& operation : batch) operation.committed(error);
    }
    batch.clear();
  }
}

std::string Journal::commit(std::vector<Operation>& batch) {
  try {
    if (std::string why = execute(database_, "BEGIN IMMEDIATE"); !why.empty()) return why;
    for (const Operation& operation : batch) {
      if (operation.kind == Kind::accept) insert(database_, operation.entry);
      if (operation.kind == Kind::finish) update(database_, operation.entry);
      if (operation.kind == Kind::remove)
        *operation.removed = remove_ended(database_, operation.before_unix_ns, operation.most);
    }
    std::string why = execute(database_, "COMMIT");
    if (!why.empty()) execute(database_, "ROLLBACK");
    return why;
  } catch (const JournalError& error) {
    execute(database_, "ROLLBACK");
    return error.what();
  }
}

JournalReader::JournalReader(const std::filesystem::path& file)
    : database_(open(file, SQLITE_OPEN_READONLY)) {}

JournalReader::~JournalReader() {
  sqlite3_close(database_);
}

std::optional<JournalEntry> JournalReader::by_request(const wire::Id& request_id) {
  Statement row(database_, select_whole() + "FROM experiment WHERE request_id = ?");
  row.bind(request_id);
  if (!row.step()) return std::nullopt;
  return read_whole(row);
}

Found JournalReader::by_prefix(const std::string& digits) {
  Found found;
  // 'g' sorts after every hexadecimal digit.
  Statement row(database_, select_whole() +
                               "FROM experiment WHERE (experiment_hex >= ?1 AND experiment_hex < ?2) OR "
                               "(request_hex >= ?1 AND request_hex < ?2) LIMIT 2");
  row.bind(digits).bind(digits + "g");
  while (row.step()) {
    if (++found.matches == 1)
      found.entry = read_whole(row);
    else
      found.entry.reset();
  }
  return found;
}

std::vector<JournalEntry> JournalReader::page(std::size_t limit, std::size_t offset) {
  // What is passed over is counted off in the index; only the page itself is read.
  Statement row(database_,
                std::string("SELECT ") + kShortColumns +
                    " FROM experiment WHERE experiment_id IN (SELECT experiment_id FROM experiment "
                    "ORDER BY accepted_unix_ns DESC LIMIT ? OFFSET ?) ORDER BY accepted_unix_ns DESC");
  row.bind(static_cast<std::int64_t>(limit)).bind(static_cast<std::int64_t>(offset));
  std::vector<JournalEntry> entries;
  while (row.step()) entries.push_back(read_short(row));
  return entries;
}

std::size_t JournalReader::count() {
  Statement row(database_, "SELECT count(*) FROM experiment");
  return row.step() ? static_cast<std::size_t>(row.integer()) : 0;
}

std::vector<JournalEntry> JournalReader::unfinished() {
  Statement row(database_,
                select_whole() + "FROM experiment WHERE ended_unix_ns = 0 ORDER BY accepted_unix_ns");
  std::vector<JournalEntry> entries;
  while (row.step()) entries.push_back(read_whole(row));
  return entries;
}

}  // namespace slew::service
