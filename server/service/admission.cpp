#include "server/service/admission.hpp"

#include <time.h>

#include <algorithm>
#include <cstdio>
#include <thread>

#include "server/experiment/limits.hpp"
#include "server/service/paced_lane.hpp"

namespace slew::service {
namespace {

// Of a trial flight.
constexpr double kTrialProcessor_s = 1e-3;
constexpr std::int64_t kTrialSteps = 64;
// Waking up, sorting and handing over, for each slice. Replaced by what is measured once it flies.
constexpr double kSliceOverhead_s = 12e-6;

double processor_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::string in_percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f %%", 100 * share);
  return text;
}

}  // namespace

Admission::Admission(std::size_t pacers)
    : capacity_(limits().max_paced_load * static_cast<double>(std::min<std::size_t>(
                                              pacers, std::max(1u, std::thread::hardware_concurrency())))) {}

double Admission::trial_load(const Prepared& prepared) {
  class Nothing final : public SampleSink {
    void sample(double, std::span<const double>, std::span<const double>) override {}
    void event(const SwitchEvent&) override {}
  } nothing;
  const auto run = make_run(prepared);
  const double begin_s = processor_s();
  double spent_s = 0;
  RunStatus status = RunStatus::running;
  while (status == RunStatus::running && spent_s < kTrialProcessor_s) {
    // In short reaches, so that a run without steps of its own is not over in one.
    status = run->advance(run->t_s() + prepared.telemetry.sample_period_s, kTrialSteps, nothing);
    spent_s = processor_s() - begin_s;
  }
  const double cost = run->t_s() > 0 ? spent_s / run->t_s() : 0;
  const double period_s = PacedLane::slice_period_s(prepared.telemetry.sample_period_s, prepared.timing.rate);
  return prepared.timing.rate * cost + kSliceOverhead_s / period_s;
}

double Admission::load() const {
  const std::lock_guard lock(mutex_);
  double load = 0;
  std::erase_if(admitted_, [&](const std::weak_ptr<Flight>& place) {
    const auto flight = place.lock();
    if (!flight || wire::is_terminal(flight->phase())) return true;
    load += flight->load();
    return false;
  });
  return load;
}

std::optional<std::string> Admission::refusal(double more) const {
  const double promised = load();
  if (promised + more <= capacity_) return std::nullopt;
  return "paced experiments need " + in_percent(promised) + " of a processor, this would be " +
         in_percent(more) + " more, and " + in_percent(capacity_) +
         " may be promised; try later, at a lower rate, or as fast as possible";
}

void Admission::admit(const FlightPointer& flight) {
  const std::lock_guard lock(mutex_);
  admitted_.push_back(flight);
}

}  // namespace slew::service
