#include "server/service/intake.hpp"

#include <spdlog/spdlog.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "idl/wire/text.hpp"
#include "server/experiment/limits.hpp"
#include "server/service/fingerprint.hpp"
#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

// The same for the same JSON, however it is laid out. The text has been parsed within limits before.
std::string fingerprint_of_request(std::string_view text) {
  return fingerprint_of(nlohmann::json::parse(text).dump());
}

// Names of clients end up in logs, tables and JSON: what is not printable ASCII becomes '?'.
std::string printable(std::string_view text) {
  std::string clean(text);
  for (char& c : clean)
    if (c < 0x20 || c > 0x7E) c = '?';
  return clean;
}

// What went wrong inside is told to the one who asked; everybody else is still to be served.
template <typename Action>
std::optional<Saying> tried(Action&& action) try {
  action();
  return std::nullopt;
} catch (const JournalError& error) {
  spdlog::error("the journal could not be read: {}", error.what());
  return Saying{"unavailable", std::string("the journal could not be read: ") + error.what()};
} catch (const std::bad_alloc&) {
  return Saying{"unavailable", "there was no memory left for this; try later"};
} catch (const std::exception& error) {
  spdlog::error("a request or control could not be taken in: {}", error.what());
  return Saying{"internal", error.what()};
}

std::string code_of(wire::Phase phase) {
  return phase >= slew_v1_FAILED ? std::string(wire::phase_name(phase)) : "ok";
}

}  // namespace

Intake::Intake(const wire::Domain& domain, Registry& registry, Journal& journal,
               const std::filesystem::path& journal_file, Admission& admission, SampleBudget& sample_budget,
               Replies& replies, Outlets outlets)
    : registry_(registry),
      journal_(journal),
      known_(journal_file),
      admission_(admission),
      sample_budget_(sample_budget),
      replies_(replies),
      outlets_(std::move(outlets)),
      request_(domain),
      control_(domain),
      waitset_(domain) {
  waitset_.attach(request_.entity());
  waitset_.attach(control_.entity());
  thread_ = std::thread([this] {
    name_this_thread("intake");
    serve();
  });
}

Intake::~Intake() {
  stopping_ = true;
  waitset_.wake();
  thread_.join();
  journal_.flush();  // acceptances under way come back here
}

void Intake::serve() {
  while (!stopping_) {
    waitset_.wait(std::chrono::milliseconds(500));
    // Controls first: a cancel should not wait behind a burst of requests.
    control_.take([this](const slew_v1_Control& control, const dds_sample_info_t& sample) {
      if (!sample.valid_data) return;
      if (const auto why_not = tried([&] { on_control(control); }))
        replies_.write_control(wire::Id::from(control.request_id), wire::Id::from(control.experiment_id),
                               slew_v1_REJECTED, *why_not);
    });
    request_.take(
        [this](const slew_v1_Request& request, const dds_sample_info_t& sample) {
          if (!sample.valid_data) return;
          if (const auto why_not = tried([&] { on_request(request); }))
            reject(wire::Id::from(request.request_id), *why_not);
        },
        32);
  }
}

void Intake::reject(const wire::Id& request_id, const Saying& saying) {
  rejected_.fetch_add(1, std::memory_order_relaxed);
  spdlog::info("[request {}] rejected: {}", request_id.hex(), saying.sentence);
  replies_.write(request_id, {}, slew_v1_REJECTED, saying);
}

// True when the request_id is known; it has been answered then.
bool Intake::answer_again(const wire::Id& request_id, const std::string& fingerprint) {
  wire::Id experiment_id;
  wire::Phase phase = slew_v1_RECEIVED;
  std::string known_fingerprint;
  if (const auto flight = registry_.by_request(request_id)) {
    experiment_id = flight->entry().experiment_id;
    phase = flight->phase();
    known_fingerprint = flight->entry().fingerprint;
  } else if (const auto entry = known_.by_request(request_id)) {
    experiment_id = entry->experiment_id;
    phase = entry->phase;
    known_fingerprint = entry->fingerprint;
  } else {
    return false;
  }
  if (known_fingerprint != fingerprint) {
    reject(request_id, {"conflict", "this request_id was used before, with another request"});
  } else if (phase != slew_v1_RECEIVED) {  // otherwise its first answer is on its way
    replies_.write(request_id, experiment_id, phase, {code_of(phase), "the same request, answered again"});
  }
  return true;
}

std::optional<Saying> Intake::no_room_for(const Prepared& prepared, double load) const {
  const std::size_t most = limits().max_queued_experiments;
  if (registry_.alive_count() >= most)
    return Saying{"busy", "the server holds " + std::to_string(most) +
                              " experiments that have not ended, and takes no more; try later"};
  if (prepared.timing.mode == TimingMode::as_fast_as_possible) return std::nullopt;
  if (const auto why = admission_.refusal(load)) return Saying{"busy", *why};
  return std::nullopt;
}

