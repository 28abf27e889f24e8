// Random sequences of everything that can be done to experiments, against a small model of the rules. A
// sequence is a list of steps that mean something in any order, so that a failing one can be shortened.
//
// SLEW_RULE_STEPS: how many steps (3,000). SLEW_RULE_SEED: one seed instead of those that are kept.
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <iostream>
#include <map>
#include <random>

#include "tests/service/phase_model.hpp"
#include "tests/service/server_under_test.hpp"
#include "tests/service/shrink.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

// Every seed that ever failed stays here.
constexpr std::uint64_t kSeeds[] = {1, 2, 3};
constexpr std::size_t kMostAlive = 12;
constexpr auto kPatience = std::chrono::seconds(30);
constexpr auto kShortening = std::chrono::minutes(3);

enum class Act {
  submit,
  submit_again,
  conflict,
  pause,
  resume,
  step,
  rate,
  cancel,
  nonsense,
  unknown,
  query,
  bad_query,
  disconnect,
  kill,
  stop
};
constexpr const char* kNames[] = {"submit", "submit_again", "conflict",   "pause",    "resume",
                                  "step",   "rate",         "cancel",     "nonsense", "unknown",
                                  "query",  "bad_query",    "disconnect", "kill",     "stop"};

/// `which` chooses among the experiments there are, `how` among the ways to do it.
struct Step {
  Act act;
  unsigned which;
  unsigned how;
};

std::ostream& operator<<(std::ostream& out, const Step& step) {
  return out << "{Act::" << kNames[static_cast<int>(step.act)] << ", " << step.which << ", " << step.how
             << "}";
}

std::vector<Step> random_steps(std::uint64_t seed, std::size_t count) {
  std::mt19937_64 random(seed);
  std::discrete_distribution<int> acts{16, 4, 2, 14, 14, 10, 8, 12, 3, 2, 14, 3, 2, 0.7, 0.3};
  std::vector<Step> steps;
  for (std::size_t i = 0; i < count; ++i)
    steps.push_back({static_cast<Act>(acts(random)), static_cast<unsigned>(random() % 1000),
                     static_cast<unsigned>(random() % 1000)});
  return steps;
}

struct Broken {
  std::string sentence;
};

void require(bool holds, const std::string& sentence) {
  if (!holds) throw Broken{sentence};
}

// Plays steps on a server of its own and holds every answer against the model.
class Play {
 public:
  Play() : server_({"--drain", "0.1"}), session_(server_.session()) {}

  void take(const Step& step) {
    switch (step.act) {
      case Act::submit:
        return submit(step.how);
      case Act::disconnect:
        return connect_anew();
      case Act::kill:
        server_.kill();
        return start_again();
      case Act::stop:
        require(server_.stop() == 0, "SIGTERM did not end it with exit code 0");
        return start_again();
      case Act::unknown: {
        const auto said = session_->control(client::Action::pause, wire::Id::make(), 0, kPatience);
        return require(said && said->code == "not_found", "a control of nothing was not answered not_found");
      }
      default:
        break;
    }
    if (experiments_.empty()) return;
    auto& [id, one] = *std::next(experiments_.begin(), step.which % experiments_.size());
    switch (step.act) {
      case Act::submit_again:
        return submit_again(id, one);
      case Act::conflict:
        return conflict(one);
      case Act::pause:
        return control(id, one, client::Action::pause, 0, one.model.pause());
      case Act::resume:
        return control(id, one, client::Action::resume, 0, one.model.resume());
      case Act::step:
        return control(id, one, client::Action::step, 0.01 * (1 + step.how % 4), one.model.step());
      case Act::rate:
        return control(id, one, client::Action::rate, 0.5 * (1 + step.how % 6), one.model.rate());
      case Act::cancel:
        return control(id, one, client::Action::cancel, 0, one.model.cancel());
      case Act::nonsense:
        return control(id, one, step.how % 2 ? client::Action::step : client::Action::rate,
                       step.how % 3 ? -1 : std::numeric_limits<double>::quiet_NaN(), "not_possible");
      case Act::query:
        return query(id, one, step.how);
      default:
        return bad_query(step.how);
    }
  }

  std::string end_of_log() const {
    constexpr std::size_t kMost = 4000;
    const std::string log = server_.log();
    return "controls:\n" + controls_.substr(controls_.size() - std::min(controls_.size(), kMost)) +
           "the end of the server's log:\n" + log.substr(log.size() - std::min(log.size(), kMost));
  }

