// A flight: one accepted experiment from its acceptance to its end, with everything that travels along.
//
// It is handed from stage to stage (lane, publisher, finisher) and belongs to one of them at a time; what
// other threads may read or wish meanwhile is atomic or behind its mutex.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/experiment/experiment.hpp"
#include "server/service/clock.hpp"
#include "server/service/journal.hpp"
#include "server/service/lateness.hpp"
#include "server/service/sample_ring.hpp"
#include "server/service/sample_store.hpp"

namespace slew::service {

/// What clients asked of a flight since its lane last looked.
struct Wishes {
  bool cancel = false;
  bool interrupt = false;        ///< the server is going down
  bool expire = false;           ///< too late to begin; one that has begun does not mind
  std::optional<bool> pause;     ///< true: pause, false: resume
  std::optional<double> step_s;  ///< fly on for so much simulated time, then pause
  std::optional<double> rate;    ///< simulated per wall second
  /// With a resume: the wall time it was meant for, so that samples lie where they were ordered.
  std::optional<std::int64_t> start_unix_ns;
};

/// What a lane has to do with a flight after a slice.
enum class SliceEnd {
  goes_on,
  parked,  ///< paused, held or without room in the ring: nothing to do until it is handed in again
  over,    ///< finished, failed or cancelled
};

struct PhaseChange {
  wire::Phase phase;
  double t_sim_s;
  std::int64_t unix_ns;
};

class Flight {
 public:
  /// `entry` is what the journal holds of it; its texts stay there. The run is made by begin(). Its samples
  /// are charged to the budget, which must outlive it.
  Flight(JournalEntry entry, Prepared prepared, SampleBudget* budget = nullptr);
  ~Flight();

  const JournalEntry& entry() const { return entry_; }
  const Prepared& prepared() const { return prepared_; }
  bool is_paced() const { return is_paced_; }
  /// Whether the next server flies it from its beginning when this one goes down.
  bool runs_again() const { return runs_again_; }

  // ---- any thread -----------------------------------------------------------------------------------------
  wire::Phase phase() const { return phase_.load(std::memory_order_acquire); }
  double t_sim_s() const { return t_sim_s_.load(std::memory_order_relaxed); }
  double rate() const { return rate_.load(std::memory_order_relaxed); }
  std::uint64_t sampled() const { return sampled_.load(std::memory_order_relaxed); }
  std::int64_t started_unix_ns() const { return started_unix_ns_.load(std::memory_order_relaxed); }
  std::int64_t ended_unix_ns() const { return ended_unix_ns_.load(std::memory_order_relaxed); }
  const Lateness& lateness() const { return lateness_; }
  std::uint64_t overruns() const { return overruns_.load(std::memory_order_relaxed); }
  std::uint64_t oversleeps() const { return oversleeps_.load(std::memory_order_relaxed); }

  /// 0 to 1 of the simulated time, or of the planning before it.
  double progress() const;
  bool has_been_called_off();

  /// Enters a phase and notes it for the publisher.
  void enter(wire::Phase phase);
  /// The share of a pacer's time it needs, from a trial before it was admitted; once it has flown for a
  /// while, what it did need.
  double load() const { return load_.load(std::memory_order_relaxed); }
  void set_trial_load(double load) { load_.store(load, std::memory_order_relaxed); }

  /// Takes the phase changes noted since the last call.
  std::vector<PhaseChange> take_phase_changes();

  /// Adds a wish. True when the flight was parked and must be handed to its lane again.
  bool wish(const Wishes& wishes);

  // ---- the lane that plans it -----------------------------------------------------------------------------
  bool awaits_plan() const { return prepared_.awaits_plan(); }
  void set_planning_progress(double progress) {
    planning_progress_.store(progress, std::memory_order_relaxed);
  }
  /// Makes the plan what is flown. False when there is nothing to fly: it has ended then.
  bool adopt(const nlohmann::json& plan);

