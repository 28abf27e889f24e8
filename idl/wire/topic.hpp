// The topics of version 1: for each type its name, descriptor and QoS. The table in topic.cpp is the
// contract.
#pragma once

#include <dds/dds.h>

#include "slew.h"

namespace slew::wire {

/// Owns a QoS object of the C API.
class Qos {
 public:
  Qos() : qos_(dds_create_qos()) {}
  Qos(Qos&& other) noexcept : qos_(other.qos_) { other.qos_ = nullptr; }
  Qos(const Qos&) = delete;
  Qos& operator=(const Qos&) = delete;
  ~Qos() { dds_delete_qos(qos_); }
  dds_qos_t* get() const { return qos_; }

 private:
  dds_qos_t* qos_;
};

/// How a topic travels; see design of the wire in server/doc/wire.md.
enum class Flow {
  order,      ///< request, control, query: reliable, keep-all, volatile, 256 samples, blocks 2 s at most
  answer,     ///< reliable, keep-all, volatile, 64 samples, blocks 2 s at most
  reply,      ///< reliable, transient-local, keep-last 8
  status,     ///< reliable, transient-local, keep-last 1
  telemetry,  ///< reliable, volatile, keep-last 256, lifespan 30 s
  heartbeat,  ///< as status, with a liveliness lease of 2 s
};

constexpr bool is_transient_local(Flow flow) {
  return flow == Flow::reply || flow == Flow::status || flow == Flow::heartbeat;
}

/// What a reader of telemetry asks for; every other flow is reliable.
enum class Delivery {
  reliable,     ///< lost samples are sent again; what is not taken in time gives way to what is newer
  best_effort,  ///< lost is lost
  lossless,     ///< nothing gives way: what is not taken is not acknowledged, and holds up a lossless writer
};

Qos writer_qos(Flow flow);
Qos reader_qos(Flow flow, Delivery delivery = Delivery::reliable);

template <typename T>
struct Topic;

#define SLEW_TOPIC(Type, Name, FlowName)                                       \
  template <>                                                                  \
  struct Topic<Type> {                                                         \
    static constexpr const char* name = Name;                                  \
    static constexpr Flow flow = Flow::FlowName;                               \
    static const dds_topic_descriptor_t* descriptor() { return &Type##_desc; } \
  }

SLEW_TOPIC(slew_v1_Request, "slew/v1/request", order);
SLEW_TOPIC(slew_v1_Control, "slew/v1/control", order);
SLEW_TOPIC(slew_v1_Query, "slew/v1/query", order);
SLEW_TOPIC(slew_v1_Reply, "slew/v1/reply", reply);
SLEW_TOPIC(slew_v1_Answer, "slew/v1/answer", answer);
SLEW_TOPIC(slew_v1_Experiment, "slew/v1/experiment", status);
SLEW_TOPIC(slew_v1_Channels, "slew/v1/channels", status);
SLEW_TOPIC(slew_v1_State, "slew/v1/state", telemetry);
SLEW_TOPIC(slew_v1_Thrusters, "slew/v1/thrusters", telemetry);
SLEW_TOPIC(slew_v1_Event, "slew/v1/event", reply);
SLEW_TOPIC(slew_v1_Server, "slew/v1/server", heartbeat);

#undef SLEW_TOPIC

}  // namespace slew::wire
