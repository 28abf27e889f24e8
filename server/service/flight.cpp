#include "server/service/flight.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/experiment/planning.hpp"
#include "server/service/wakeup_grid.hpp"

namespace slew::service {
namespace {

// Room for a publisher that is held up for half a second, and for one burst of an as-fast run.
constexpr double kRingWall_s = 0.5;
constexpr std::size_t kSmallestRing_rows = 128;
constexpr std::size_t kLargestRing_bytes = std::size_t{32} << 10;
// So much wall time has to be flown before measured cost replaces the trial's.
constexpr double kCostWall_s = 1;
// Between two looks at the wall clock: about 100 us of a cheap plant.
constexpr std::int64_t kStepsPerLook = 1000;

// What is only the journal's: a flight that queries look at must not change under them when it ends.
JournalEntry without_texts(JournalEntry entry) {
  entry.request = {};
  entry.result = {};
  return entry;
}

}  // namespace

// Every sample goes to the store; of these, to the ring go so many that the wire gets at most
// `publish_max_hz` a wall second, the first and the last among them.
class Flight::Sink final : public SampleSink {
 public:
  explicit Sink(Flight& flight)
      : flight_(flight),
        is_lossless_(flight.prepared_.telemetry.lossless),
        hz_(flight.prepared_.telemetry.publish_max_hz) {
    last_.resize(flight.ring_->width() + 1);
  }

  /// As-fast samples have no wall time of their own; they share what the clock allows since the last slice.
  void begin_slice(Monotonic::time_point now) {
    if (flight_.is_paced() || hz_ <= 0) return;
    credit_ = std::min(credit_ + hz_ * seconds(now - slice_began_), 64.0);
    slice_began_ = now;
  }

  void sample(double t_s, std::span<const double> state, std::span<const double> thrusters) override {
    flight_.store_->push(t_s, state, thrusters);
    flight_.sampled_.fetch_add(1, std::memory_order_relaxed);
    if (is_lossless_) return flight_.ring_->push(t_s, state, thrusters);
    if (hz_ <= 0) return;
    if (is_due(t_s)) {
      flight_.ring_->push(t_s, state, thrusters);
      last_is_published_ = true;
    } else {
      last_[0] = t_s;
      std::copy(state.begin(), state.end(), last_.begin() + 1);
      std::copy(thrusters.begin(), thrusters.end(),
                last_.begin() + 1 + static_cast<std::ptrdiff_t>(state.size()));
      last_is_published_ = false;
    }
  }

  void event(const SwitchEvent&) override {}

  void publish_last() {
    if (!last_is_published_) flight_.ring_->push(last_[0], std::span<const double>(last_).subspan(1), {});
    last_is_published_ = true;
  }

 private:
  bool is_due(double t_s) {
    const bool is_first = !has_last_;
    const double gap_s = is_first ? 0 : t_s - last_t_s_;
    last_t_s_ = t_s;
    has_last_ = true;
    if (is_first) return true;
    if (!flight_.is_paced()) {
      if (credit_ < 1) return false;
      credit_ -= 1;
      return true;
    }
    // A part in a thousand absorbs the rounding of sample times, so that 100 Hz thins to 50 Hz evenly.
    since_published_s_ += gap_s / flight_.anchor_.rate;
    if (since_published_s_ * hz_ < 0.999) return false;
    since_published_s_ = std::min(std::max(0.0, since_published_s_ - 1 / hz_), 1 / hz_);
    return true;
  }

