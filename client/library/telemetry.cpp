#include "client/library/telemetry.hpp"

#include "idl/wire/text.hpp"

namespace slew::client {
namespace {

template <typename Sequence>
std::vector<ChannelName> names_of(const Sequence& channels) {
  std::vector<ChannelName> names;
  for (std::uint32_t i = 0; i < channels._length; ++i)
    names.push_back({std::string(wire::view(channels._buffer[i].name)),
                     std::string(wire::view(channels._buffer[i].unit))});
  return names;
}

// Batches kept for an experiment whose channels have not come yet.
constexpr std::size_t kMostEarly = 256;

}  // namespace

Telemetry::Telemetry(const wire::Domain& domain, wire::Delivery delivery)
    : channels_(domain),
      experiment_(domain),
      state_(domain, delivery),
      thrusters_(domain, delivery),
      waitset_(domain) {
  for (const dds_entity_t reader :
       {channels_.entity(), experiment_.entity(), state_.entity(), thrusters_.entity()})
    waitset_.attach(reader);
}

// DDS waits for room in a full cache with the thread by which it lets go of readers: a lossless one that
// nobody takes from any more would never be let go of.
Telemetry::~Telemetry() {
  state_.take([](const slew_v1_State&, const dds_sample_info_t&) {}, SIZE_MAX);
  thrusters_.take([](const slew_v1_Thrusters&, const dds_sample_info_t&) {}, SIZE_MAX);
}

bool Telemetry::poll(std::chrono::nanoseconds timeout, const Listener& listener) {
  const bool arrived = waitset_.wait(timeout);
  take_channels(listener);
  take_state(listener);
  take_thrusters(listener);
  experiment_.take([&](const slew_v1_Experiment& status, const dds_sample_info_t& info) {
    if (info.valid_data && listener.experiment) listener.experiment(status);
  });
  return arrived;
}

void Telemetry::take_channels(const Listener& listener) {
  channels_.take([&](const slew_v1_Channels& channels, const dds_sample_info_t& info) {
    const auto id = wire::Id::from(channels.experiment_id);
    if (info.instance_state == DDS_IST_NOT_ALIVE_DISPOSED) {
      streams_.erase(id);
      early_.erase(id);
    } else if (info.valid_data) {
      streams_[id].state = names_of(channels.state);
      streams_[id].thrusters = names_of(channels.thrusters);
      if (const auto early = early_.find(id); early != early_.end()) {
        for (const Early& batch : early->second)
          hand_on_rows(id, batch.is_state, batch.t_s, batch.values, listener);
        early_.erase(early);
      }
    }
  });
}

void Telemetry::take_state(const Listener& listener) {
  state_.take([&](const slew_v1_State& batch, const dds_sample_info_t& info) {
    if (!info.valid_data) return;
    Stream& stream = streams_[wire::Id::from(batch.experiment_id)];
    // Whoever joins in the middle has lost nothing of what came before.
    if (stream.has_begun && batch.seq > stream.next_seq) stream.lost += batch.seq - stream.next_seq;
    stream.has_begun = true;
    stream.next_seq = batch.seq + batch.count;
    stream.received += batch.count;
    stream.dropped = batch.dropped;
    hand_on(batch, true, listener);
  });
}

void Telemetry::take_thrusters(const Listener& listener) {
  thrusters_.take([&](const slew_v1_Thrusters& batch, const dds_sample_info_t& info) {
    if (info.valid_data) hand_on(batch, false, listener);
  });
}

// DDS keeps no order between topics: samples may be here before their channels are.
template <typename Batch>
void Telemetry::hand_on(const Batch& batch, bool is_state, const Listener& listener) {
  const auto id = wire::Id::from(batch.experiment_id);
  const std::span<const double> t_s(batch.t_s._buffer, batch.t_s._length);
  const std::span<const double> values(batch.values._buffer, batch.values._length);
  // A batch that contradicts itself is passed over.
  if (t_s.empty() || t_s.size() != batch.count || values.size() % t_s.size() != 0) return;
  if (!streams_[id].state.empty()) return hand_on_rows(id, is_state, t_s, values, listener);
  auto& early = early_[id];
  if (early.size() < kMostEarly)
    early.push_back({is_state, {t_s.begin(), t_s.end()}, {values.begin(), values.end()}});
}

void Telemetry::hand_on_rows(const wire::Id& id, bool is_state, std::span<const double> t_s,
                             std::span<const double> values, const Listener& listener) {
  const auto& listen = is_state ? listener.state : listener.thrusters;
  if (!listen) return;
  const Stream& stream = streams_[id];
  const std::size_t width = values.size() / t_s.size();
  for (std::size_t i = 0; i < t_s.size(); ++i) listen(id, stream, t_s[i], values.subspan(i * width, width));
}

}  // namespace slew::client
