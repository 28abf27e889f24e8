#include "client/library/session.hpp"

#include <pwd.h>
#include <unistd.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "idl/wire/reader.hpp"
#include "idl/wire/text.hpp"
#include "idl/wire/waitset.hpp"
#include "idl/wire/writer.hpp"

namespace slew::client {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr auto kLook = milliseconds(100);
constexpr auto kSilenceBeforeRequestAgain = std::chrono::seconds(1);
constexpr auto kSilenceBeforeQueryAgain = milliseconds(500);
constexpr auto kSilenceBeforeAsking = std::chrono::seconds(2);

std::string user_at_host() {
  char host[129] = {};
  gethostname(host, sizeof host - 1);
  const passwd* user = getpwuid(getuid());
  return (user ? std::string(user->pw_name) : std::to_string(getuid())) + "@" + host;
}

Clock::time_point after(Duration timeout) {
  const auto longest = std::chrono::hours(24 * 365);
  return Clock::now() + (timeout < longest ? std::chrono::duration_cast<Clock::duration>(timeout)
                                           : std::chrono::duration_cast<Clock::duration>(longest));
}

std::optional<wire::Phase> phase_named(const std::string& name) {
  for (int phase = slew_v1_RECEIVED; phase <= slew_v1_EXPIRED; ++phase)
    if (wire::phase_name(static_cast<wire::Phase>(phase)) == name) return static_cast<wire::Phase>(phase);
  return std::nullopt;
}

}  // namespace

struct Session::Wire {
  explicit Wire(const SessionOptions& session_options)
      : options(session_options),
        domain(session_options.domain),
        query(domain),
        reply(domain),
        answer(domain),
        experiment(domain),
        server(domain),
        waitset(domain) {
    if (options.sender.empty()) options.sender = user_at_host();
    try {
      request.emplace(domain);
      control.emplace(domain);
    } catch (const wire::WireError&) {
      // DDS makes no writer of what an identity's permissions do not name.
      if (!domain.identity()) throw;
      request.reset();
      control.reset();
    }
    for (const dds_entity_t reader : {reply.entity(), answer.entity(), experiment.entity(), server.entity()})
      waitset.attach(reader);
  }

  // Takes whatever has arrived to where it is looked for.
  void collect(const Watcher& watcher) {
    reply.take([this](const slew_v1_Reply& said, const dds_sample_info_t& info) {
      if (!info.valid_data) return;
      const auto id = wire::Id::from(said.request_id);
      replies[id].push_back({id, wire::Id::from(said.experiment_id), said.phase,
                             std::string(wire::view(said.code)), std::string(wire::view(said.json))});
    });
    answer.take([this](const slew_v1_Answer& said, const dds_sample_info_t& info) {
      const auto all = answers.find(wire::Id::from(said.request_id));
      if (!info.valid_data || all == answers.end() || said.pages == 0 || said.page >= said.pages) return;
      Pages& pages = all->second[info.publication_handle];
      pages.code = wire::view(said.code);
      pages.texts.resize(said.pages);
      pages.texts[said.page] = std::string(wire::view(said.json));
    });
    experiment.take([&](const slew_v1_Experiment& status, const dds_sample_info_t& info) {
      if (info.valid_data && watcher) watcher(status);
    });
    server.take([this](const slew_v1_Server& status, const dds_sample_info_t& info) {
      const auto id = wire::Id::from(status.server_id);
      if (info.valid_data && info.instance_state == DDS_IST_ALIVE)
        servers[id] = status;
      else if (info.instance_state != DDS_IST_ALIVE)
        servers.erase(id);
    });
    // Replies to other clients are none of our business; they would pile up.
    for (auto place = replies.begin(); place != replies.end();)
      place = awaited.contains(place->first) ? std::next(place) : replies.erase(place);
  }

  void no_longer_awaited(const wire::Id& id) {
    awaited.erase(id);
    replies.erase(id);
  }

  struct Pages {
    std::string code;
    std::vector<std::optional<std::string>> texts;
    bool is_whole() const {
      if (texts.empty()) return false;
      for (const auto& text : texts)
        if (!text) return false;
      return true;
    }
  };