  // ---- the lane that flies it -----------------------------------------------------------------------------
  /// Whether a wish ends it before it has begun; ends it then.
  bool is_called_off();
  /// Makes the run, its ring and its store, unless they are there.
  SliceEnd begin();
  bool has_run() const { return run_ != nullptr; }
  /// Does what was wished since the last slice. Before every fly().
  SliceEnd follow_wishes();
  /// Advances to simulated time `until_s`, or until the wall clock passes `yield_at`.
  SliceEnd fly(double until_s, Monotonic::time_point yield_at);
  /// For the paced lane: where simulated and wall time met last, renewed when a wish changed the pace.
  struct Anchor {
    Monotonic::time_point wall;
    double sim_s = 0;
    double rate = 1;
    std::uint64_t version = 0;
  };
  const Anchor& anchor() const { return anchor_; }
  /// How late a slice's samples were in the ring. A slice that missed the next one's deadline counts as the
  /// timer's fault (oversleep) or the model's (overrun).
  void record_slice(double lateness_s, bool missed, bool overslept);
  /// What a slice that covers so much wall time took of the pacer's.
  void record_cost(double processor_s, double wall_s);
  /// Ends it without flying on; the phase is announced once it is archived.
  void end(wire::Phase phase, RunFailure failure = {});

  // ---- publisher and finisher -----------------------------------------------------------------------------
  SampleRing& ring() { return *ring_; }
  const SampleStore& samples() const { return *store_; }
  const Run& run() const { return *run_; }
  wire::Phase ending() const { return ending_; }
  const RunFailure& failure() const { return failure_; }
  const std::optional<Verification>& verification() const { return verification_; }
  /// Rows were taken out of the ring. True when the flight was parked for want of room and must be handed to
  /// its lane again.
  bool room_made();
  /// A reader did not acknowledge for too long; the stream goes on without it.
  void give_up_lossless() { is_lossless_ = false; }
  bool is_lossless() const { return is_lossless_.load(std::memory_order_relaxed); }
  /// Frees run and samples: only what status queries need stays.
  void shed();

  std::atomic<std::uint64_t> published{0};
  std::atomic<std::uint64_t> dropped{0};
  std::uint64_t next_seq = 0;           ///< publisher's
  std::uint32_t next_event = 0;         ///< publisher's
  std::size_t unacknowledged = 0;       ///< batches; the lossless stream's
  Monotonic::time_point next_status{};  ///< publisher's

 private:
  class Sink;
  bool rest_or_run();
  bool await_room();
  SliceEnd verify(Monotonic::time_point yield_at);
  void anchor_now(std::optional<std::int64_t> start_unix_ns = {});

  const JournalEntry entry_;
  Prepared prepared_;
  SampleBudget* const budget_;
  std::unique_ptr<Run> run_;
  std::unique_ptr<Run> verification_run_;
  std::unique_ptr<Sink> sink_;
  std::unique_ptr<SampleRing> ring_;
  std::unique_ptr<SampleStore> store_;
  std::optional<Verification> verification_;

  std::atomic<wire::Phase> phase_{slew_v1_RECEIVED};  // until the journal has it
  wire::Phase ending_ = slew_v1_COMPLETED;            ///< the lane's own
  std::atomic<double> t_sim_s_{0};
  std::atomic<double> rate_{0};
  std::atomic<double> planning_progress_{0};
  std::atomic<std::uint64_t> sampled_{0};
  std::atomic<std::int64_t> started_unix_ns_{0};
  std::atomic<std::int64_t> ended_unix_ns_{0};
  std::atomic<std::uint64_t> overruns_{0};
  std::atomic<std::uint64_t> oversleeps_{0};
  std::atomic<double> load_{0};
  std::atomic<bool> is_lossless_{false};
  const bool is_paced_;
  const bool runs_again_;
  Lateness lateness_;

  std::mutex mutex_;
  std::vector<PhaseChange> phase_changes_;
  Wishes wishes_;
  std::atomic<bool> has_wishes_{false};
  bool parked_ = false;       ///< behind mutex_
  bool awaits_room_ = false;  ///< behind mutex_
  bool paused_ = false;       ///< the lane's own, as is what follows

  Anchor anchor_;
  std::optional<std::int64_t> start_unix_ns_;
  double cost_processor_s_ = 0;  ///< since the rate changed
  double cost_wall_s_ = 0;
  std::optional<double> step_until_s_;
  RunFailure failure_;
};

using FlightPointer = std::shared_ptr<Flight>;

/// What a lane hands its flights to.
class NextStage {
 public:
  virtual ~NextStage() = default;
  /// The run exists and will soon have samples.
  virtual void begun(const FlightPointer& flight) = 0;
  /// The lane is done with it.
  virtual void over(const FlightPointer& flight) = 0;
};

/// What both lanes do before they fly a slice: make the run if this is the first, then follow wishes.
SliceEnd begin_slice(const FlightPointer& flight, NextStage& next);

}  // namespace slew::service
