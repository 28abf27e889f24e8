// The server: its parts, and the one direction in which a request goes through them.
//
//   intake -> journal -> (planning) -> lane (as-fast | paced) -> publisher -> finisher -> journal -> reply
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "idl/wire/domain.hpp"
#include "server/service/admission.hpp"
#include "server/service/archive.hpp"
#include "server/service/as_fast_lane.hpp"
#include "server/service/finisher.hpp"
#include "server/service/intake.hpp"
#include "server/service/journal.hpp"
#include "server/service/metrics_page.hpp"
#include "server/service/paced_lane.hpp"
#include "server/service/planning_lane.hpp"
#include "server/service/publisher.hpp"
#include "server/service/queries.hpp"
#include "server/service/registry.hpp"
#include "server/service/replies.hpp"
#include "server/service/timetable.hpp"

namespace slew::service {

struct ServerOptions {
  wire::DomainOptions domain;
  std::filesystem::path state_directory;
  std::size_t workers = 2;
  std::size_t pacers = 2;
  double keep_days = 90;  ///< what ended longer ago is removed, result and series
  double keep_gib = 20;   ///< of series; the oldest make room
  int metrics_port = 0;   ///< Prometheus text on loopback; 0: none
  double drain_s = 10;    ///< what is under way may take so long to end after SIGTERM
};

class Server {
 public:
  /// Opens the state, takes up what an earlier server left unfinished, and serves. Throws JournalError,
  /// WireError or std::runtime_error with a sentence for the user.
  explicit Server(const ServerOptions& options);
  /// Stops at once; accepted as-fast work runs again at the next start.
  ~Server();

  /// Refuses new requests, lets what is under way end for `drain_s`, marks paced experiments that did not as
  /// interrupted. Idempotent.
  void drain();

 private:
  class StateLock;
  void launch(const FlightPointer& flight);
  void schedule(const FlightPointer& flight);
  void relaunch(const FlightPointer& flight);
  void wish(const FlightPointer& flight, const Wishes& wishes);
  void committed(const FlightPointer& flight);
  void recover();
  slew_v1_Server health() const;
  void watch_health();
  void make_room();

  const ServerOptions options_;
  const std::int64_t started_unix_ns_;
  std::unique_ptr<StateLock> state_lock_;
  wire::Id server_id_;
  wire::Id boot_id_ = wire::Id::make();

  wire::Domain domain_;
  wire::Writer<slew_v1_Server> health_writer_;
  Registry registry_;
  Replies replies_;
  Archive archive_;
  Admission admission_;
  std::unique_ptr<Journal> journal_;
  std::unique_ptr<Publisher> publisher_;
  std::unique_ptr<Finisher> finisher_;
  std::unique_ptr<AsFastLane> as_fast_;
  std::unique_ptr<PacedLane> paced_;
  std::unique_ptr<PlanningLane> planning_;
  std::unique_ptr<Timetable> timetable_;
  std::unique_ptr<Queries> queries_;
  std::unique_ptr<Intake> intake_;
  std::unique_ptr<MetricsPage> metrics_page_;

  std::atomic<bool> draining_{false};
  std::atomic<std::uint64_t> completed_{0}, failed_{0}, cancelled_{0}, interrupted_{0}, expired_{0};
  std::mutex health_mutex_;
  std::condition_variable health_wake_;
  bool stopping_ = false;
  std::thread health_thread_;
};

}  // namespace slew::service
