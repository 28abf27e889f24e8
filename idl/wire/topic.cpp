#include "idl/wire/topic.hpp"

namespace slew::wire {
namespace {

constexpr dds_duration_t kBlocking = DDS_SECS(2);
// Batches a lossless reader holds before it stops acknowledging, and how long a batch of telemetry lives,
// with the writer and with readers. A reader that keeps up with a lossless stream takes 64 batches in
// `lossless_patience_s` (10 s), so its cache is empty long before anything in it is too old; of one that
// never acknowledges, the server holds no more than what it published within this time.
constexpr int kUntaken = 128;
constexpr dds_duration_t kTelemetryLife = DDS_SECS(30);
constexpr dds_duration_t kServerLease = DDS_SECS(2);

// What writer and reader of a flow must agree on.
void set_common(dds_qos_t* qos, Flow flow) {
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, kBlocking);
  switch (flow) {
    case Flow::order:
      dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
      dds_qset_resource_limits(qos, 256, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
      break;
    case Flow::answer:
      dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
      dds_qset_resource_limits(qos, 64, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
      break;
    case Flow::reply:
      dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
      dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 8);
      break;
    case Flow::heartbeat:
      dds_qset_liveliness(qos, DDS_LIVELINESS_AUTOMATIC, kServerLease);
      [[fallthrough]];
    case Flow::status:
      dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
      dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
      break;
    case Flow::telemetry:
      dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 256);
      break;
  }
}

}  // namespace

Qos writer_qos(Flow flow) {
  Qos qos;
  set_common(qos.get(), flow);
  // An experiment that ended is disposed on purpose; one whose server went away is only unregistered.
  dds_qset_writer_data_lifecycle(qos.get(), false);
  // What a late joiner of a transient-local topic gets is the durability service's history.
  const bool eight = flow == Flow::reply;
  dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, eight ? 8 : 1, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  if (flow == Flow::telemetry) dds_qset_lifespan(qos.get(), kTelemetryLife);
  return qos;
}

Qos reader_qos(Flow flow, Delivery delivery) {
  Qos qos;
  set_common(qos.get(), flow);
  if (flow != Flow::telemetry) return qos;
  if (delivery == Delivery::best_effort) dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  if (delivery == Delivery::lossless) {
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_ALL, 0);
    dds_qset_resource_limits(qos.get(), kUntaken, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  return qos;
}

}  // namespace slew::wire
