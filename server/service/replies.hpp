// Replies to requests and controls, and how long they stay for late joiners.
#pragma once

#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "idl/wire/id.hpp"
#include "idl/wire/phase.hpp"
#include "idl/wire/writer.hpp"
#include "server/experiment/document.hpp"
#include "server/service/clock.hpp"

namespace slew::service {

/// A code for programs, a sentence for people, and the details (schemas/reply.schema.json).
struct Saying {
  std::string code;
  std::string sentence;
  std::vector<Violation> violations = {};
  std::vector<std::string> warnings = {};

  std::string json() const;
};

/// Safe to use from several threads; never blocks.
class Replies {
 public:
  explicit Replies(const wire::Domain& domain) : writer_(domain) {}

  /// What became of a request. A terminal phase is the last word on it.
  void write(const wire::Id& request_id, const wire::Id& experiment_id, wire::Phase phase,
             const Saying& saying);
  /// What became of a control; always the last word.
  void write_control(const wire::Id& request_id, const wire::Id& experiment_id, wire::Phase phase,
                     const Saying& saying);

  /// Disposes replies that were the last word on their request, beyond the newest `keep` or older than `age`.
  void forget(std::size_t keep, Monotonic::duration age);

 private:
  struct LastWord {
    wire::Id request_id;
    Monotonic::time_point at;
  };

  void send(const wire::Id& request_id, const wire::Id& experiment_id, wire::Phase phase,
            const Saying& saying, bool is_last_word);

  wire::Writer<slew_v1_Reply> writer_;
  std::mutex mutex_;
  std::deque<LastWord> last_words_;
};

}  // namespace slew::service
