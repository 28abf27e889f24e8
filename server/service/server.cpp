#include "server/service/server.hpp"

#include <fcntl.h>
#include <malloc.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <fstream>

#include "idl/wire/text.hpp"
#include "server/experiment/limits.hpp"
#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

// While this many flights wait for the disk, no new as-fast one is begun: their samples are in memory.
constexpr std::size_t kLargestBacklog = 64;
constexpr auto kTrimPeriod = std::chrono::seconds(60);
constexpr std::size_t kRemovedAtOnce = 1000;
// A server that went down so often over one experiment would go down for ever.
constexpr std::int64_t kMostCrashes = 5;

std::string host_name() {
  char name[129] = {};
  gethostname(name, sizeof name - 1);
  return name;
}

std::uint64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t total = 0, resident = 0;
  statm >> total >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

// The same server keeps its id from start to start; it stands beside its journal.
wire::Id server_id(const std::filesystem::path& state_directory) {
  const auto file = state_directory / "server_id";
  std::string text;
  if (std::ifstream(file) >> text)
    if (const auto id = wire::Id::parse(text)) return *id;
  const auto id = wire::Id::make();
  if (!(std::ofstream(file) << id.hex() << '\n'))
    throw std::runtime_error("the state directory " + state_directory.string() + " cannot be written");
  return id;
}

// A journal of years may hold what a later version of the physics trips over.
std::variant<Prepared, Rejection> prepare_or_say_why(const std::string& request) try {
  return prepare(request);
} catch (const std::exception& error) {
  return Rejection{"internal", error.what(), {}};
}

}  // namespace

// One server per state directory.
class Server::StateLock {
 public:
  explicit StateLock(const std::filesystem::path& directory) {
    std::error_code error;
    std::filesystem::create_directories(directory, error);
    if (error)
      throw std::runtime_error("the state directory " + directory.string() +
                               " cannot be made: " + error.message());
    fd_ = ::open((directory / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640);
    if (fd_ < 0) throw std::runtime_error("the state directory " + directory.string() + " cannot be written");
    if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
      ::close(fd_);
      throw std::runtime_error("another server uses the state directory " + directory.string());
    }
  }
  StateLock(const StateLock&) = delete;
  StateLock& operator=(const StateLock&) = delete;
  ~StateLock() { ::close(fd_); }

 private:
  int fd_ = -1;
};