  Flight& flight_;
  const bool is_lossless_;
  const double hz_;
  double credit_ = 1;
  Monotonic::time_point slice_began_ = Monotonic::now();
  double since_published_s_ = 0;
  double last_t_s_ = 0;
  bool has_last_ = false;
  std::vector<double> last_;
  bool last_is_published_ = true;
};

Flight::Flight(JournalEntry entry, Prepared prepared)
    : entry_(without_texts(std::move(entry))),
      prepared_(std::move(prepared)),
      is_paced_(prepared_.timing.mode != TimingMode::as_fast_as_possible) {
  if (is_paced()) rate_ = prepared_.timing.rate;
  anchor_.rate = prepared_.timing.rate;
  paused_ = prepared_.timing.start != TimingStart::now;
  is_lossless_ = prepared_.telemetry.lossless;
}

Flight::~Flight() = default;

void Flight::enter(wire::Phase phase) {
  const std::lock_guard lock(mutex_);
  const std::int64_t now = unix_ns();
  if (phase == slew_v1_RUNNING && started_unix_ns_ == 0) started_unix_ns_ = now;
  if (wire::is_terminal(phase)) ended_unix_ns_ = now;
  phase_.store(phase, std::memory_order_release);
  phase_changes_.push_back({phase, t_sim_s(), now});
}

std::vector<PhaseChange> Flight::take_phase_changes() {
  const std::lock_guard lock(mutex_);
  return std::exchange(phase_changes_, {});
}

bool Flight::wish(const Wishes& wishes) {
  const std::lock_guard lock(mutex_);
  wishes_.cancel |= wishes.cancel;
  wishes_.interrupt |= wishes.interrupt;
  wishes_.expire |= wishes.expire;
  if (wishes.pause) {
    wishes_.pause = wishes.pause;
    wishes_.step_s.reset();
    wishes_.start_unix_ns = wishes.start_unix_ns;
  }
  if (wishes.step_s) {
    wishes_.step_s = wishes.step_s;
    wishes_.pause.reset();
  }
  if (wishes.rate) wishes_.rate = wishes.rate;
  has_wishes_.store(true, std::memory_order_release);
  awaits_room_ = false;
  return std::exchange(parked_, false);
}

SliceEnd Flight::begin() try {
  if (run_) return SliceEnd::goes_on;
  run_ = make_run(prepared_);
  const std::size_t width = run_->channels().state.size() + run_->channels().thrusters.size();
  const auto rows = static_cast<std::size_t>(prepared_.telemetry.publish_max_hz * kRingWall_s);
  const std::size_t needed = std::max(kSmallestRing_rows, rows) * (width + 1) * sizeof(double);
  ring_ = std::make_unique<SampleRing>(
      width, is_lossless() ? kLargestRing_bytes : std::min(needed, kLargestRing_bytes));
  store_ = std::make_unique<SampleStore>(width);
  sink_ = std::make_unique<Sink>(*this);
  return SliceEnd::goes_on;
} catch (const std::exception& error) {
  end(slew_v1_FAILED, {"not_built", error.what()});
  return SliceEnd::over;
}

void Flight::anchor_now(std::optional<std::int64_t> start_unix_ns) {
  const auto now = Monotonic::now();
  // A start that is told too late, by a clock that was set or a server that was away, is a start now.
  const std::int64_t late_ns = start_unix_ns ? unix_ns() - *start_unix_ns : INT64_MAX;
  const bool is_ordered = -1'000'000'000 < late_ns && late_ns < 1'000'000'000;
  anchor_.wall = is_ordered ? now - std::chrono::nanoseconds(late_ns) : on_wakeup_grid(now);
  anchor_.sim_s = run_->t_s();
  ++anchor_.version;
}

SliceEnd Flight::follow_wishes() {
  // Again when a wish arrived just as the flight was about to park.
  while (phase() != slew_v1_RUNNING || has_wishes_.load(std::memory_order_acquire)) {
    Wishes wishes;
    {
      const std::lock_guard lock(mutex_);
      wishes = std::exchange(wishes_, {});
      has_wishes_.store(false, std::memory_order_relaxed);
    }
    if (wishes.cancel) {
      end(slew_v1_CANCELLED);
      return SliceEnd::over;
    }
    if (wishes.interrupt) {
      end(slew_v1_INTERRUPTED);
      return SliceEnd::over;
    }
    if (wishes.expire && started_unix_ns_ == 0) {
      end(slew_v1_EXPIRED);
      return SliceEnd::over;
    }
    if (wishes.rate) {
      // The measure starts again; until there is one, cost follows the rate.
      load_ = load() * *wishes.rate / anchor_.rate;
      cost_processor_s_ = cost_wall_s_ = 0;
      anchor_.rate = *wishes.rate;
      rate_ = *wishes.rate;
      if (anchor_.version > 0) anchor_now();
    }
    if (wishes.pause) {
      paused_ = *wishes.pause;
      start_unix_ns_ = wishes.start_unix_ns;
      step_until_s_.reset();
    }
    if (wishes.step_s) {
      paused_ = false;
      step_until_s_ = run_->t_s() + *wishes.step_s;
    }
    if (!rest_or_run()) return SliceEnd::parked;
  }
  return SliceEnd::goes_on;
}

// Returns false when the flight is parked now.
bool Flight::rest_or_run() {
  if (!paused_) {
    if (phase() != slew_v1_RUNNING) {
      enter(slew_v1_RUNNING);
      anchor_now(std::exchange(start_unix_ns_, {}));
    }
    return true;
  }
  const wire::Phase resting = anchor_.version == 0 ? slew_v1_HELD : slew_v1_PAUSED;
  if (phase() != resting) enter(resting);
  const std::lock_guard lock(mutex_);
  if (has_wishes_.load(std::memory_order_relaxed)) return true;
  parked_ = true;
  return false;
}

bool Flight::has_been_called_off() {
  const std::lock_guard lock(mutex_);
  return wishes_.cancel || wishes_.interrupt || wishes_.expire;
}

bool Flight::adopt(const nlohmann::json& plan) {
  const auto failure = adopt_plan(prepared_, plan);
  if (failure) end(slew_v1_FAILED, *failure);
  return !failure;
}

double Flight::progress() const {
  const wire::Phase phase = this->phase();
  if (phase == slew_v1_COMPLETED) return 1;
  if (phase == slew_v1_PLANNING) return planning_progress_.load(std::memory_order_relaxed);
  return entry_.duration_s > 0 ? std::min(1.0, t_sim_s() / entry_.duration_s) : 0;
}

bool Flight::is_called_off() {
  const std::lock_guard lock(mutex_);
  if (!wishes_.cancel && !wishes_.interrupt && !wishes_.expire) return false;
  end(wishes_.cancel ? slew_v1_CANCELLED : wishes_.interrupt ? slew_v1_INTERRUPTED : slew_v1_EXPIRED);
  return true;
}

// A lossless flight goes no further than its ring has room for. Returns false when it is parked now.
bool Flight::await_room() {
  const auto has_room = [this] { return ring_->free() > ring_->capacity() / 4; };
  if (has_room()) return true;
  const std::lock_guard lock(mutex_);
  if (has_room() || has_wishes_.load(std::memory_order_relaxed)) return true;
  awaits_room_ = parked_ = true;
  return false;
}

bool Flight::room_made() {
  const std::lock_guard lock(mutex_);
  if (!awaits_room_ || ring_->free() <= ring_->capacity() / 4) return false;
  awaits_room_ = false;
  return std::exchange(parked_, false);
}

SliceEnd Flight::fly(double until_s, Monotonic::time_point yield_at) try {
  if (verification_run_) return verify(yield_at);

  if (prepared_.telemetry.lossless) {
    if (!await_room()) return SliceEnd::parked;
    const std::size_t room = ring_->free();
    if (room < 4) return SliceEnd::goes_on;
    until_s =
        std::min(until_s, run_->t_s() + static_cast<double>(room - 3) * prepared_.telemetry.sample_period_s);
  }
  sink_->begin_slice(Monotonic::now());
  if (step_until_s_) until_s = std::min(until_s, *step_until_s_);
  RunStatus status = RunStatus::running;
  do {
    status = run_->advance(until_s, kStepsPerLook, *sink_);
  } while (status == RunStatus::running && run_->t_s() < until_s && Monotonic::now() < yield_at);
  t_sim_s_.store(run_->t_s(), std::memory_order_relaxed);

  if (status == RunStatus::running) {
    if (!step_until_s_ || run_->t_s() < *step_until_s_) return SliceEnd::goes_on;
    // The step is done: rest as if paused.
    step_until_s_.reset();
    paused_ = true;
    return rest_or_run() ? SliceEnd::goes_on : SliceEnd::parked;
  }
  sink_->publish_last();
  if (status == RunStatus::failed) {
    const auto failure = run_->report().failure;
    end(slew_v1_FAILED, failure ? *failure : RunFailure{"failed", "the run failed without saying why"});
    return SliceEnd::over;
  }
  if (prepared_.verify) {
    verification_run_ = make_verification(prepared_);
    return SliceEnd::goes_on;
  }
  return SliceEnd::over;
} catch (const std::bad_alloc&) {
  end(slew_v1_FAILED, {"out_of_memory", "there was no memory left for this experiment"});
  return SliceEnd::over;
} catch (const std::exception& error) {
  end(slew_v1_FAILED, {"internal", error.what()});
  return SliceEnd::over;
}

// The second opinion wants no samples of its own.
SliceEnd Flight::verify(Monotonic::time_point yield_at) {
  class Nothing final : public SampleSink {
    void sample(double, std::span<const double>, std::span<const double>) override {}
    void event(const SwitchEvent&) override {}
  } nothing;
  RunStatus status = RunStatus::running;
  do {
    status = verification_run_->advance(std::numeric_limits<double>::infinity(), 100, nothing);
  } while (status == RunStatus::running && Monotonic::now() < yield_at);
  if (status == RunStatus::running) return SliceEnd::goes_on;
  verification_ = compare(run_->report(), verification_run_->report());
  verification_run_.reset();
  return SliceEnd::over;
}

void Flight::record_slice(double lateness_s, bool missed, bool overslept) {
  lateness_.record(lateness_s);
  if (missed) (overslept ? oversleeps_ : overruns_).fetch_add(1, std::memory_order_relaxed);
}

void Flight::record_cost(double processor_s, double wall_s) {
  cost_processor_s_ += processor_s;
  cost_wall_s_ += wall_s;
  if (cost_wall_s_ >= kCostWall_s) load_.store(cost_processor_s_ / cost_wall_s_, std::memory_order_relaxed);
}

void Flight::end(wire::Phase phase, RunFailure failure) {
  ending_ = phase;
  failure_ = std::move(failure);
}

SliceEnd begin_slice(const FlightPointer& flight, NextStage& next) {
  if (!flight->has_run()) {
    if (flight->is_called_off()) return SliceEnd::over;
    const SliceEnd end = flight->begin();
    if (end != SliceEnd::goes_on) return end;
    next.begun(flight);
  }
  return flight->follow_wishes();
}

void Flight::shed() {
  sink_.reset();
  run_.reset();
  ring_.reset();
  store_.reset();
  prepared_ = {};
}

}  // namespace slew::service
