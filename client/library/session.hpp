// A client's place on the wire: submit, wait, control, query. Errors are values; one thread at a time.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "idl/wire/domain.hpp"
#include "idl/wire/id.hpp"
#include "idl/wire/phase.hpp"

namespace slew::client {

using Duration = std::chrono::nanoseconds;

struct SessionOptions {
  wire::DomainOptions domain;
  std::string client_id = "client";  ///< what as-fast work is shared out by
  std::string sender;                ///< what this client says of itself; empty: user@host
};

/// What a server said of a request or a control (schemas/reply.schema.json).
struct Reply {
  wire::Id request_id;
  wire::Id experiment_id;
  wire::Phase phase;
  std::string code;
  std::string json;
};

/// The answer to a query: its code, and one JSON document.
struct Answer {
  std::string code;
  std::string json;
  bool is_ok() const { return code == "ok"; }
};

enum class Action { cancel, pause, resume, step, rate };

class Session {
 public:
  /// Throws wire::WireError when the domain cannot be entered.
  explicit Session(const SessionOptions& options);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  const wire::Domain& domain() const;

  /// Whether this client's own permissions let it request and control; without DDS Security everybody's do.
  bool may_command() const;

  /// Whether a server takes requests (of one who may not command: queries) within the time. DDS does not say
  /// why not: there is none, or it does not permit this client.
  bool wait_for_server(Duration timeout);

  /// Writes the request and waits for the first word on it; writes it again after a second of silence, which
  /// is always safe. Empty when the time ran out.
  std::optional<Reply> submit(const std::string& json, const wire::Id& request_id, Duration timeout);

  /// Passes over what was said on a request before now: late joiners are told again. For ids that were used
  /// before.
  void forget(const wire::Id& request_id);

  /// Called with every status of the experiment that is waited for.
  using Watcher = std::function<void(const slew_v1_Experiment&)>;
  /// Until the request's last word, also when the server restarts meanwhile. `keep_going` is asked about ten
  /// times a second. Empty when the time ran out or it said no.
  std::optional<Reply> wait_for_end(const wire::Id& request_id, Duration timeout, const Watcher& watcher = {},
                                    const std::function<bool()>& keep_going = {});

  std::optional<Reply> control(Action action, const wire::Id& experiment_id, double value, Duration timeout);

  /// Asks, joins the pages; asks again after half a second of silence.
  std::optional<Answer> query(const std::string& kind, const std::string& arguments, Duration timeout);

  /// The servers that are heard within the time, which is waited out unless `enough` have been heard.
  std::vector<slew_v1_Server> servers(Duration timeout, std::size_t enough = SIZE_MAX);

 private:
  struct Wire;
  std::unique_ptr<Wire> wire_;
};

}  // namespace slew::client
