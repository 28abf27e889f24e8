// A client with much to ask: random valid requests, at a rate or as quickly as they are taken, many under way
// at once. Loses nothing silently: every request is answered, or counted as unanswered and exit code 1.
#include <algorithm>
#include <map>
#include <random>
#include <thread>

#include "idl/wire/id.hpp"
#include "idl/wire/phase.hpp"
#include "idl/wire/reader.hpp"
#include "idl/wire/text.hpp"
#include "idl/wire/waitset.hpp"
#include "idl/wire/writer.hpp"
#include "server/experiment/preset.hpp"
#include "tests/clients/arguments.hpp"

namespace {

using namespace slew;
using namespace slew::clients;
using nlohmann::json;

struct Options {
  std::size_t count = 100;
  double per_second = 0;
  std::uint64_t seed = 1;
  std::string client_id = "requester";
  double real_time_share = 0.2;
  std::vector<std::string> presets;
  bool wait = true;
};

struct UnderWay {
  std::string text;
  Clock::time_point written;
  Clock::time_point first_written;
  bool is_accepted = false;
};

// All entries of it, in whatever shape it is given, by one factor.
json scaled(const json& inertia, double factor) {
  if (inertia.is_number()) return inertia.get<double>() * factor;
  json all = json::array();
  for (const json& part : inertia) all.push_back(scaled(part, factor));
  return all;
}

// A preset with its parameters moved a little: always valid, hardly ever the same. A greater inertia leaves
// every coupled mode permitted, and every tensor a body's.
std::string random_request(const Options& options, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const std::string& preset = options.presets[random() % options.presets.size()];
  const json& base = preset_document(preset)->at("request");
  json maneuver = {{"initial_angle_deg", 20 * unit(random) - 10}};
  if (base.at("maneuver").at("type") == "three_axis")
    maneuver = {{"initial_rate_deg_s", {unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5}}};
  json request = {{"preset", preset},
                  {"simulation", {{"seed", random() % 1000}}},
                  {"telemetry", {{"publish_max_hz", random() % 3 * 50}}}};
  // A maneuver that is planned is planned once, and may not exist for other bodies.
  if (!base.contains("guidance")) {
    request["plant"]["inertia_kg_m2"] = scaled(base.at("plant").at("inertia_kg_m2"), 1 + 0.4 * unit(random));
    request["maneuver"] = maneuver;
  }
  if (unit(random) < options.real_time_share) {
    // In some seconds, so that what a dear one costs in one of them leaves room for others.
    constexpr double kFastest = 1000;
    const double rate = base.at("simulation").at("duration_s").get<double>() / (2 + 4 * unit(random));
    request["timing"] = {{"mode", "scaled"}, {"rate", std::min(rate, kFastest)}};
  }
  return request.dump();
}

class Requester {
 public:
  Requester(const wire::Domain& domain, Options options)
      : options_(std::move(options)),
        random_(options_.seed),
        request_(domain),
        reply_(domain),
        waitset_(domain) {
    waitset_.attach(reply_.entity());
  }

