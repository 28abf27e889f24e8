// How late paced experiments are beside a saturating as-fast load, in a table with cyclictest at the same
// interval, policy and time; and what the load loses to them beside the processor time they use.
//
// usage: pacing_bench SLEWD [EXPERIMENTS=200] [HZ=100] [SECONDS=60] [planning]
// With "planning" the server searches for a maneuver all the while, too.
#include <dirent.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>
#include <vector>

#include "client/library/session.hpp"
#include "idl/wire/reader.hpp"
#include "tests/service/domain_lease.hpp"
#include "tests/service/process.hpp"

namespace {

using namespace slew;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr const char* kPreset = "agrawal-bang-1995/rigid-single-sided";
constexpr double kCalm_s = 5;  // of the load alone, before and after

struct Histogram {
  std::map<double, double> counts;  // by upper edge, us
  double max_us = 0;

  double quantile(double fraction) const {
    double total = 0, below = 0;
    for (const auto& [edge, count] : counts) total += count;
    for (const auto& [edge, count] : counts)
      if ((below += count) >= fraction * total) return edge;
    return max_us;
  }
  void print(const char* what) const {
    double total = 0;
    for (const auto& [edge, count] : counts) total += count;
    std::printf("%-44s %10.0f %9.0f %9.0f %9.0f\n", what, total, quantile(0.5), quantile(0.99), max_us);
  }
};

// "000012 000340 000401" for each microsecond: a column a thread.
Histogram read_cyclictest(const std::filesystem::path& file) {
  Histogram histogram;
  std::ifstream text(file);
  for (std::string line; std::getline(text, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream columns(line);
    double us = 0, count = 0;
    columns >> us;
    while (columns >> count)
      if (count > 0) {
        histogram.counts[us + 1] += count;
        histogram.max_us = std::max(histogram.max_us, us + 1);
      }
  }
  return histogram;
}

// Processor seconds so far, by the first word of the threads' names ("pacer", "worker", ...).
std::map<std::string, double> processor_s(pid_t pid) {
  std::map<std::string, double> spent;
  const std::string tasks = "/proc/" + std::to_string(pid) + "/task";
  DIR* directory = opendir(tasks.c_str());
  while (const dirent* entry = directory ? readdir(directory) : nullptr) {
    std::ifstream file(tasks + "/" + entry->d_name + "/schedstat");
    double ns = 0;
    if (!(file >> ns)) continue;
    std::string name;
    std::getline(std::ifstream(tasks + "/" + entry->d_name + "/comm"), name);
    spent[name.substr(0, name.find('-'))] += 1e-9 * ns;
  }
  if (directory) closedir(directory);
  return spent;
}

std::string must_accept(client::Session& session, const json& request) {
  const auto reply = session.submit(request.dump(), wire::Id::make(), std::chrono::seconds(10));
  if (!reply || reply->phase == slew_v1_REJECTED) {
    std::fprintf(stderr, "not accepted: %s\n", reply ? reply->json.c_str() : "no reply");
    std::exit(1);
  }
  return reply->experiment_id.hex();
}

json ask(client::Session& session, const char* kind, const std::string& id) {
  const auto answer = session.query(kind, json{{"id", id}}.dump(), std::chrono::seconds(20));
  return answer && answer->is_ok() ? json::parse(answer->json) : json();
}

// Simulated time of the load, and what the server's threads have spent: two of them make a rate.
struct Reading {
  Clock::time_point wall;
  double simulated_s = 0;
  std::map<std::string, double> processor;
};

Reading read(client::Session& session, const std::vector<std::string>& load, pid_t pid) {
  Reading reading;
  for (const std::string& id : load) reading.simulated_s += ask(session, "show", id).value("t_sim_s", 0.0);
  reading.wall = Clock::now();
  reading.processor = processor_s(pid);
  return reading;
}

void sleep_s(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s SLEWD [EXPERIMENTS] [HZ] [SECONDS] [planning]\n", argv[0]);
    return 2;
  }
  const int experiments = argc > 2 ? std::atoi(argv[2]) : 200;
  const double hz = argc > 3 ? std::atof(argv[3]) : 100;
  const double duration_s = argc > 4 ? std::atof(argv[4]) : 60;

  const test::DomainLease lease;
  const test::TemporaryDirectory state;
  test::Process server({argv[1], "--domain", std::to_string(lease.domain()), "--state-dir",
                        state.path().string(), "--log-level", "warn"},
                       state.path() / "log");
  client::Session session({.domain = {lease.domain(), ""}, .client_id = "bench", .sender = ""});
  if (!session.wait_for_server(std::chrono::seconds(20))) return 1;

  // One long as-fast run a worker, and one to spare.
  std::vector<std::string> load;
  for (unsigned i = 0; i <= std::thread::hardware_concurrency(); ++i)
    load.push_back(must_accept(
        session, {{"preset", kPreset},
                  {"stop", {{"when", "duration"}}},
                  {"telemetry", {{"sample_period_s", 10}}},
                  {"simulation", {{"duration_s", 100000}, {"ballast_operations_per_step", 4000}}}}));
  if (argc > 5 && std::string(argv[5]) == "planning") {
    json search = {{"preset", "vadali-singh-carter-1993/ground-on-off-8-lbf-160-ft3"}};
    for (const char* bound : {"least_starts", "most_starts", "enough_hits", "most_evaluations"})
      search["guidance"]["search"][bound] = 10000000;
    must_accept(session, search);
  }
  sleep_s(1);
  const Reading before = read(session, load, server.pid());
  sleep_s(kCalm_s);
  const Reading calm = read(session, load, server.pid());

  const json paced = {{"preset", kPreset},
                      {"stop", {{"when", "duration"}}},
                      {"simulation", {{"duration_s", duration_s}}},
                      {"telemetry", {{"sample_period_s", 1 / hz}, {"publish_max_hz", 50}}},
                      {"timing", {{"mode", "real_time"}}}};
  const std::string interval = std::to_string(static_cast<int>(1e6 / hz));
  test::Process cyclictest(
      {"/usr/bin/cyclictest", "--default-system", "-m", "-q", "-t", "2", "-p", "20", "--policy=fifo", "-i",
       interval, "-D", std::to_string(static_cast<int>(duration_s)), "-h", "20000"},
      state.path() / "cyclictest");
  // Begun as they come, so that their phases are spread.
  const auto first = Clock::now();
  std::vector<std::string> ids;
  for (int i = 0; i < experiments; ++i) ids.push_back(must_accept(session, paced));
  sleep_s(1);
  const Reading busy_begin = read(session, load, server.pid());
  std::this_thread::sleep_until(first + std::chrono::duration<double>(duration_s - 1));
  const Reading busy_end = read(session, load, server.pid());
  cyclictest.wait(std::chrono::seconds(30));
  sleep_s(3);
  const Reading calm_again = read(session, load, server.pid());
  sleep_s(kCalm_s);
  const Reading after = read(session, load, server.pid());

  Histogram lateness;
  std::string digest;
  bool same_digests = true;
  double overruns = 0, oversleeps = 0;
  for (const std::string& id : ids) {
    const json result = ask(session, "result", id);
    if (!result.is_object()) {
      std::fprintf(stderr, "%s has no result\n", id.c_str());
      continue;
    }
    const json& told = result.at("provenance").at("lateness");
    for (const json& bin : told.at("histogram"))
      lateness.counts[1e6 * bin[0].get<double>()] += bin[1].get<double>();
    lateness.max_us = std::max(lateness.max_us, 1e6 * told.at("max_s").get<double>());
    overruns += told.at("overruns").get<double>();
    oversleeps += told.at("oversleeps").get<double>();
    const std::string bits = result.at("provenance").at("digest").at("xxh3_128");
    if (digest.empty()) digest = bits;
    same_digests = same_digests && bits == digest;
  }

  std::printf("%d experiments at %.0f Hz for %.0f s, beside a load that saturates %u processors\n\n",
              experiments, hz, duration_s, std::thread::hardware_concurrency());
  std::printf("%-44s %10s %9s %9s %9s\n", "microseconds", "count", "p50", "p99", "max");
  lateness.print("lateness: due -> samples in the ring");
  const Histogram reference = read_cyclictest(state.path() / "cyclictest");
  reference.print("cyclictest, FIFO, same interval and time");
  std::printf("\np99 ratio %.2f; overruns %.0f, oversleeps %.0f; digests %s\n",
              lateness.quantile(0.99) / reference.quantile(0.99), overruns, oversleeps,
              same_digests ? "all the same" : "DIFFER");

  const auto wall = [](const Reading& a, const Reading& b) {
    return std::chrono::duration<double>(b.wall - a.wall).count();
  };
  const auto simulated = [](const Reading& a, const Reading& b) { return b.simulated_s - a.simulated_s; };
  const double calm_rate = (simulated(before, calm) + simulated(calm_again, after)) /
                           (wall(before, calm) + wall(calm_again, after));
  const double busy_rate = simulated(busy_begin, busy_end) / wall(busy_begin, busy_end);
  std::printf("\nas-fast load: %.0f simulated s/s alone, %.0f beside them: %.1f %% less\n", calm_rate,
              busy_rate, 100 * (1 - busy_rate / calm_rate));
  double given = 0, taken = 0;
  for (const auto& entry : busy_end.processor) {
    const std::string& name = entry.first;
    const auto spent = [&](const Reading& a, const Reading& b) {
      const auto then = a.processor.find(name), now = b.processor.find(name);
      return (now == b.processor.end() ? 0 : now->second) - (then == a.processor.end() ? 0 : then->second);
    };
    const double alone =
        (spent(before, calm) + spent(calm_again, after)) / (wall(before, calm) + wall(calm_again, after));
    const double beside = spent(busy_begin, busy_end) / wall(busy_begin, busy_end);
    if (name == "worker")
      given = beside / alone;
    else
      taken += beside - alone;
    if (beside > 0.001)
      std::printf("  %-12s %6.3f processors alone, %6.3f beside\n", name.c_str(), alone, beside);
  }
  std::printf("processor time: the paced ones take %.3f processors, the load gets %.1f %% less\n", taken,
              100 * (1 - given));
  std::printf("the load's work per processor second left to it: %.1f %% of what it is alone\n",
              100 * busy_rate / calm_rate / given);
  server.signal(SIGTERM);
  server.wait(std::chrono::seconds(30));
  return 0;
}