Server::Server(const ServerOptions& options)
    : options_(options),
      started_unix_ns_(unix_ns()),
      sample_budget_(options.sample_memory_mib << 20),
      state_lock_(std::make_unique<StateLock>(options.state_directory)),
      server_id_(server_id(options.state_directory)),
      domain_(options.domain),
      health_writer_(domain_),
      replies_(domain_),
      archive_(options.state_directory / "series"),
      black_box_(options.state_directory / "under_way"),
      admission_(options.pacers) {
  if (options.metrics_port != 0) metrics_page_ = std::make_unique<MetricsPage>(options.metrics_port);
  const auto journal_file = options.state_directory / "journal.sqlite";
  journal_ = std::make_unique<Journal>(journal_file, black_box_.suspects());
  publisher_ = std::make_unique<Publisher>(
      domain_, [this](FlightPointer flight) { finisher_->take(std::move(flight)); },
      [this](const FlightPointer& flight) { relaunch(flight); });
  finisher_ = std::make_unique<Finisher>(archive_, *journal_,
                                         [this](const FlightPointer& flight) { committed(flight); });
  as_fast_ = std::make_unique<AsFastLane>(options.workers, *publisher_, black_box_, [this] {
    return !draining_ && finisher_->backlog() < kLargestBacklog;
  });
  paced_ = std::make_unique<PacedLane>(options.pacers, *publisher_, black_box_);
  planning_ = std::make_unique<PlanningLane>(
      options.state_directory / "plans", black_box_,
      PlanningLane::Outlets{.planned = [this](const FlightPointer& flight) { relaunch(flight); },
                            .over = [this](const FlightPointer& flight) { publisher_->over(flight); },
                            .news = [this](const FlightPointer& flight) { publisher_->planning(flight); }});
  queries_ = std::make_unique<Queries>(domain_, registry_, archive_, journal_file);
  timetable_ = std::make_unique<Timetable>();
  recover();
  intake_ = std::make_unique<Intake>(
      domain_, registry_, *journal_, journal_file, admission_, sample_budget_, replies_,
      Intake::Outlets{
          .launch = [this](const FlightPointer& flight) { launch(flight); },
          .wish = [this](const FlightPointer& flight, const Wishes& wishes) { wish(flight, wishes); }});
  std::optional<std::int64_t> expires_unix_s;
  if (const auto* identity = domain_.identity()) {
    expires_unix_s = identity->expires_unix_s();
    const std::int64_t days_left = (*expires_unix_s - unix_ns() / 1'000'000'000) / 86400;
    spdlog::log(days_left < 30 ? spdlog::level::warn : spdlog::level::info,
                "DDS Security is on; the certificate runs out in {} days", days_left);
  }
  if (metrics_page_) metrics_page_->serve([this] { return health(); }, paced_->lateness(), expires_unix_s);
  health_thread_ = std::thread([this] {
    name_this_thread("health");
    watch_health();
  });
  if (!paced_->realtime_policy())
    spdlog::warn("paced work runs without SCHED_FIFO: not permitted (LimitRTPRIO=, CAP_SYS_NICE)");
  spdlog::info("server {} serves domain {} from {}", server_id_.hex(), domain_.id(),
               options.state_directory.string());
  sd_notify(0, "READY=1");
}

Server::~Server() {
  sd_notify(0, "STOPPING=1");
  {
    const std::lock_guard lock(health_mutex_);
    stopping_ = true;
  }
  health_wake_.notify_one();
  health_thread_.join();
  metrics_page_.reset();
  draining_ = true;
  // Along the way a request takes, so that nothing is handed to what is gone.
  intake_.reset();
  timetable_.reset();
  queries_.reset();
  planning_.reset();
  publisher_->close();
  paced_.reset();
  as_fast_->close();
  publisher_->flush();
  finisher_.reset();  // whose last results still ask the lane whether more may start
  as_fast_.reset();
  publisher_.reset();
  journal_.reset();
}

void Server::launch(const FlightPointer& flight) {
  if (!flight->is_paced()) flight->enter(slew_v1_QUEUED);
  schedule(flight);
  if (flight->awaits_plan())
    planning_->submit(flight);
  else
    relaunch(flight);
}

// What the request wants to happen at a wall time.
void Server::schedule(const FlightPointer& flight) {
  const TimingSpecification& timing = flight->prepared().timing;
  const auto wish_if_alive = [&](const Wishes& wishes) {
    return [this, wishes, place = std::weak_ptr(flight)] {
      if (const auto alive = place.lock(); alive && !wire::is_terminal(alive->phase())) wish(alive, wishes);
    };
  };
  if (timing.start == TimingStart::wall_time) {
    Wishes resume;
    resume.pause = false;
    resume.start_unix_ns = timing.start_unix_ns;
    timetable_->at(timing.start_unix_ns, wish_if_alive(resume));
  }
  if (timing.expires_s) {
    Wishes expire;
    expire.expire = true;
    // From the acceptance on, by a clock that nobody sets; while no server was there, by the one that there
    // was.
    const std::int64_t gone_ns = std::max<std::int64_t>(0, unix_ns() - flight->entry().accepted_unix_ns);
    timetable_->after(from_seconds(*timing.expires_s) - std::chrono::nanoseconds(gone_ns),
                      wish_if_alive(expire));
  }
}

void Server::wish(const FlightPointer& flight, const Wishes& wishes) {
  if (flight->wish(wishes))
    relaunch(flight);
  else if (wishes.cancel || wishes.expire || wishes.interrupt) {
    planning_->expedite(flight);
    as_fast_->expedite(flight);
  }
}

void Server::relaunch(const FlightPointer& flight) {
  if (flight->is_paced())
    paced_->submit(flight);
  else
    as_fast_->submit(flight);
}

void Server::committed(const FlightPointer& flight) {
  const JournalEntry& entry = flight->entry();
  const wire::Phase phase = flight->ending();
  Saying saying{"ok", "completed"};
  switch (phase) {
    case slew_v1_COMPLETED:
      ++completed_;
      break;
    case slew_v1_FAILED:
      ++failed_;
      saying = {flight->failure().code, flight->failure().sentence};
      break;
    case slew_v1_CANCELLED:
      ++cancelled_;
      saying = {"cancelled", "cancelled on request"};
      break;
    case slew_v1_EXPIRED:
      ++expired_;
      saying = {"expired", "it had not begun when its time to begin ran out"};
      break;
    default:
      ++interrupted_;
      saying = {"interrupted", "the server went down while the experiment was paced"};
      break;
  }
  spdlog::info("[{}] {} at t = {} s", entry.experiment_id.hex(), saying.sentence, flight->t_sim_s());
  flight->enter(phase);
  flight->shed();
  // Told first, forgotten later: what the registry knows to have ended may be forgotten at any time.
  publisher_->ended(flight);
  registry_.ended(flight);
  replies_.write(entry.request_id, entry.experiment_id, phase, saying);
  as_fast_->recheck();
}

// What an earlier server accepted and did not end: as-fast work gives the same bits when it runs again; paced
// work was tied to a clock that has gone on.
void Server::recover() {
  std::vector<JournalEntry> owed = JournalReader(options_.state_directory / "journal.sqlite").unfinished();
  for (JournalEntry& entry : owed) {
    const std::int64_t crashes = entry.crashes;
    auto outcome = prepare_or_say_why(entry.request);
    auto* prepared = std::get_if<Prepared>(&outcome);
    const auto flight = std::make_shared<Flight>(
        std::move(entry), prepared ? std::move(*prepared) : Prepared{}, &sample_budget_);
    registry_.add(flight);
    flight->enter(slew_v1_ACCEPTED);
    if (!prepared) {
      const auto& rejection = std::get<Rejection>(outcome);
      flight->end(slew_v1_FAILED, {"not_valid_any_more", rejection.sentence});
      publisher_->over(flight);
    } else if (crashes >= kMostCrashes) {
      flight->end(slew_v1_FAILED, {"took_the_server_down", "the server went down " + std::to_string(crashes) +
                                                               " times while it flew this"});
      publisher_->over(flight);
    } else if (!flight->runs_again()) {
      flight->end(slew_v1_INTERRUPTED);
      publisher_->over(flight);
    } else {
      if (flight->is_paced()) {
        // Promised before: it is not asked again whether it fits.
        flight->set_trial_load(Admission::trial_load(flight->prepared()));
        admission_.admit(flight);
      }
      launch(flight);
    }
  }
  if (!owed.empty()) spdlog::info("{} unfinished experiments taken up", owed.size());
}

bool Server::drain() {
  if (draining_.exchange(true)) return true;
  spdlog::info("draining for at most {} s", options_.drain_s);
  sd_notify(0, "STOPPING=1\nSTATUS=draining");
  intake_->drain();
  const auto wait = [](Monotonic::duration time, const auto& is_over) {
    for (const auto until = Monotonic::now() + time; !is_over() && Monotonic::now() < until;)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  };
  wait(from_seconds(options_.drain_s),
       [this] { return as_fast_->under_way() == 0 && paced_->flying() == 0; });
  planning_->close();
  for (const FlightPointer& flight : interrupted_by_a_drain()) {
    Wishes wishes;
    wishes.interrupt = true;
    wish(flight, wishes);
  }
  wait(std::chrono::seconds(2),
       [this] { return interrupted_by_a_drain().empty() && planning_->size() == 0; });
  as_fast_->stop();
  paced_->stop();
  wait(std::chrono::seconds(2), [this] { return as_fast_->in_slice() + paced_->in_slice() == 0; });
  publisher_->flush();
  if (!finisher_->wait_until_idle(std::chrono::seconds(5)))
    spdlog::error("{} results could not be committed; they will be made again after a restart",
                  finisher_->backlog());
  const std::size_t stuck = as_fast_->in_slice() + paced_->in_slice();
  if (stuck == 0) return true;
  if (finisher_->backlog() == 0) write_off();
  spdlog::error("{} experiments did not come out of a step; leaving without them", stuck);
  return false;
}

// Paced work that does not run again at the next start.
std::vector<FlightPointer> Server::interrupted_by_a_drain() const {
  std::vector<FlightPointer> alive = registry_.alive();
  std::erase_if(alive, [](const FlightPointer& flight) { return flight->runs_again(); });
  return alive;
}

// Whatever could end has ended and is in the journal. A paced experiment that is still there ends without its
// result, which nobody but its pacer may touch; an as-fast one is owed and flown again.
void Server::write_off() {
  for (const FlightPointer& flight : interrupted_by_a_drain())
    finisher_->write_off(flight, [this, flight] {
      const JournalEntry& entry = flight->entry();
      replies_.write(entry.request_id, entry.experiment_id, slew_v1_INTERRUPTED,
                     {"interrupted", "the server went down while a step of the experiment went on"});
    });
  journal_->flush();
}

// What is older or larger than what is to be kept. A little at a time: acceptances wait for the same journal.
void Server::make_room() {
  const auto oldest = unix_ns() - std::chrono::nanoseconds(from_seconds(options_.keep_days * 86400)).count();
  journal_->remove_ended_before(oldest, kRemovedAtOnce, [this](const std::vector<wire::Id>& ids) {
    for (const wire::Id& id : ids) archive_.remove(id);
    if (!ids.empty()) spdlog::info("{} experiments were too old to be kept", ids.size());
  });
  const std::size_t removed = archive_.trim(static_cast<std::uintmax_t>(options_.keep_gib * 1073741824));
  if (removed > 0) spdlog::info("{} series were removed to make room", removed);
}

void Server::watch_health() {
  const auto& most = limits();
  auto next = Monotonic::now(), next_trim = next;
  bool has_forgotten = false;
  std::unique_lock lock(health_mutex_);
  while (!stopping_) {
    lock.unlock();
    const auto now = Monotonic::now();
    // What was forgotten a second ago is free by now. The heap would keep what a long queue needed, and every
    // page on which something stays.
    const bool is_calm = as_fast_->waiting() + as_fast_->under_way() == 0;
    if (has_forgotten && (is_calm || now >= next_trim)) {
      malloc_trim(0);
      has_forgotten = false;
    }
    health_writer_.write(health());
    const auto age = from_seconds(most.retention_s);
    for (const FlightPointer& flight : registry_.take_expired(most.retained_experiments, age)) {
      publisher_->forget(flight);
      has_forgotten = true;
    }
    replies_.forget(2 * most.retained_experiments, age);
    if (now >= next_trim) {
      make_room();
      next_trim = now + kTrimPeriod;
    }
    sd_notify(0, "WATCHDOG=1");
    lock.lock();
    next += std::chrono::seconds(1);
    health_wake_.wait_until(lock, next, [this] { return stopping_; });
  }
}

slew_v1_Server Server::health() const {
  slew_v1_Server status{};
  server_id_.store(status.server_id);
  boot_id_.store(status.boot_id);
  wire::store(SLEW_VERSION, status.version);
  wire::store(host_name(), status.host);
  status.process_id = static_cast<std::int32_t>(getpid());
  status.started_unix_ns = started_unix_ns_;
  status.unix_ns = unix_ns();
  status.workers = static_cast<std::uint32_t>(options_.workers);
  status.pacers = static_cast<std::uint32_t>(options_.pacers);
  status.realtime_policy = paced_->realtime_policy();
  status.draining = draining_;
  std::size_t held = 0;
  registry_.page(slew_v1_HELD, 0, 0, held);
  status.held = static_cast<std::uint32_t>(held);
  status.queued = static_cast<std::uint32_t>(as_fast_->waiting() + planning_->size());
  status.paced = static_cast<std::uint32_t>(paced_->flying());
  status.running = static_cast<std::uint32_t>(as_fast_->under_way() + paced_->flying());
  status.queue_limit = static_cast<std::uint32_t>(limits().max_queued_experiments);
  status.paced_load = admission_.load() / (admission_.capacity() / limits().max_paced_load);
  status.lateness_p99_s = paced_->lateness().quantile_s(0.99);
  status.lateness_max_s = paced_->lateness().max_s();
  status.accepted = intake_->accepted();
  status.rejected = intake_->rejected();
  status.malformed = intake_->malformed();
  status.completed = completed_;
  status.failed = failed_;
  status.cancelled = cancelled_;
  status.interrupted = interrupted_;
  status.samples_published = publisher_->samples_published();
  status.samples_dropped = publisher_->samples_dropped();
  status.resident_bytes = resident_bytes();
  return status;
}

}  // namespace slew::service
