#include "server/service/finisher.hpp"

#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>

#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

// While one waits for the disk, another makes the next file.
constexpr std::size_t kThreads = 2;
// Between two offers to a disk that refuses.
constexpr auto kPatience = std::chrono::milliseconds(200);
constexpr const char* kLeftInAStep = "the server went down while a step went on; what was recorded is lost";

nlohmann::json lateness_document(const Flight& flight) {
  if (!flight.is_paced()) return nullptr;
  const Lateness& lateness = flight.lateness();
  nlohmann::json bins = nlohmann::json::array();
  lateness.each_bin([&](double upper_edge_s, std::uint64_t count) { bins.push_back({upper_edge_s, count}); });
  return {
      {"slices", lateness.count()}, {"p50_s", lateness.quantile_s(0.5)}, {"p99_s", lateness.quantile_s(0.99)},
      {"max_s", lateness.max_s()},  {"overruns", flight.overruns()},     {"oversleeps", flight.oversleeps()},
      {"histogram", bins}};
}

ResultHeading heading_of(const JournalEntry& entry, std::optional<RunFailure> failure,
                         std::vector<std::string> warnings) {
  return {.experiment_id = entry.experiment_id.hex(),
          .request_id = entry.request_id.hex(),
          .phase = std::string(wire::phase_name(entry.phase)),
          .failure = std::move(failure),
          .warnings = std::move(warnings)};
}

// `run` is null where there is none, or where it is somebody else's.
std::string text_of_result(const ResultHeading& heading, const Flight& flight, const Run* run) {
  nlohmann::json result = result_document(heading, flight.prepared(), run,
                                          run ? flight.verification() : std::optional<Verification>());
  result["provenance"]["lateness"] = lateness_document(flight);
  return result.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

Finisher::Finisher(const Archive& archive, Journal& journal, std::function<void(FlightPointer)> committed)
    : archive_(archive), journal_(journal), committed_(std::move(committed)) {
  for (std::size_t i = 0; i < kThreads; ++i)
    threads_.emplace_back([this, i] {
      name_this_thread("finisher-" + std::to_string(i));
      work();
    });
}

Finisher::~Finisher() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (auto& thread : threads_) thread.join();
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] { return with_the_journal_ == 0; });
}

void Finisher::take(FlightPointer flight) {
  backlog_.fetch_add(1, std::memory_order_relaxed);
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(flight));
  }
  wake_.notify_one();
}

bool Finisher::wait_until_idle(Monotonic::duration time) {
  std::unique_lock lock(mutex_);
  return idle_.wait_for(lock, time, [this] { return backlog() == 0; });
}

void Finisher::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    if (!waiting_.empty()) {
      const FlightPointer flight = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      commit(flight, write_up(flight));
      lock.lock();
    } else if (stopping_) {
      return;
    } else if (!refused_.empty()) {
      wake_.wait_for(lock, kPatience);
      if (refused_.empty()) continue;
      const Refused again = std::move(refused_.front());
      refused_.pop_front();
      lock.unlock();
      commit(again.flight, again.entry);
      lock.lock();
    } else {
      wake_.wait(lock);
    }
  }
}

JournalEntry Finisher::write_up(const FlightPointer& flight) {
  JournalEntry entry = flight->entry();
  entry.phase = flight->ending();
  entry.started_unix_ns = flight->started_unix_ns();
  entry.ended_unix_ns = unix_ns();
  entry.t_sim_s = flight->t_sim_s();

  std::vector<std::string> warnings;
  if (flight->prepared().telemetry.lossless && !flight->is_lossless())
    warnings.push_back(
        "a reader of the lossless telemetry did not acknowledge in time; the stream went on without it");
  if (flight->has_run() && flight->samples().rows() > 0) {
    try {
      archive_.write(entry.experiment_id, flight->run().channels(), flight->samples());
    } catch (const std::exception& error) {
      spdlog::error("[{}] series not archived: {}", entry.experiment_id.hex(), error.what());
      warnings.push_back(std::string("the series could not be archived: ") + error.what());
    }
  }
  const auto failure = entry.phase == slew_v1_FAILED ? std::optional(flight->failure()) : std::nullopt;
  try {
    entry.result = text_of_result(heading_of(entry, failure, warnings), *flight,
                                  flight->has_run() ? &flight->run() : nullptr);
  } catch (const std::exception& error) {
    // One result that cannot be made must not take all the others along.
    spdlog::error("[{}] no result: {}", entry.experiment_id.hex(), error.what());
    const RunFailure no_result{"no_result", std::string("the result could not be written: ") + error.what()};
    flight->end(slew_v1_FAILED, no_result);
    entry.phase = slew_v1_FAILED;
    entry.result = text_of_result(heading_of(entry, no_result, warnings), *flight, nullptr);
  }
  return entry;
}

void Finisher::write_off(const FlightPointer& flight, std::function<void()> committed) {
  JournalEntry entry = flight->entry();
  entry.phase = slew_v1_INTERRUPTED;
  entry.started_unix_ns = flight->started_unix_ns();
  entry.ended_unix_ns = unix_ns();
  entry.t_sim_s = flight->t_sim_s();
  entry.result = text_of_result(heading_of(entry, std::nullopt, {kLeftInAStep}), *flight, nullptr);
  journal_.finish(std::move(entry), [committed = std::move(committed)](const std::string& error) {
    if (error.empty())
      committed();
    else
      spdlog::error("an experiment that was left in a step could not be written off: {}", error);
  });
}

// The end is owed: when the disk refuses it, it is offered again until it is taken.
void Finisher::commit(const FlightPointer& flight, JournalEntry entry) {
  {
    const std::lock_guard lock(mutex_);
    ++with_the_journal_;
  }
  JournalEntry copy = entry;
  journal_.finish(std::move(copy), [this, flight, entry = std::move(entry)](const std::string& error) {
    if (error.empty()) {
      committed_(flight);
      backlog_.fetch_sub(1, std::memory_order_relaxed);
    } else {
      spdlog::error("[{}] end not committed, will be offered again: {}", entry.experiment_id.hex(), error);
    }
    const std::lock_guard lock(mutex_);
    --with_the_journal_;
    if (!error.empty()) refused_.push_back({flight, entry});
    wake_.notify_one();
    idle_.notify_all();
  });
}

}  // namespace slew::service
