#include "server/service/planning_lane.hpp"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "server/experiment/planning.hpp"
#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

// Behind the workers of as-fast work.
constexpr int kNice = 10;
constexpr auto kNewsPeriod = std::chrono::milliseconds(200);

}  // namespace

PlanningLane::PlanningLane(std::filesystem::path cache_directory, Outlets outlets)
    : outlets_(std::move(outlets)), cache_(std::move(cache_directory)), thread_([this] {
        name_this_thread("planner");
        setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
        work();
      }) {}

PlanningLane::~PlanningLane() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    closed_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void PlanningLane::submit(FlightPointer flight) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(flight));
  }
  wake_.notify_one();
}

void PlanningLane::expedite(const FlightPointer& flight) {
  const std::lock_guard lock(mutex_);
  const auto place = std::find(waiting_.begin(), waiting_.end(), flight);
  if (place != waiting_.end()) std::rotate(waiting_.begin(), place, place + 1);
}

std::size_t PlanningLane::size() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size() + (is_planning_ ? 1 : 0);
}

void PlanningLane::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    is_planning_ = false;
    wake_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (stopping_) return;
    const FlightPointer flight = std::move(waiting_.front());
    waiting_.pop_front();
    is_planning_ = true;
    lock.unlock();
    plan(flight);
    lock.lock();
  }
}

void PlanningLane::plan(const FlightPointer& flight) try {
  if (flight->is_called_off()) return outlets_.over(flight);
  if (closed_) return;
  const PlanningTask& task = *flight->prepared().planning;
  std::optional<nlohmann::json> plan = cache_.find(task.problem_text);
  if (!plan) {
    flight->enter(slew_v1_PLANNING);
    outlets_.news(flight);
    const auto began = Monotonic::now();
    auto told = began;
    PlanningWatch watch;
    watch.is_called_off = [&] { return closed_ || flight->has_been_called_off(); };
    watch.elapsed_s = [&] { return seconds(Monotonic::now() - began); };
    watch.report = [&](double progress) {
      flight->set_planning_progress(progress);
      if (const auto now = Monotonic::now(); now - told >= kNewsPeriod) {
        told = now;
        outlets_.news(flight);
      }
    };
    plan = plan_maneuver(task, watch);
    if (flight->is_called_off()) return outlets_.over(flight);
    if (closed_) return;
    spdlog::info("[{}] planned in {:.3f} s: {}", flight->entry().experiment_id.hex(),
                 seconds(Monotonic::now() - began), plan->at("why").get<std::string>());
    cache_.keep(task.problem_text, *plan);
  }
  if (flight->adopt(*plan))
    outlets_.planned(flight);
  else
    outlets_.over(flight);
} catch (const std::exception& error) {
  flight->end(slew_v1_FAILED, {"internal", error.what()});
  outlets_.over(flight);
}

}  // namespace slew::service
