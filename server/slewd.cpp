// slewd: the simulation service. Options, logs, signals; everything else is service/server.
#include <pthread.h>
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>
#include <thread>

#include "server/service/server.hpp"

namespace {

// Exit codes, as sysexits would have them for a service.
constexpr int kBadUsage = 2;
constexpr int kCannotServe = 1;
// After the drain: telemetry and results that are still on their way.
constexpr double kLastWords_s = 20;

std::filesystem::path default_state_directory() {
  if (const char* directory = std::getenv("STATE_DIRECTORY")) return directory;  // given by systemd
  if (const char* state = std::getenv("XDG_STATE_HOME"); state && *state)
    return std::filesystem::path(state) / "slewd";
  if (const char* home = std::getenv("HOME"); home && *home)
    return std::filesystem::path(home) / ".local/state/slewd";
  return "/var/lib/slewd";
}

std::string read_file(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// From the command line to the end of the service; the exit code.
int serve(int argc, char** argv) {
  slew::service::ServerOptions options;
  options.state_directory = default_state_directory();
  const std::size_t cores = std::max(1u, std::thread::hardware_concurrency());
  options.workers = cores;
  options.pacers = cores;
  options.domain.domain = 1;
  std::string profile;
  std::string level = "info";

  CLI::App app{
      "slewd keeps a library of spacecraft slew experiments running and answers requests over DDS.\n"
      "Example: slewd --domain 7 --state-dir /tmp/slewd"};
  app.set_version_flag("--version", SLEW_VERSION);
  app.set_config("--config", "", "read options from this file (name=value)");
  app.add_option("--domain", options.domain.domain, "DDS domain, 1 to 99")
      ->envname("SLEW_DOMAIN")
      ->check(CLI::Range(1u, slew::wire::kLargestDomain))
      ->capture_default_str();
  app.add_option("--dds-profile", profile, "Cyclone DDS configuration (XML); without it: loopback only")
      ->envname("SLEW_DDS_PROFILE")
      ->check(CLI::ExistingFile);
  app.add_option("--security", options.domain.identity,
                 "DDS Security: the directory of an identity, made by deploy/security/make-identities")
      ->envname("SLEW_SECURITY")
      ->check(CLI::ExistingDirectory);
  app.add_option("--state-dir", options.state_directory, "where journal and series are kept")
      ->capture_default_str();
  app.add_option("--workers", options.workers, "threads for as-fast work")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--pacers", options.pacers, "threads for paced work")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--drain", options.drain_s, "seconds that work under way gets to end after SIGTERM")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  app.add_option("--keep-days", options.keep_days, "days that results and series are kept after the end")
      ->check(CLI::Range(0.0, 36500.0))
      ->capture_default_str();
  app.add_option("--keep-gib", options.keep_gib, "GiB of series that are kept; the oldest make room")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  app.add_option("--sample-memory", options.sample_memory_mib,
                 "MiB for the samples of experiments that are not archived yet")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  app.add_option("--metrics-port", options.metrics_port,
                 "serve Prometheus metrics on this port of 127.0.0.1; 0: do not")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  app.add_option("--log-level", level, "how much to log to standard error")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadUsage;
  }
  if (!profile.empty()) options.domain.profile = read_file(profile);

  // Before any thread is made: all of them leave the signals to this one.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);

  spdlog::set_default_logger(spdlog::stderr_color_mt("slewd"));
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%e %^%l%$ %v");

  slew::service::Server server(options);
  int signal_number = 0;
  sigwait(&signals, &signal_number);
  spdlog::info("{} received", strsignal(signal_number));
  // A second signal does not wait for the drain; and nothing, be it a disk or a step, makes it last for ever.
  std::thread impatience([signals, longest_s = options.drain_s + kLastWords_s] {
    const timespec longest{static_cast<time_t>(longest_s), 0};
    int second = 0;
    do second = sigtimedwait(&signals, nullptr, &longest);
    while (second < 0 && errno == EINTR);  // somebody stopped the process and let it go on
    if (second < 0)
      std::fputs(
          "slewd: the drain did not come to its end in time; what is owed is made up for at the next start\n",
          stderr);
    std::_Exit(kCannotServe);
  });
  impatience.detach();
  if (server.drain()) return 0;
  // Whoever is in a step now cannot be waited for.
  std::_Exit(kCannotServe);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return serve(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "slewd: %s\n", error.what());
    return kCannotServe;
  }
}
