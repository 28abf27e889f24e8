#include "server/service/telemetry_stream.hpp"

namespace slew::service {
namespace {

constexpr std::size_t kBatch = 64;

template <typename Sequence>
void borrow(Sequence& sequence, std::vector<double>& values) {
  sequence._maximum = sequence._length = static_cast<std::uint32_t>(values.size());
  sequence._buffer = values.data();
  sequence._release = false;
}

}  // namespace

std::size_t TelemetryStream::drain(Flight& flight, std::size_t most_batches) {
  SampleRing& ring = flight.ring();
  const auto states = static_cast<std::ptrdiff_t>(flight.run().channels().state.size());
  row_.resize(ring.width() + 1);
  std::size_t batches = 0;
  for (bool empty = false; !empty && batches < most_batches;) {
    t_s_.clear();
    state_values_.clear();
    thruster_values_.clear();
    while (t_s_.size() < kBatch && !(empty = !ring.pop(row_))) {
      t_s_.push_back(row_[0]);
      state_values_.insert(state_values_.end(), row_.begin() + 1, row_.begin() + 1 + states);
      thruster_values_.insert(thruster_values_.end(), row_.begin() + 1 + states, row_.end());
    }
    if (t_s_.empty()) break;
    write(flight);
    ++batches;
  }
  const std::uint64_t dropped = ring.dropped();
  dropped_.fetch_add(dropped - flight.dropped.exchange(dropped, std::memory_order_relaxed),
                     std::memory_order_relaxed);
  return batches;
}

void TelemetryStream::end(const Flight& flight) {
  slew_v1_State state{};
  flight.entry().experiment_id.store(state.experiment_id);
  state_.unregister(state);
  slew_v1_Thrusters thrusters{};
  flight.entry().experiment_id.store(thrusters.experiment_id);
  thrusters_.unregister(thrusters);
}

void TelemetryStream::write(Flight& flight) {
  slew_v1_State state{};
  flight.entry().experiment_id.store(state.experiment_id);
  state.seq = flight.next_seq;
  state.dropped = flight.ring().dropped();
  state.count = static_cast<std::uint32_t>(t_s_.size());
  borrow(state.t_s, t_s_);
  borrow(state.values, state_values_);
  state_.write(state);

  slew_v1_Thrusters thrusters{};
  flight.entry().experiment_id.store(thrusters.experiment_id);
  thrusters.seq = state.seq;
  thrusters.dropped = state.dropped;
  thrusters.count = state.count;
  borrow(thrusters.t_s, t_s_);
  borrow(thrusters.values, thruster_values_);
  thrusters_.write(thrusters);

  flight.next_seq += state.count;
  flight.published.store(flight.next_seq, std::memory_order_relaxed);
  published_.fetch_add(state.count, std::memory_order_relaxed);
}

}  // namespace slew::service
