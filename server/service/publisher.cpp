#include "server/service/publisher.hpp"

#include <algorithm>

#include "idl/wire/text.hpp"
#include "server/experiment/limits.hpp"
#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

constexpr auto kTick = std::chrono::milliseconds(2);
constexpr auto kStatusPeriod = std::chrono::milliseconds(200);
constexpr const char* kConventions =
    "SI units; attitude: Euler parameters scalar first, Euler angles 1-2-3, MRP sigma = tan(phi/4) e";

slew_v1_Channel to_wire(const Channel& channel) {
  slew_v1_Channel wired{};
  wire::store(channel.name, wired.name);
  wire::store(channel.unit, wired.unit);
  wire::store(channel.frame, wired.frame);
  wire::store(channel.description, wired.description);
  return wired;
}

}  // namespace

Publisher::Publisher(const wire::Domain& domain, std::function<void(FlightPointer)> drained,
                     std::function<void(FlightPointer)> room_made)
    : experiment_(domain),
      channels_(domain),
      event_(domain),
      telemetry_(domain),
      drained_(std::move(drained)),
      lossless_(domain, drained_, std::move(room_made)),
      thread_([this] {
        name_this_thread("publisher");
        publish();
      }) {}

Publisher::~Publisher() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void Publisher::planning(const FlightPointer& flight) {
  post(News::planning, flight);
}
void Publisher::begun(const FlightPointer& flight) {
  post(News::begun, flight);
}
void Publisher::over(const FlightPointer& flight) {
  post(News::over, flight);
}
void Publisher::ended(const FlightPointer& flight) {
  post(News::ended, flight);
}
void Publisher::forget(const FlightPointer& flight) {
  post(News::forget, flight);
}

void Publisher::post(News news, const FlightPointer& flight) {
  {
    const std::lock_guard lock(mutex_);
    inbox_.push_back({news, flight});
  }
  wake_.notify_one();
}

void Publisher::flush() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] { return inbox_.empty() && !is_busy_; });
  lock.unlock();
  lossless_.flush(from_seconds(limits().lossless_patience_s + 1));
}

void Publisher::publish() {
  std::vector<Item> items;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      const auto has_news = [this] { return stopping_ || !inbox_.empty(); };
      is_busy_ = false;
      if (inbox_.empty()) idle_.notify_all();
      if (flying_.empty())
        wake_.wait(lock, has_news);
      else
        wake_.wait_for(lock, kTick, has_news);
      if (stopping_ && inbox_.empty()) return;
      is_busy_ = true;
      items.swap(inbox_);
    }
    for (const Item& item : items) take_in(item);
    items.clear();
    const auto now = Monotonic::now();
    for (const FlightPointer& flight : flying_) {
      tell_phases(*flight);
      if (!flight->prepared().telemetry.lossless) telemetry_.drain(*flight);
      if (now >= flight->next_status) tell_status(*flight);
    }
  }
}

void Publisher::take_in(const Item& item) {
  Flight& flight = *item.flight;
  switch (item.news) {
    case News::begun:
      describe(flight);
      flying_.push_back(item.flight);
      if (flight.prepared().telemetry.lossless) lossless_.begun(item.flight);
      break;
    case News::over: {
      // A flight that ended before it began was never in the list.
      const auto place = std::find(flying_.begin(), flying_.end(), item.flight);
      if (place != flying_.end()) {
        flying_.erase(place);
        tell_phases(flight);
        if (flight.prepared().telemetry.lossless) {
          lossless_.over(item.flight);
          break;
        }
        telemetry_.drain(flight);
        telemetry_.end(flight);
      }
      drained_(item.flight);
      break;
    }
    case News::planning:
      tell_phases(flight);
      tell_status(flight);
      break;
    case News::ended:
      tell_phases(flight);
      break;
    case News::forget: {
      slew_v1_Experiment experiment{};
      flight.entry().experiment_id.store(experiment.experiment_id);
      experiment_.dispose(experiment);
      slew_v1_Channels channels{};
      flight.entry().experiment_id.store(channels.experiment_id);
      channels_.dispose(channels);
      slew_v1_Event event{};
      flight.entry().experiment_id.store(event.experiment_id);
      event_.dispose(event);
      break;
    }
  }
}

void Publisher::describe(const Flight& flight) {
  const ChannelTable& table = flight.run().channels();
  std::vector<slew_v1_Channel> state, thrusters;
  for (const Channel& channel : table.state) state.push_back(to_wire(channel));
  for (const Channel& channel : table.thrusters) thrusters.push_back(to_wire(channel));
  slew_v1_Channels channels{};
  flight.entry().experiment_id.store(channels.experiment_id);
  channels.sample_period_s = flight.prepared().telemetry.sample_period_s;
  channels.state = {static_cast<std::uint32_t>(state.size()), static_cast<std::uint32_t>(state.size()),
                    state.data(), false};
  channels.thrusters = {static_cast<std::uint32_t>(thrusters.size()),
                        static_cast<std::uint32_t>(thrusters.size()), thrusters.data(), false};
  wire::store(kConventions, channels.conventions);
  channels_.write(channels);
}

void Publisher::tell_phases(Flight& flight) {
  const auto changes = flight.take_phase_changes();
  for (const PhaseChange& change : changes) {
    slew_v1_Event event{};
    flight.entry().experiment_id.store(event.experiment_id);
    event.seq = flight.next_event++;
    event.phase = change.phase;
    event.t_sim_s = change.t_sim_s;
    event.unix_ns = change.unix_ns;
    wire::store("phase", event.kind);
    const std::string text(wire::phase_name(change.phase));
    event.text = wire::borrowed(text);
    event_.write(event);
  }
  if (!changes.empty()) tell_status(flight);
}

void Publisher::tell_status(Flight& flight) {
  const JournalEntry& entry = flight.entry();
  slew_v1_Experiment status{};
  entry.experiment_id.store(status.experiment_id);
  entry.request_id.store(status.request_id);
  wire::store(entry.client_id, status.client_id);
  wire::store(entry.label, status.label);
  wire::store(entry.preset, status.preset);
  wire::store(entry.timing_mode, status.timing_mode);
  status.phase = flight.phase();
  status.t_sim_s = flight.t_sim_s();
  status.duration_s = entry.duration_s;
  status.progress = flight.progress();
  status.rate = flight.rate();
  status.accepted_unix_ns = entry.accepted_unix_ns;
  status.started_unix_ns = flight.started_unix_ns();
  status.ended_unix_ns = flight.ended_unix_ns();
  if (status.started_unix_ns != 0) {
    const std::int64_t until = status.ended_unix_ns != 0 ? status.ended_unix_ns : unix_ns();
    const double wall_s = static_cast<double>(until - status.started_unix_ns) * 1e-9;
    status.rate_achieved = wall_s > 0 ? status.t_sim_s / wall_s : 0;
  }
  status.lateness_p50_s = flight.lateness().quantile_s(0.5);
  status.lateness_p99_s = flight.lateness().quantile_s(0.99);
  status.lateness_max_s = flight.lateness().max_s();
  status.slices = flight.lateness().count();
  status.overruns = flight.overruns();
  status.oversleeps = flight.oversleeps();
  status.sampled = flight.sampled();
  status.published = flight.published.load(std::memory_order_relaxed);
  status.dropped = flight.dropped.load(std::memory_order_relaxed);
  experiment_.write(status);
  flight.next_status = Monotonic::now() + kStatusPeriod;
}

}  // namespace slew::service