  bool wait_for_server(Clock::time_point until) {
    while (request_.matched() == 0 || reply_.matched() == 0) {
      if (Clock::now() >= until) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return true;
  }

  void go(Clock::time_point until) {
    const auto begin = Clock::now();
    while (Clock::now() < until && (submitted_ < options_.count || !under_way_.empty())) {
      const auto due = options_.per_second > 0
                           ? static_cast<std::size_t>(seconds_since(begin) * options_.per_second) + 1
                           : options_.count;
      if (submitted_ < std::min(due, options_.count))
        submit();
      else
        waitset_.wait(std::chrono::milliseconds(5));
      listen();
      ask_again();
    }
    wall_s_ = seconds_since(begin);
  }

  json report() const {
    return {{"submitted", submitted_},
            {"accepted", accepted_},
            {"rejected", rejected_},
            {"ended", ended_},
            {"unanswered", under_way_.size()},
            {"to_accepted_s", quantiles(to_accepted_s_)},
            {"to_end_s", quantiles(to_end_s_)},
            {"wall_s", wall_s_}};
  }
  bool lost_nothing() const { return under_way_.empty() && submitted_ == options_.count; }

 private:
  void submit() {
    const auto id = wire::Id::make();
    UnderWay& one = under_way_[id];
    one.text = random_request(options_, random_);
    one.first_written = Clock::now();
    write(id, one);
    ++submitted_;
  }

  // A full queue blocks for 2 s at most; what did not get in is written again when it is silent.
  void write(const wire::Id& id, UnderWay& one) {
    slew_v1_Request sample{};
    id.store(sample.request_id);
    wire::store(options_.client_id, sample.client_id);
    wire::store("requester", sample.sender);
    sample.json = wire::borrowed(one.text);
    request_.write(sample);
    request_.unregister(sample);
    one.written = Clock::now();
  }

  void listen() {
    reply_.take([this](const slew_v1_Reply& said, const dds_sample_info_t& info) {
      const auto place = under_way_.find(wire::Id::from(said.request_id));
      if (!info.valid_data || place == under_way_.end()) return;
      UnderWay& one = place->second;
      if (said.phase == slew_v1_REJECTED) {
        ++rejected_[std::string(wire::view(said.code))];
        under_way_.erase(place);
        return;
      }
      if (!std::exchange(one.is_accepted, true)) {
        ++accepted_;
        to_accepted_s_.push_back(seconds_since(one.first_written));
      }
      if (wire::is_terminal(said.phase)) {
        ++ended_[std::string(wire::phase_name(said.phase))];
        to_end_s_.push_back(seconds_since(one.first_written));
      }
      if (wire::is_terminal(said.phase) || !options_.wait) under_way_.erase(place);
    });
  }

  // Safe: the request_id makes it the same request. Asked about also when its end is long in coming.
  void ask_again() {
    if (Clock::now() < next_look_) return;
    next_look_ = after(0.2);
    std::size_t asked = 0;
    for (auto& [id, one] : under_way_) {
      const double silence_s = one.is_accepted ? 10 : 1;
      if (seconds_since(one.written) < silence_s || ++asked > 64) continue;
      write(id, one);
    }
  }

  const Options options_;
  std::mt19937_64 random_;
  wire::Writer<slew_v1_Request> request_;
  wire::Reader<slew_v1_Reply> reply_;
  wire::Waitset waitset_;
  std::map<wire::Id, UnderWay> under_way_;
  Clock::time_point next_look_{};
  std::size_t submitted_ = 0, accepted_ = 0;
  std::map<std::string, std::size_t> rejected_, ended_;
  std::vector<double> to_accepted_s_, to_end_s_;
  double wall_s_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments(
      "Sends random valid requests and counts what becomes of them.\n"
      "Exit code 1 when one of them was not answered in time.");
  Options options;
  auto& app = arguments.app;
  bool no_wait = false;
  app.add_option("--count", options.count, "how many")->capture_default_str();
  app.add_option("--per-second", options.per_second, "how many a second; 0: as quickly as they are taken")
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of the random choices")->capture_default_str();
  app.add_option("--client-id", options.client_id, "by which as-fast work is shared out")
      ->capture_default_str();
  app.add_option("--paced", options.real_time_share, "share of paced requests; they take 5 s at most")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--preset", options.presets, "choose among these; without it: all");
  app.add_flag("--no-wait", no_wait, "an accepted request is done with");
  if (!arguments.parse(argc, argv)) return arguments.exit_code;
  options.wait = !no_wait;
  if (options.presets.empty())
    for (const Preset& preset : presets()) options.presets.push_back(preset.name);
  try {
    const wire::Domain domain(arguments.domain());
    Requester requester(domain, options);
    const auto until = after(arguments.for_s);
    if (!requester.wait_for_server(std::min(until, after(5)))) {
      std::fprintf(stderr, "no server, or not permitted\n");
      return kNoServer;
    }
    requester.go(until);
    arguments.report(requester.report());
    return requester.lost_nothing() ? kAllWell : kSomethingLost;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return kNoServer;
  }
}