  SessionOptions options;
  wire::Domain domain;
  std::optional<wire::Writer<slew_v1_Request>> request;  ///< none for one who may not command
  std::optional<wire::Writer<slew_v1_Control>> control;
  wire::Writer<slew_v1_Query> query;
  wire::Reader<slew_v1_Reply> reply;
  wire::Reader<slew_v1_Answer> answer;
  wire::Reader<slew_v1_Experiment> experiment;
  wire::Reader<slew_v1_Server> server;
  wire::Waitset waitset;
  std::set<wire::Id> awaited;
  std::map<wire::Id, std::vector<Reply>> replies;
  std::map<wire::Id, std::map<dds_instance_handle_t, Pages>> answers;  ///< of each server that answers
  std::map<wire::Id, slew_v1_Server> servers;
};

Session::Session(const SessionOptions& options) : wire_(std::make_unique<Wire>(options)) {}
Session::~Session() = default;

const wire::Domain& Session::domain() const {
  return wire_->domain;
}

bool Session::may_command() const {
  return wire_->request && wire_->control;
}

bool Session::wait_for_server(Duration timeout) {
  const auto deadline = after(timeout);
  const auto is_matched = [this] {
    return (!wire_->request || wire_->request->matched() > 0) && wire_->query.matched() > 0 &&
           wire_->reply.matched() > 0 && wire_->answer.matched() > 0;
  };
  while (!is_matched()) {
    if (Clock::now() >= deadline) return false;
    std::this_thread::sleep_for(milliseconds(2));
  }
  return true;
}

std::optional<Reply> Session::submit(const std::string& json, const wire::Id& request_id, Duration timeout) {
  if (!may_command()) return std::nullopt;
  slew_v1_Request request{};
  request_id.store(request.request_id);
  wire::store(wire_->options.client_id, request.client_id);
  wire::store(wire_->options.sender, request.sender);
  request.json = wire::borrowed(json);
  wire_->awaited.insert(request_id);
  const auto deadline = after(timeout);
  auto again = Clock::now();
  std::optional<Reply> first;
  while (!first && Clock::now() < deadline) {
    if (Clock::now() >= again) {
      // A full reader on the server's side makes this wait for 2 s at most; then it is tried again.
      wire_->request->write(request);
      again = Clock::now() + kSilenceBeforeRequestAgain;
    }
    wire_->waitset.wait(kLook);
    wire_->collect({});
    if (const auto& said = wire_->replies[request_id]; !said.empty()) first = said.front();
  }
  wire_->request->unregister(request);
  return first;
}

void Session::forget(const wire::Id& request_id) {
  wire_->awaited.insert(request_id);
  // What is kept for late joiners comes within moments of the match.
  const auto settled = after(milliseconds(300));
  while (Clock::now() < settled) {
    wire_->waitset.wait(milliseconds(50));
    wire_->collect({});
  }
  wire_->replies.erase(request_id);
}

std::optional<Reply> Session::wait_for_end(const wire::Id& request_id, Duration timeout,
                                           const Watcher& watcher, const std::function<bool()>& keep_going) {
  wire_->awaited.insert(request_id);
  const auto deadline = after(timeout);
  auto ask = Clock::now() + kSilenceBeforeAsking;
  const auto mine = [&](const slew_v1_Experiment& status) {
    if (wire::Id::from(status.request_id) != request_id) return;
    ask = Clock::now() + kSilenceBeforeAsking;
    if (watcher) watcher(status);
  };
  while (Clock::now() < deadline && (!keep_going || keep_going())) {
    for (const Reply& said : wire_->replies[request_id])
      if (wire::is_terminal(said.phase)) {
        const Reply last = said;
        wire_->no_longer_awaited(request_id);
        return last;
      }
    wire_->waitset.wait(kLook);
    wire_->collect(mine);
    if (Clock::now() < ask) continue;
    // Nothing was heard for a while: the last word may have been said to a reader that was not there yet.
    const auto shown = query("show", nlohmann::json{{"id", request_id.hex()}}.dump(), kSilenceBeforeAsking);
    if (shown && shown->is_ok()) {
      const auto document = nlohmann::json::parse(shown->json, nullptr, false);
      const auto phase = phase_named(document.value("phase", ""));
      if (phase && wire::is_terminal(*phase)) {
        const auto experiment = wire::Id::parse(document.value("experiment_id", ""));
        const std::string name(wire::phase_name(*phase));
        wire_->no_longer_awaited(request_id);
        return Reply{request_id, experiment.value_or(wire::Id{}), *phase,
                     *phase == slew_v1_COMPLETED ? "ok" : name,
                     nlohmann::json{{"code", name},
                                    {"sentence", name},
                                    {"violations", nlohmann::json::array()},
                                    {"warnings", nlohmann::json::array()}}
                         .dump()};
      }
    }
    ask = Clock::now() + kSilenceBeforeAsking;
  }
  return std::nullopt;
}

