// server and doctor: who is there; why do I see nothing.
#include <ifaddrs.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "client/slewctl/commands.hpp"
#include "client/slewctl/connection.hpp"
#include "client/slewctl/terminal.hpp"
#include "idl/wire/text.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

json server_document(const slew_v1_Server& status) {
  return {{"server_id", wire::Id::from(status.server_id).hex()},
          {"boot_id", wire::Id::from(status.boot_id).hex()},
          {"version", wire::view(status.version)},
          {"host", wire::view(status.host)},
          {"process_id", status.process_id},
          {"started_unix_ns", status.started_unix_ns},
          {"workers", status.workers},
          {"pacers", status.pacers},
          {"realtime_policy", status.realtime_policy},
          {"draining", status.draining},
          {"queued", status.queued},
          {"queue_limit", status.queue_limit},
          {"running", status.running},
          {"paced", status.paced},
          {"held", status.held},
          {"paced_load", status.paced_load},
          {"lateness_p99_s", status.lateness_p99_s},
          {"lateness_max_s", status.lateness_max_s},
          {"accepted", status.accepted},
          {"rejected", status.rejected},
          {"completed", status.completed},
          {"failed", status.failed},
          {"cancelled", status.cancelled},
          {"interrupted", status.interrupted},
          {"malformed", status.malformed},
          {"samples_published", status.samples_published},
          {"samples_dropped", status.samples_dropped},
          {"resident_bytes", status.resident_bytes}};
}

// "eth0, lo"
std::string interfaces() {
  std::set<std::string> names;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) == 0)
    for (const ifaddrs* one = list; one; one = one->ifa_next) names.insert(one->ifa_name);
  freeifaddrs(list);
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

struct Check {
  std::string what;
  bool is_good;
  std::string found;
};

// In the order in which one depends on the one before.
std::vector<Check> examine(const Options& options) {
  std::vector<Check> checks;
  const auto note = [&](const char* what, bool is_good, std::string found) {
    checks.push_back({what, is_good, std::move(found)});
    return is_good;
  };
  std::unique_ptr<client::Session> session;
  try {
    session = std::make_unique<client::Session>(session_options(options));
  } catch (const wire::WireError& error) {
    note("enter the domain", false,
         std::string(error.what()) + "\nThe profile must name an interface of this host (" + interfaces() +
             "); deploy/dds/unicast.xml takes it from SLEW_INTERFACE");
    return checks;
  }
  const std::string domain = "domain " + std::to_string(options.domain);
  note("enter the domain", true,
       domain + (options.dds_profile.empty() ? ", the built-in profile: loopback only"
                                             : ", " + options.dds_profile));
  const auto servers = session->servers(seconds(options.connect_s), 1);
  if (!note("hear a server", !servers.empty(),
            servers.empty()
                ? "none in " + domain + ". Is slewd running there (--domain, SLEW_DOMAIN)? " +
                      (options.dds_profile.empty()
                           ? "Only this host was looked at; for another one take deploy/dds/unicast.xml "
                             "on both (--dds-profile, SLEW_DDS_PROFILE)"
                           : "Does the profile lead to its host (SLEW_INTERFACE, SLEW_PEER), and does no "
                             "firewall stop UDP ports from 7400 on?")
                : std::to_string(servers.size()) + " heard"))
    return checks;
  for (const slew_v1_Server& server : servers) {
    const std::string version(wire::view(server.version));
    note("the same version", version == SLEW_VERSION,
         version == SLEW_VERSION
             ? version
             : "the server is " + version +
                   ", this is " SLEW_VERSION
                   "; what one does not know the other may refuse. Install the same on both");
    note("it takes requests", !server.draining,
         server.draining ? "it is shutting down; try again when it is back" : "yes");
  }
  const bool is_let_in = session->wait_for_server(seconds(options.connect_s));
  if (!note("be let in", is_let_in,
            is_let_in
                ? "requests, queries and answers are matched"
                : "the server is heard but does not match requests: this client's certificate or permissions "
                  "do not allow them (DDS tells no more), or the two speak other versions of the wire"))
    return checks;
  const auto answer = session->query("list", R"({"limit":1})", seconds(3));
  note("get an answer", answer && answer->is_ok(),
       answer ? "code " + answer->code : "silence for 3 s: the server is there but stuck; its log may tell");
  return checks;
}

}  // namespace

int server(const Options& options) {
  std::vector<slew_v1_Server> servers;
  try {
    client::Session session(session_options(options));
    servers = session.servers(seconds(options.connect_s), 1);
    // One was heard: others in the domain would be heard now too.
    if (!servers.empty()) servers = session.servers(std::chrono::milliseconds(200));
  } catch (const wire::WireError& error) {
    throw Stop{kNoServer, error.what()};
  }
  if (servers.empty()) throw Stop{kNoServer, "no server in domain " + std::to_string(options.domain)};
  if (options.json) {
    json list = json::array();
    for (const auto& status : servers) list.push_back(server_document(status));
    print_json(list);
    return kDone;
  }
  for (const auto& status : servers) {
    std::vector<std::vector<std::string>> rows{{std::string("what"), std::string("value")}};
    const json document = server_document(status);
    for (const auto& [key, value] : document.items())
      rows.push_back({key, value.is_string() ? value.get<std::string>() : value.dump()});
    std::cout << table(rows);
  }
  return kDone;
}

int doctor(const Options& options) {
  const auto checks = examine(options);
  bool all_good = true;
  json list = json::array();
  for (const Check& check : checks) {
    all_good = all_good && check.is_good;
    list.push_back({{"check", check.what}, {"good", check.is_good}, {"found", check.found}});
    if (!options.json)
      std::cout << (check.is_good ? "  ok  " : "  NO  ") << check.what << ": " << check.found << "\n";
  }
  if (options.json) print_json({{"good", all_good}, {"checks", list}});
  return all_good ? kDone : kNoServer;
}

}  // namespace slew::ctl