  /// Everything is where the model has it.
  void compare_all() {
    for (const auto& [id, one] : experiments_) await(id, one);
    const json history = ask("history", {{"limit", 1}});
    require(history.at("total") == experiments_.size(),
            "history counts " + history.at("total").dump() + " of " + std::to_string(experiments_.size()));
  }

 private:
  struct One {
    PhaseModel model;
    wire::Id request_id;
    std::string text;
  };

  std::size_t alive() const {
    std::size_t count = 0;
    for (const auto& [id, one] : experiments_) count += !one.model.has_ended();
    return count;
  }

  void submit(unsigned how) {
    if (alive() >= kMostAlive) return;
    One one;
    one.model.is_paced = how % 3 != 0;
    one.model.starts_held = how % 2 == 0;
    one.model.runs_again = how % 5 == 0;
    one.model.expires = how % 11 == 0;
    // A paced one never comes to its end while the test lasts; an as-fast one is through in no time.
    json body = {{"preset", "agrawal-bang-1995/rigid-single-sided"},
                 {"label", std::to_string(how)},
                 {"stop", {{"when", "duration"}}},
                 {"simulation", {{"duration_s", one.model.is_paced ? 20000 : 100}}},
                 {"telemetry", {{"sample_period_s", one.model.is_paced ? 0.02 : 0.1}}},
                 {"timing", {{"start", one.model.starts_held ? "held" : "now"}}}};
    if (one.model.is_paced) {
      body["timing"]["mode"] = "real_time";
      body["timing"]["after_restart"] = one.model.runs_again ? "run_again" : "interrupted";
    }
    if (one.model.expires) body["timing"]["expires_s"] = 0.05;
    one.text = body.dump();
    one.request_id = wire::Id::make();
    const auto said = session_->submit(one.text, one.request_id, kPatience);
    require(said && said->phase != slew_v1_REJECTED,
            "a valid request was not accepted: " + (said ? said->json : std::string("silence")));
    one.model.submitted();
    const auto& place = experiments_.emplace(said->experiment_id, one).first;
    await(place->first, place->second);
  }

  void submit_again(const wire::Id& id, const One& one) {
    session_->forget(one.request_id);
    const auto said = session_->submit(one.text, one.request_id, kPatience);
    require(said && said->experiment_id == id && said->phase != slew_v1_REJECTED,
            "the same request was not the same experiment: " + (said ? said->json : std::string("silence")));
  }

  void conflict(const One& one) {
    session_->forget(one.request_id);
    const auto said =
        session_->submit(R"({"preset":"agrawal-bang-1995/rigid-sliding"})", one.request_id, kPatience);
    require(said && said->code == "conflict",
            "another text under the same id: " + (said ? said->code : std::string("silence")));
  }

  void control(const wire::Id& id, const One& one, client::Action action, double value,
               const std::string& expected) {
    const auto said = session_->control(action, id, value, kPatience);
    require(said.has_value(), "a control of " + id.hex() + " was not answered");
    std::ostringstream line;
    line << "  " << id.hex() << " control " << static_cast<int>(action) << ' ' << value << ": " << said->json
         << '\n';
    controls_ += line.str();
    require(said->code == expected,
            "a control was answered " + said->code + ", not " + expected + ": " + said->json);
    await(id, one);
  }

  json ask(const std::string& kind, const json& arguments) {
    const auto answer = session_->query(kind, arguments.dump(), kPatience);
    require(answer && answer->is_ok(), "the query " + kind + " got " + (answer ? answer->json : "silence"));
    return json::parse(answer->json);
  }

  json show(const wire::Id& id) { return ask("show", {{"id", id.hex()}}); }

  // Until the phase is what the model says; it stays that.
  void await(const wire::Id& id, const One& one) {
    const std::string expected(wire::phase_name(one.model.phase));
    std::string found;
    for (const auto until = std::chrono::steady_clock::now() + kPatience;
         std::chrono::steady_clock::now() < until;
         std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
      const json shown = show(id);
      found = shown.at("phase");
      if (found != expected) continue;
      require(one.model.has_begun || one.model.has_ended() || shown.at("t_sim_s") == 0,
              "it has flown before it has begun");
      return;
    }
    throw Broken{"experiment " + id.hex() + " is " + found + ", not " + expected + ": " + one.text};
  }

