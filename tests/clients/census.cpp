// A late joiner that counts what a server keeps for late joiners: the instances of every transient-local
// topic. A server that forgets what it should has few of them, however long it has served.
#include <set>
#include <thread>

#include "idl/wire/id.hpp"
#include "idl/wire/reader.hpp"
#include "tests/clients/arguments.hpp"

namespace {

using namespace slew;
using namespace slew::clients;

template <typename T>
class Counted {
 public:
  Counted(const wire::Domain& domain, slew_v1_Id T::*key) : reader_(domain), key_(key) {}
  void look() {
    reader_.take([this](const T& sample, const dds_sample_info_t& info) {
      const auto id = wire::Id::from(sample.*key_);
      if (info.instance_state == DDS_IST_ALIVE)
        alive_.insert(id);
      else
        alive_.erase(id);
    });
  }
  std::size_t alive() const { return alive_.size(); }
  bool is_matched() const { return reader_.matched() > 0; }

 private:
  wire::Reader<T> reader_;
  slew_v1_Id T::*key_;
  std::set<wire::Id> alive_;
};

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments(
      "Counts the instances that a server keeps for late joiners.\nExit code 3 when there is no server.");
  double settle_s = 2;
  arguments.app.add_option("--settle", settle_s, "seconds to listen, from the match on")
      ->capture_default_str();
  if (!arguments.parse(argc, argv)) return arguments.exit_code;
  try {
    const wire::Domain domain(arguments.domain());
    Counted<slew_v1_Reply> reply(domain, &slew_v1_Reply::request_id);
    Counted<slew_v1_Experiment> experiment(domain, &slew_v1_Experiment::experiment_id);
    Counted<slew_v1_Channels> channels(domain, &slew_v1_Channels::experiment_id);
    Counted<slew_v1_Event> event(domain, &slew_v1_Event::experiment_id);
    const auto until = after(arguments.for_s);
    while (!(reply.is_matched() && experiment.is_matched() && channels.is_matched() && event.is_matched())) {
      if (Clock::now() >= until) {
        std::fprintf(stderr, "no server, or not permitted\n");
        return kNoServer;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    for (const auto settled = after(settle_s); Clock::now() < settled;
         std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
      reply.look();
      experiment.look();
      channels.look();
      event.look();
    }
    arguments.report({{"reply", reply.alive()},
                      {"experiment", experiment.alive()},
                      {"channels", channels.alive()},
                      {"event", event.alive()}});
    return kAllWell;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return kNoServer;
  }
}
