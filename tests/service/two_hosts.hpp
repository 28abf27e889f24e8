// Two hosts, as network namespaces with a cable between them, and nothing shared but the programs.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/service/process.hpp"

namespace slew::test {

inline const std::string kUnicastProfile = std::string(SLEW_SOURCE_DIR) + "/deploy/dds/unicast.xml";

inline std::string ip_program() {
  for (const char* path : {"/usr/sbin/ip", "/sbin/ip", "/usr/bin/ip"})
    if (std::filesystem::exists(path)) return path;
  return "";
}

inline bool ip(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), ip_program());
  return run(arguments).exit_code == 0;
}

// Two hosts and their cable, taken down whatever happens.
class TwoHosts {
 public:
  TwoHosts() {
    if (ip_program().empty()) {
      why_not_ = "iproute2 is not installed";
      return;
    }
    if (!ip({"netns", "add", ship_}) || !ip({"netns", "add", ground_})) {
      why_not_ = "this system does not permit network namespaces";
      return;
    }
    const bool is_up = ip({"-n", ship_, "link", "add", "cable0", "type", "veth", "peer", "name", "cable1",
                           "netns", ground_}) &&
                       ip({"-n", ship_, "addr", "add", "10.231.44.1/24", "dev", "cable0"}) &&
                       ip({"-n", ground_, "addr", "add", "10.231.44.2/24", "dev", "cable1"}) &&
                       ip({"-n", ship_, "link", "set", "lo", "up"}) &&
                       ip({"-n", ground_, "link", "set", "lo", "up"}) &&
                       ip({"-n", ship_, "link", "set", "cable0", "up"}) &&
                       ip({"-n", ground_, "link", "set", "cable1", "up"});
    if (!is_up) why_not_ = "this system does not permit veth pairs";
  }
  ~TwoHosts() {
    ip({"netns", "del", ship_});
    ip({"netns", "del", ground_});
  }

  const std::string& why_not() const { return why_not_; }
  std::vector<std::string> on_ship(const std::vector<std::string>& command) const {
    return at(ship_, {"SLEW_INTERFACE=cable0"}, command);
  }
  // Its working directory and its home are its own.
  std::vector<std::string> on_ground(const std::vector<std::string>& command) const {
    return at(ground_, {"-C", home_.path().string(), "SLEW_INTERFACE=cable1", "SLEW_PEER=10.231.44.1"},
              command);
  }
  const std::filesystem::path& home() const { return home_.path(); }

  /// So many percent of what arrives on either side is lost; 100: the cable is cut, 0: all is well. False
  /// where the system does not permit it.
  bool lose(int percent) const {
    bool all = true;
    for (const std::string& host : {ship_, ground_}) {
      std::string rules = "table inet lossy { }; delete table inet lossy; ";
      if (percent > 0)
        rules +=
            "add table inet lossy; add chain inet lossy in { type filter hook input priority 0 ; }; "
            "add rule inet lossy in iifname cable* meta l4proto udp " +
            (percent < 100 ? "numgen random mod 100 < " + std::to_string(percent) + " drop"
                           : std::string("drop"));
      all = run({ip_program(), "netns", "exec", host, "/usr/sbin/nft", rules}).exit_code == 0 && all;
    }
    return all;
  }

 private:
  std::vector<std::string> at(const std::string& host, const std::vector<std::string>& environment,
                              const std::vector<std::string>& command) const {
    std::vector<std::string> line{ip_program(), "netns", "exec", host, "/usr/bin/env", "-i"};
    line.insert(line.end(), environment.begin(), environment.end());
    line.insert(line.end(), {"PATH=/usr/bin:/bin", "HOME=" + home_.path().string(),
                             "SLEW_DDS_PROFILE=" + kUnicastProfile});
    for (const char* sanitizers : {"ASAN_OPTIONS", "TSAN_OPTIONS", "UBSAN_OPTIONS"})
      if (const char* value = std::getenv(sanitizers)) line.push_back(std::string(sanitizers) + "=" + value);
    line.insert(line.end(), command.begin(), command.end());
    return line;
  }

  const std::string ship_ = "slewship" + std::to_string(getpid());
  const std::string ground_ = "slewground" + std::to_string(getpid());
  const TemporaryDirectory home_;
  std::string why_not_;
};

}  // namespace slew::test
