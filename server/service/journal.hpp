// The journal: what was promised and what became of it, in SQLite, so that `accepted` survives kill -9.
// See server/doc/recovery.md.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "idl/wire/id.hpp"
#include "idl/wire/phase.hpp"

struct sqlite3;

namespace slew::service {

/// One accepted experiment. Times are nanoseconds since 1970; 0: not yet.
struct JournalEntry {
  wire::Id experiment_id;
  wire::Id request_id;
  std::string client_id;
  std::string sender;
  std::string label;
  std::string preset;
  std::string timing_mode;
  std::string request;      ///< the JSON as it came
  std::string fingerprint;  ///< of the request's JSON, formatting left aside
  double duration_s = 0;
  std::int64_t accepted_unix_ns = 0;
  std::int64_t started_unix_ns = 0;
  std::int64_t ended_unix_ns = 0;
  wire::Phase phase = slew_v1_ACCEPTED;
  double t_sim_s = 0;
  std::int64_t crashes = 0;  ///< how often the server went down while it flew this
  std::string result;        ///< the result document; empty until there is one
};

/// Opening says why it failed: newer than this program, damaged, not writable.
class JournalError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Called from the journal's thread after the commit; the text is empty when all is well.
using Committed = std::function<void(const std::string& error)>;

/// Writes. Entries handed over while a commit is under way share the next one.
class Journal {
 public:
  /// `suspects` were being flown when the server went down; it is noted of those that have not ended. Throws
  /// JournalError.
  explicit Journal(const std::filesystem::path& file, const std::vector<wire::Id>& suspects = {});
  ~Journal();  ///< commits what is pending

  void accept(JournalEntry entry, Committed committed);
  /// Writes phase, times, t_sim_s and result of an accepted experiment.
  void finish(JournalEntry entry, Committed committed);
  /// Removes experiments that ended before this, at most `most` at a time, oldest first; `removed` gets them,
  /// after the commit, from the journal's thread.
  void remove_ended_before(std::int64_t unix_ns, std::size_t most,
                           std::function<void(const std::vector<wire::Id>&)> removed);
  /// Waits until everything handed over so far has been committed and its callbacks have returned.
  void flush();

 private:
  enum class Kind { accept, finish, remove };
  struct Operation {
    Kind kind;
    JournalEntry entry;
    Committed committed;
    std::int64_t before_unix_ns = 0;
    std::size_t most = 0;
    std::shared_ptr<std::vector<wire::Id>> removed = nullptr;
  };
  void run();
  std::string commit(std::vector<Operation>& batch);

  sqlite3* database_ = nullptr;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Operation> pending_;
  std::condition_variable idle_;
  bool is_committing_ = false;
  bool stopping_ = false;
  std::thread thread_;
};

/// How often an id's beginning fits.
struct Found {
  std::size_t matches = 0;
  std::optional<JournalEntry> entry;  ///< when exactly one does
};

/// Reads, beside the writer. One thread at a time.
class JournalReader {
 public:
  explicit JournalReader(const std::filesystem::path& file);
  ~JournalReader();
  JournalReader(const JournalReader&) = delete;
  JournalReader& operator=(const JournalReader&) = delete;

  std::optional<JournalEntry> by_request(const wire::Id& request_id);
  /// By the first hexadecimal digits of an experiment's or a request's id.
  Found by_prefix(const std::string& digits);
  /// Newest first, without request and result texts.
  std::vector<JournalEntry> page(std::size_t limit, std::size_t offset);
  std::size_t count();
  /// Accepted, not ended: what a restart owes, oldest first.
  std::vector<JournalEntry> unfinished();

 private:
  sqlite3* database_ = nullptr;
};

}  // namespace slew::service