  void query(const wire::Id& id, const One& one, unsigned how) {
    const auto answer =
        session_->query(how % 2 ? "result" : "series", json{{"id", id.hex()}}.dump(), kPatience);
    require(answer.has_value(), "a query was not answered");
    if (!one.model.has_ended())
      return require(answer->code == "not_finished", "not ended, but " + answer->code);
    if (how % 2) {
      require(answer->is_ok(), "an ended experiment without a result: " + answer->json);
      return require(json::parse(answer->json).at("phase") == wire::phase_name(one.model.phase),
                     "the result tells another phase");
    }
    require(answer->is_ok() || !one.model.has_begun || one.model.phase != slew_v1_COMPLETED,
            "a completed experiment without its series: " + answer->json);
  }

  void bad_query(unsigned how) {
    static const std::pair<const char*, const char*> bad[] = {{"destroy", "{}"},
                                                              {"list", "[]"},
                                                              {"list", R"({"limit":-1})"},
                                                              {"show", R"({"id":"xyz"})"},
                                                              {"series", R"({"id":[1]})"},
                                                              {"describe", "{}"},
                                                              {"list", "{\"phase\":\"\xC3\"}"}};
    const auto& [kind, arguments] = bad[how % std::size(bad)];
    const auto answer = session_->query(kind, arguments, kPatience);
    require(answer && answer->code == "invalid", std::string("the query ") + kind + arguments +
                                                     " was answered " +
                                                     (answer ? answer->code : "by silence"));
  }

  void connect_anew() {
    session_.reset();
    session_ = server_.session();
  }

  void start_again() {
    server_.start();
    for (auto& [id, one] : experiments_) one.model.restarted();
    // The session stays, as a client's would; what it controls has to have found the new server first.
    std::optional<client::Reply> said;
    for (int i = 0; i < 60 && !said; ++i)
      said = session_->control(client::Action::pause, wire::Id::make(), 0, std::chrono::milliseconds(500));
    require(said.has_value(), "a client that stayed did not find the new server");
    compare_all();
  }

  ServerUnderTest server_;
  std::unique_ptr<client::Session> session_;
  std::map<wire::Id, One> experiments_;
  std::string controls_;  // and what they were answered
};

// What is wrong with the server, if anything is.
std::optional<std::string> play(const std::vector<Step>& steps) {
  Play play;
  for (std::size_t i = 0; i < steps.size(); ++i) try {
      play.take(steps[i]);
      if (i % 100 == 99) play.compare_all();
    } catch (const Broken& broken) {
      std::ostringstream text;
      text << "step " << i << ", " << steps[i] << ": " << broken.sentence << "\n" << play.end_of_log();
      return text.str();
    }
  try {
    play.compare_all();
  } catch (const Broken& broken) {
    return "at the end: " + broken.sentence;
  }
  return std::nullopt;
}

std::size_t steps_wanted() {
  const char* steps = std::getenv("SLEW_RULE_STEPS");
  return steps ? static_cast<std::size_t>(std::atol(steps)) : 3000;
}

void expect_the_rules(std::uint64_t seed, std::size_t count) {
  auto steps = random_steps(seed, count);
  const auto wrong = play(steps);
  if (!wrong) return;
  // Said before it is shortened: who waits for that may lose patience first.
  std::cout << "seed " << seed << ": " << *wrong << std::endl;
  const auto enough = std::chrono::steady_clock::now() + kShortening;
  const auto still_fails = [enough](const std::vector<Step>& some) {
    return std::chrono::steady_clock::now() < enough && play(some).has_value();
  };
  const auto shorter = shrink(steps, still_fails, 60);
  std::ostringstream text;
  for (const Step& step : shorter) text << "  " << step << ",\n";
  ADD_FAILURE() << "seed " << seed << ": " << *wrong << "\nshortened to:\n" << text.str();
}

TEST(RandomRules, HoldForEverySequence) {
  if (const char* seed = std::getenv("SLEW_RULE_SEED"))
    return expect_the_rules(std::strtoull(seed, nullptr, 10), steps_wanted());
  for (const std::uint64_t seed : kSeeds) expect_the_rules(seed, steps_wanted() / std::size(kSeeds));
  std::cout << steps_wanted() << " steps\n";
}

TEST(RandomRules, AFailureIsShortened) {
  // Fails when a 7 comes somewhere before a 3.
  const auto fails = [](const std::vector<int>& some) {
    const auto seven = std::find(some.begin(), some.end(), 7);
    return std::find(seven, some.end(), 3) != some.end();
  };
  std::vector<int> long_one;
  for (int i = 0; i < 500; ++i) long_one.push_back(i * 37 % 100);
  ASSERT_TRUE(fails(long_one));
  EXPECT_EQ(shrink(long_one, fails, 1000), (std::vector{7, 3}));
}

}  // namespace
