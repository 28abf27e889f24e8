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

// Calls `each(t, row)` for the samples of a batch; a batch that contradicts itself is passed over.
template <typename Batch, typename Function>
void each_row(const Batch& batch, Function&& each) {
  const std::size_t count = batch.count;
  if (count == 0 || batch.t_s._length != count || batch.values._length % count != 0) return;
  const std::size_t width = batch.values._length / count;
  for (std::size_t i = 0; i < count; ++i)
    each(batch.t_s._buffer[i], std::span<const double>(batch.values._buffer + i * width, width));
}

}  // namespace

Telemetry::Telemetry(const wire::Domain& domain, bool best_effort)
    : channels_(domain),
      experiment_(domain),
      state_(domain, best_effort),
      thrusters_(domain, best_effort),
      waitset_(domain) {
  for (const dds_entity_t reader :
       {channels_.entity(), experiment_.entity(), state_.entity(), thrusters_.entity()})
    waitset_.attach(reader);
}

bool Telemetry::poll(std::chrono::nanoseconds timeout, const Listener& listener) {
  const bool arrived = waitset_.wait(timeout);
  take_channels();
  take_state(listener);
  take_thrusters(listener);
  experiment_.take([&](const slew_v1_Experiment& status, const dds_sample_info_t& info) {
    if (info.valid_data && listener.experiment) listener.experiment(status);
  });
  return arrived;
}

void Telemetry::take_channels() {
  channels_.take([this](const slew_v1_Channels& channels, const dds_sample_info_t& info) {
    const auto id = wire::Id::from(channels.experiment_id);
    if (info.instance_state == DDS_IST_NOT_ALIVE_DISPOSED) {
      streams_.erase(id);
    } else if (info.valid_data) {
      streams_[id].state = names_of(channels.state);
      streams_[id].thrusters = names_of(channels.thrusters);
    }
  });
}

void Telemetry::take_state(const Listener& listener) {
  state_.take([&](const slew_v1_State& batch, const dds_sample_info_t& info) {
    if (!info.valid_data) return;
    const auto id = wire::Id::from(batch.experiment_id);
    Stream& stream = streams_[id];
    // Whoever joins in the middle has lost nothing of what came before.
    if (stream.has_begun && batch.seq > stream.next_seq) stream.lost += batch.seq - stream.next_seq;
    stream.has_begun = true;
    stream.next_seq = batch.seq + batch.count;
    stream.received += batch.count;
    stream.dropped = batch.dropped;
    if (listener.state)
      each_row(batch, [&](double t_s, std::span<const double> row) { listener.state(id, stream, t_s, row); });
  });
}

void Telemetry::take_thrusters(const Listener& listener) {
  thrusters_.take([&](const slew_v1_Thrusters& batch, const dds_sample_info_t& info) {
    if (!info.valid_data || !listener.thrusters) return;
    const auto id = wire::Id::from(batch.experiment_id);
    each_row(batch, [&](double t_s, std::span<const double> row) {
      listener.thrusters(id, streams_[id], t_s, row);
    });
  });
}

}  // namespace slew::client