std::optional<Reply> Session::control(Action action, const wire::Id& experiment_id, double value,
                                      Duration timeout) {
  if (!may_command()) return std::nullopt;
  const auto request_id = wire::Id::make();
  slew_v1_Control control{};
  request_id.store(control.request_id);
  experiment_id.store(control.experiment_id);
  wire::store(wire_->options.client_id, control.client_id);
  wire::store(wire_->options.sender, control.sender);
  switch (action) {
    case Action::cancel:
      control.action = slew_v1_CANCEL;
      break;
    case Action::pause:
      control.action = slew_v1_PAUSE;
      break;
    case Action::resume:
      control.action = slew_v1_RESUME;
      break;
    case Action::step:
      control.action = slew_v1_STEP;
      break;
    case Action::rate:
      control.action = slew_v1_RATE;
      break;
  }
  control.value = value;
  wire_->awaited.insert(request_id);
  const auto deadline = after(timeout);
  // Not repeated: a step that is taken twice is another step.
  wire_->control->write(control);
  std::optional<Reply> said;
  while (!said && Clock::now() < deadline) {
    wire_->waitset.wait(kLook);
    wire_->collect({});
    if (const auto& replies = wire_->replies[request_id]; !replies.empty()) said = replies.front();
  }
  wire_->control->unregister(control);
  wire_->no_longer_awaited(request_id);
  return said;
}

std::optional<Answer> Session::query(const std::string& kind, const std::string& arguments,
                                     Duration timeout) {
  const auto deadline = after(timeout);
  std::optional<Answer> whole;
  while (!whole && Clock::now() < deadline) {
    const auto request_id = wire::Id::make();
    slew_v1_Query query{};
    request_id.store(query.request_id);
    wire::store(wire_->options.client_id, query.client_id);
    wire::store(kind, query.kind);
    query.json = wire::borrowed(arguments);
    const auto& answers = wire_->answers[request_id];
    wire_->query.write(query);
    // Silence counts from the last page: a long answer is not asked for again while it is coming.
    auto silent_since = Clock::now();
    std::size_t heard = 0;
    while (Clock::now() < deadline && Clock::now() - silent_since < kSilenceBeforeQueryAgain) {
      wire_->waitset.wait(kLook);
      wire_->collect({});
      std::size_t now_heard = 0, servers = 0;
      for (const auto& [server, pages] : answers) {
        for (const auto& text : pages.texts) now_heard += text.has_value();
        if (!pages.is_whole() || (whole && whole->is_ok())) continue;
        ++servers;
        whole = Answer{pages.code, ""};
        for (const auto& text : pages.texts) whole->json += *text;
      }
      if (now_heard != heard) silent_since = Clock::now();
      heard = now_heard;
      // Where there are several servers, what one does not know another may.
      if (whole && (whole->is_ok() || servers >= wire_->answer.matched())) break;
    }
    wire_->query.unregister(query);
    wire_->answers.erase(request_id);
  }
  return whole;
}

std::vector<slew_v1_Server> Session::servers(Duration timeout, std::size_t enough) {
  const auto deadline = after(timeout);
  do {
    wire_->waitset.wait(kLook);
    wire_->collect({});
  } while (Clock::now() < deadline && wire_->servers.size() < enough);
  std::vector<slew_v1_Server> heard;
  for (const auto& [id, status] : wire_->servers) heard.push_back(status);
  return heard;
}

}  // namespace slew::client