void Intake::on_request(const slew_v1_Request& request) {
  const auto request_id = wire::Id::from(request.request_id);
  if (request_id.is_zero()) {
    malformed_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  auto outcome = prepare(wire::view(request.json));
  auto* prepared = std::get_if<Prepared>(&outcome);
  const std::string fingerprint = prepared ? fingerprint_of_request(wire::view(request.json)) : "";
  if (answer_again(request_id, fingerprint)) return;
  if (!prepared) {
    const auto& rejection = std::get<Rejection>(outcome);
    reject(request_id, {rejection.code, rejection.sentence, rejection.violations});
    return;
  }
  if (draining_) {
    reject(request_id, {"draining", "the server is shutting down; try again when it is back"});
    return;
  }
  if (prepared->timing.start == TimingStart::wall_time && prepared->timing.start_unix_ns < unix_ns()) {
    reject(request_id,
           {"invalid",
            "the request was refused: the time to start at has passed (/timing/start)",
            {{"/timing/start", "the time to start at has passed",
              nlohmann::json::parse(prepared->resolved).at("timing").at("start").dump(), "a time to come"}}});
    return;
  }
  const bool is_paced = prepared->timing.mode != TimingMode::as_fast_as_possible;
  const double load = is_paced ? Admission::trial_load(*prepared) : 0;
  if (const auto saying = no_room_for(*prepared, load)) return reject(request_id, *saying);

  JournalEntry entry;
  entry.experiment_id = wire::Id::make();
  entry.request_id = request_id;
  entry.client_id = printable(wire::view(request.client_id));
  entry.sender = printable(wire::view(request.sender));
  entry.label = prepared->label;
  entry.preset = prepared->preset;
  entry.timing_mode = timing_mode_name(prepared->timing.mode);
  entry.request = wire::view(request.json);
  entry.fingerprint = fingerprint;
  entry.duration_s = prepared->duration_s;
  entry.accepted_unix_ns = unix_ns();
  std::vector<std::string> warnings = prepared->warnings;
  const auto flight = std::make_shared<Flight>(entry, std::move(*prepared), &sample_budget_);
  flight->set_trial_load(load);
  if (is_paced) admission_.admit(flight);
  registry_.add(flight);
  journal_.accept(std::move(entry), [this, flight, warnings](const std::string& error) {
    const JournalEntry& accepted = flight->entry();
    if (!error.empty()) {
      spdlog::error("[request {}] not accepted, the journal says: {}", accepted.request_id.hex(), error);
      registry_.remove(flight);
      reject(accepted.request_id,
             {"unavailable", "the request could not be written to the journal: " + error});
      return;
    }
    accepted_.fetch_add(1, std::memory_order_relaxed);
    flight->enter(slew_v1_ACCEPTED);
    spdlog::info("[{}] accepted: {} ({}) for {}", accepted.experiment_id.hex(),
                 accepted.preset.empty() ? "request" : accepted.preset, accepted.timing_mode,
                 accepted.client_id);
    replies_.write(accepted.request_id, accepted.experiment_id, slew_v1_ACCEPTED,
                   {"ok", "accepted", {}, warnings});
    outlets_.launch(flight);
  });
}

void Intake::on_control(const slew_v1_Control& control) {
  const auto request_id = wire::Id::from(control.request_id);
  const auto experiment_id = wire::Id::from(control.experiment_id);
  if (request_id.is_zero()) {
    malformed_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  const auto flight = registry_.by_experiment(experiment_id);
  if (!flight || flight->phase() == slew_v1_RECEIVED) {
    const bool is_known = known_.by_prefix(experiment_id.hex()).matches == 1;
    replies_.write_control(request_id, experiment_id, slew_v1_REJECTED,
                           is_known ? Saying{"not_possible", "the experiment has ended"}
                                    : Saying{"not_found", "there is no experiment " + experiment_id.hex()});
    return;
  }
  const auto not_possible = [&](const char* why) {
    replies_.write_control(request_id, experiment_id, flight->phase(), {"not_possible", why});
  };
  if (wire::is_terminal(flight->phase())) return not_possible("the experiment has ended");
  Wishes wishes;
  const bool is_positive = std::isfinite(control.value) && control.value > 0;
  switch (control.action) {
    case slew_v1_CANCEL:
      wishes.cancel = true;
      break;
    case slew_v1_PAUSE:
      wishes.pause = true;
      break;
    case slew_v1_RESUME:
      wishes.pause = false;
      break;
    case slew_v1_STEP:
      if (!is_positive) return not_possible("a step is a positive number of simulated seconds");
      wishes.step_s = control.value;
      break;
    case slew_v1_RATE:
      if (!flight->is_paced()) return not_possible("only a paced experiment has a rate");
      if (!is_positive || control.value > limits().max_rate)
        return not_possible("the rate must be positive and within the limits");
      if (const auto why = admission_.refusal(flight->load() * (control.value / flight->rate() - 1));
          why && control.value > flight->rate()) {
        replies_.write_control(request_id, experiment_id, flight->phase(), {"busy", *why});
        return;
      }
      wishes.rate = control.value;
      break;
  }
  outlets_.wish(flight, wishes);
  spdlog::info("[{}] control {} by {}", experiment_id.hex(), static_cast<int>(control.action),
               printable(wire::view(control.client_id)));
  replies_.write_control(request_id, experiment_id, flight->phase(), {"ok", "passed on"});
}

}  // namespace slew::service
