// A subscription to telemetry: channels, samples row by row, gaps counted.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "idl/wire/domain.hpp"
#include "idl/wire/id.hpp"
#include "idl/wire/reader.hpp"
#include "idl/wire/waitset.hpp"

namespace slew::client {

struct ChannelName {
  std::string name;
  std::string unit;
};

/// What is known of one experiment's stream.
struct Stream {
  std::vector<ChannelName> state;  ///< known before the first sample is handed on
  std::vector<ChannelName> thrusters;
  std::uint64_t received = 0;  ///< samples of state
  std::uint64_t lost = 0;      ///< by gaps in seq, between server and here
  std::uint64_t dropped = 0;   ///< left out by the server
  std::uint64_t next_seq = 0;
  bool has_begun = false;
};

class Telemetry {
 public:
  struct Listener {
    std::function<void(const wire::Id&, const Stream&, double t_s, std::span<const double>)> state = {};
    std::function<void(const wire::Id&, const Stream&, double t_s, std::span<const double>)> thrusters = {};
    std::function<void(const slew_v1_Experiment&)> experiment = {};
  };

  /// The domain must outlive it. One thread at a time.
  explicit Telemetry(const wire::Domain& domain, wire::Delivery delivery = wire::Delivery::reliable);
  ~Telemetry();
  Telemetry(const Telemetry&) = delete;
  Telemetry& operator=(const Telemetry&) = delete;

  /// Waits for something to arrive and hands it on; true unless the time ran out.
  bool poll(std::chrono::nanoseconds timeout, const Listener& listener);

  const std::map<wire::Id, Stream>& streams() const { return streams_; }

 private:
  // A batch that came before its experiment's channels did.
  struct Early {
    bool is_state;
    std::vector<double> t_s;
    std::vector<double> values;
  };

  void take_channels(const Listener& listener);
  template <typename Batch>
  void hand_on(const Batch& batch, bool is_state, const Listener& listener);
  void hand_on_rows(const wire::Id& id, bool is_state, std::span<const double> t_s,
                    std::span<const double> values, const Listener& listener);
  void take_state(const Listener& listener);
  void take_thrusters(const Listener& listener);

  wire::Reader<slew_v1_Channels> channels_;
  wire::Reader<slew_v1_Experiment> experiment_;
  wire::Reader<slew_v1_State> state_;
  wire::Reader<slew_v1_Thrusters> thrusters_;
  wire::Waitset waitset_;
  std::map<wire::Id, Stream> streams_;
  std::map<wire::Id, std::vector<Early>> early_;
};

}  // namespace slew::client
