// A typed writer of one topic.
#pragma once

#include <string>

#include "idl/wire/domain.hpp"
#include "idl/wire/leaked_key.h"
#include "idl/wire/topic.hpp"

namespace slew::wire {

/// Creates the topic (DDS hands out the same one again) in the participant. Throws WireError.
template <typename T>
Entity create_topic(dds_entity_t participant) {
  const dds_entity_t topic =
      dds_create_topic(participant, Topic<T>::descriptor(), Topic<T>::name, nullptr, nullptr);
  if (topic < 0) throw WireError(std::string("no topic ") + Topic<T>::name + ": " + dds_strretcode(topic));
  return Entity(topic);
}

/// Safe to use from several threads. The domain must outlive it.
template <typename T>
class Writer {
 public:
  explicit Writer(const Domain& domain) : topic_(create_topic<T>(domain.participant())) {
    const dds_entity_t writer =
        dds_create_writer(domain.participant(), topic_.get(), writer_qos(Topic<T>::flow).get(), nullptr);
    if (writer < 0)
      throw WireError(std::string("no writer of ") + Topic<T>::name + ": " + dds_strretcode(writer));
    writer_ = Entity(writer);
  }

  /// DDS_RETCODE_OK, or DDS_RETCODE_TIMEOUT when a keep-all flow stayed full for its blocking time.
  dds_return_t write(const T& sample) { return dds_write(writer_.get(), &sample); }
  /// The instance is over: readers see it disposed, and neither side keeps it.
  dds_return_t dispose(const T& key) {
    const dds_return_t code = dds_dispose(writer_.get(), &key);
    dds_unregister_instance(writer_.get(), &key);
    if constexpr (is_transient_local(Topic<T>::flow)) slew_release_leaked_key(writer_.get(), &key);
    return code;
  }
  /// Nothing more will be said of the instance; its samples stay with the readers.
  dds_return_t unregister(const T& key) { return dds_unregister_instance(writer_.get(), &key); }

  /// How many readers are matched now.
  std::uint32_t matched() const {
    dds_publication_matched_status_t status{};
    dds_get_publication_matched_status(writer_.get(), &status);
    return status.current_count;
  }

  /// Whether every matched reliable reader has acknowledged everything within the time.
  bool wait_for_acknowledgements(dds_duration_t timeout) {
    return dds_wait_for_acks(writer_.get(), timeout) == DDS_RETCODE_OK;
  }

  dds_entity_t entity() const { return writer_.get(); }

 private:
  Entity topic_;
  Entity writer_;
};

}  // namespace slew::wire
