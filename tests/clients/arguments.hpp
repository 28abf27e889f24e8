// What every test client has in common: its options, its way to end, its report.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "idl/wire/domain.hpp"

namespace slew::clients {

using Clock = std::chrono::steady_clock;

enum ExitCode { kAllWell = 0, kSomethingLost = 1, kBadUsage = 2, kNoServer = 3 };

inline Clock::time_point after(double seconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

inline double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// A command line with the options that all of them take.
class Arguments {
 public:
  explicit Arguments(const std::string& description) : app(description) {
    app.add_option("--domain", domain_.domain, "DDS domain, 1 to 99")
        ->envname("SLEW_DOMAIN")
        ->check(CLI::Range(1u, wire::kLargestDomain))
        ->capture_default_str();
    app.add_option("--dds-profile", profile_, "Cyclone DDS configuration (XML); without it: loopback only")
        ->envname("SLEW_DDS_PROFILE")
        ->check(CLI::ExistingFile);
    app.add_option("--security", domain_.identity, "DDS Security: the directory of an identity")
        ->envname("SLEW_SECURITY")
        ->check(CLI::ExistingDirectory);
    app.add_option("--for", for_s, "end after so many seconds at the latest")
        ->check(CLI::Range(0.0, 1e6))
        ->capture_default_str();
    app.add_flag("--json", json, "report as one JSON document");
  }

  /// False when there is nothing to do any more but to leave with `exit_code`.
  bool parse(int argc, char** argv) {
    domain_.domain = 1;
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      exit_code = app.exit(error) == 0 ? kAllWell : kBadUsage;
      return false;
    }
    if (profile_.empty()) return true;
    std::ostringstream text;
    text << std::ifstream(profile_).rdbuf();
    domain_.profile = text.str();
    return true;
  }

  const wire::DomainOptions& domain() const { return domain_; }

  /// The report in the form that was asked for.
  void report(const nlohmann::json& document) const {
    if (json)
      std::cout << document.dump() << '\n';
    else
      for (const auto& [name, value] : document.items()) std::cout << name << ": " << value.dump() << '\n';
  }

  CLI::App app;
  double for_s = 60;
  bool json = false;
  int exit_code = kAllWell;

 private:
  wire::DomainOptions domain_{1, ""};
  std::string profile_;
};

/// p50, p99 and max of what was collected; null of nothing.
inline nlohmann::json quantiles(std::vector<double> values) {
  if (values.empty()) return nullptr;
  std::sort(values.begin(), values.end());
  const auto at = [&](double fraction) {
    return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
  };
  return {{"p50", at(0.5)}, {"p99", at(0.99)}, {"max", values.back()}};
}

}  // namespace slew::clients
