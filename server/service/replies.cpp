#include "server/service/replies.hpp"

#include <nlohmann/json.hpp>

#include "idl/wire/text.hpp"

namespace slew::service {

std::string Saying::json() const {
  nlohmann::json document = {{"code", code}, {"sentence", sentence}, {"warnings", warnings}};
  auto& listed = document["violations"] = nlohmann::json::array();
  for (const Violation& violation : violations) listed.push_back(to_json(violation));
  return document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void Replies::write(const wire::Id& request_id, const wire::Id& experiment_id, wire::Phase phase,
                    const Saying& saying) {
  send(request_id, experiment_id, phase, saying, wire::is_terminal(phase));
}

void Replies::write_control(const wire::Id& request_id, const wire::Id& experiment_id, wire::Phase phase,
                            const Saying& saying) {
  send(request_id, experiment_id, phase, saying, true);
}

void Replies::send(const wire::Id& request_id, const wire::Id& experiment_id, wire::Phase phase,
                   const Saying& saying, bool is_last_word) {
  const std::string json = saying.json();
  slew_v1_Reply reply{};
  request_id.store(reply.request_id);
  experiment_id.store(reply.experiment_id);
  reply.phase = phase;
  wire::store(saying.code, reply.code);
  reply.json = wire::borrowed(json);
  writer_.write(reply);
  if (!is_last_word) return;
  const std::lock_guard lock(mutex_);
  last_words_.push_back({request_id, Monotonic::now()});
}

void Replies::forget(std::size_t keep, Monotonic::duration age) {
  const std::lock_guard lock(mutex_);
  const auto oldest = Monotonic::now() - age;
  while (!last_words_.empty() && (last_words_.size() > keep || last_words_.front().at < oldest)) {
    slew_v1_Reply key{};
    last_words_.front().request_id.store(key.request_id);
    writer_.dispose(key);
    last_words_.pop_front();
  }
}

}  // namespace slew::service
