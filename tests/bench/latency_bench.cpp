// How long a client waits: from writing a request to reading `accepted`, and to the first sample of
// telemetry, beside the round trip of ddsperf in the same run. Times vary between machines; the ratios less
// so.
//
// usage: latency_bench SLEWD [COUNT]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <regex>
#include <sstream>
#include <thread>
#include <vector>

#include <signal.h>

#include "idl/wire/id.hpp"
#include "idl/wire/reader.hpp"
#include "idl/wire/text.hpp"
#include "idl/wire/waitset.hpp"
#include "tests/service/domain_lease.hpp"
#include "tests/service/process.hpp"

namespace {

using namespace slew;
using Clock = std::chrono::steady_clock;

constexpr const char* kRequest =
    R"({"preset":"agrawal-bang-1995/rigid-single-sided","telemetry":{"publish_max_hz":100}})";

double quantile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0
                        : values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

void print(const char* what, const std::vector<double>& us) {
  std::printf("%-52s %9.0f %9.0f %9.0f\n", what, quantile(us, 0.5), quantile(us, 0.99), quantile(us, 1));
}

// ddsperf's own ping and pong, 256 bytes, with our profile, for three seconds.
void print_ddsperf(std::uint32_t domain) {
  test::TemporaryDirectory directory;
  setenv("CYCLONEDDS_URI", wire::loopback_profile().c_str(), 1);
  const std::string id = std::to_string(domain);
  const auto output = directory.path() / "ping";
  test::Process pong({"/usr/bin/ddsperf", "-i", id, "-D", "5", "pong"}, {});
  test::Process ping({"/usr/bin/ddsperf", "-i", id, "-D", "4", "ping", "size", "256"}, output);
  ping.wait(std::chrono::seconds(10));
  std::ostringstream text;
  text << std::ifstream(output).rdbuf();
  // "... mean 38.6us min 25.3us 50% 36.7us 90% 45us 99% 88us max 1ms cnt 24000"
  const std::string all = text.str();
  static const std::regex line(R"(50% ([0-9.]+)us.*99% ([0-9.]+)us max ([0-9.]+)us)");
  std::smatch found, last;
  for (auto from = all.cbegin(); std::regex_search(from, all.cend(), found, line);
       from = found.suffix().first)
    last = found;
  if (last.empty()) {
    std::printf("ddsperf said nothing that could be read:\n%s\n", all.c_str());
    return;
  }
  std::printf("%-52s %9.0f %9.0f %9.0f\n", "ddsperf ping, round trip, 256 B", std::stod(last[1]),
              std::stod(last[2]), std::stod(last[3]));
}

// `identities`: where deploy/security/make-identities put them; empty: without DDS Security.
void measure(const char* slewd, const std::filesystem::path& state, const char* where, int count,
             const std::filesystem::path& identities = {}) {
  const test::DomainLease lease;
  std::vector<std::string> command{slewd,         "--domain",     std::to_string(lease.domain()),
                                   "--state-dir", state.string(), "--log-level",
                                   "warn"};
  wire::DomainOptions options{lease.domain(), ""};
  if (!identities.empty()) {
    command.insert(command.end(), {"--security", (identities / "server").string()});
    options.identity = (identities / "operator").string();
  }
  test::Process server(command, {});
  const wire::Domain domain(options);
  wire::Writer<slew_v1_Request> request(domain);
  wire::Reader<slew_v1_Reply> reply(domain);
  wire::Reader<slew_v1_State> state_reader(domain);
  wire::Waitset waitset(domain);
  waitset.attach(reply.entity());
  waitset.attach(state_reader.entity());
  while (request.matched() == 0 || reply.matched() == 0 || state_reader.matched() == 0)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));

  std::vector<double> to_accepted, to_telemetry;
  std::string text = kRequest;
  for (int i = 0; i < count; ++i) {
    const auto id = wire::Id::make();
    slew_v1_Request sample{};
    id.store(sample.request_id);
    wire::store("bench", sample.client_id);
    sample.json = wire::borrowed(text);
    const auto begin = Clock::now();
    request.write(sample);
    bool accepted = false, seen = false, ended = false;
    while (!(accepted && seen && ended)) {
      if (!waitset.wait(std::chrono::seconds(5))) {
        std::fprintf(stderr, "no answer within 5 s\n");
        std::exit(1);
      }
      const double us = std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
      reply.take([&](const slew_v1_Reply& answer, const dds_sample_info_t& info) {
        if (!info.valid_data || wire::Id::from(answer.request_id) != id) return;
        if (answer.phase == slew_v1_ACCEPTED && !accepted) {
          accepted = true;
          to_accepted.push_back(us);
        }
        if (answer.phase == slew_v1_COMPLETED) ended = true;
      });
      state_reader.take([&](const slew_v1_State&, const dds_sample_info_t& info) {
        if (!info.valid_data || seen) return;
        seen = true;
        to_telemetry.push_back(us);
      });
    }
    request.unregister(sample);
  }
  print((std::string("request -> accepted, journal on ") + where).c_str(), to_accepted);
  print((std::string("request -> first telemetry, journal on ") + where).c_str(), to_telemetry);
  server.signal(SIGTERM);
  server.wait(std::chrono::seconds(20));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s SLEWD [COUNT]\n", argv[0]);
    return 2;
  }
  const int count = argc > 2 ? std::atoi(argv[2]) : 200;
  std::printf("%-52s %9s %9s %9s\n", "microseconds", "p50", "p99", "max");
  {
    const test::DomainLease lease;
    print_ddsperf(lease.domain());
  }
  const std::filesystem::path memory = "/dev/shm/slewd-bench-" + std::to_string(getpid());
  std::filesystem::create_directory(memory);
  measure(argv[1], memory, "tmpfs", count);
  std::filesystem::remove_all(memory);
  const test::TemporaryDirectory identities;
  if (test::run({"/bin/bash", SLEW_SOURCE_DIR "/deploy/security/make-identities", identities.path().string()})
          .exit_code == 0) {
    std::filesystem::create_directory(memory);
    measure(argv[1], memory, "tmpfs, DDS Security", count, identities.path());
    std::filesystem::remove_all(memory);
  }
  const test::TemporaryDirectory disk;
  measure(argv[1], disk.path(), "disk", count);
  return 0;
}
