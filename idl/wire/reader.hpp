// A typed reader of one topic.
#pragma once

#include <array>
#include <string>

#include "idl/wire/domain.hpp"
#include "idl/wire/topic.hpp"
#include "idl/wire/writer.hpp"

namespace slew::wire {

/// The domain must outlive it. One thread at a time.
template <typename T>
class Reader {
 public:
  explicit Reader(const Domain& domain, Delivery delivery = Delivery::reliable)
      : topic_(create_topic<T>(domain.participant())) {
    const dds_entity_t reader = dds_create_reader(domain.participant(), topic_.get(),
                                                  reader_qos(Topic<T>::flow, delivery).get(), nullptr);
    if (reader < 0)
      throw WireError(std::string("no reader of ") + Topic<T>::name + ": " + dds_strretcode(reader));
    reader_ = Entity(reader);
  }

  /// Takes what has arrived, at most `most` samples, and calls `each(const T&, const dds_sample_info_t&)`;
  /// where info.valid_data is false only the key fields mean anything. Returns how many there were.
  template <typename Function>
  std::size_t take(Function&& each, std::size_t most = 1024) {
    std::size_t total = 0;
    while (total < most) {
      std::array<void*, kLoan> samples{};
      std::array<dds_sample_info_t, kLoan> infos;
      const dds_return_t count = dds_take(reader_.get(), samples.data(), infos.data(), samples.size(), kLoan);
      if (count <= 0) break;
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
        each(*static_cast<const T*>(samples[i]), infos[i]);
      dds_return_loan(reader_.get(), samples.data(), count);
      total += static_cast<std::size_t>(count);
      if (count < static_cast<dds_return_t>(kLoan)) break;
    }
    return total;
  }

  /// How many writers are matched now.
  std::uint32_t matched() const {
    dds_subscription_matched_status_t status{};
    dds_get_subscription_matched_status(reader_.get(), &status);
    return status.current_count;
  }

  dds_entity_t entity() const { return reader_.get(); }

 private:
  static constexpr std::size_t kLoan = 32;
  Entity topic_;
  Entity reader_;
};

}  // namespace slew::wire
