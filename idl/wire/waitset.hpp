// Waits for samples on several readers, or for a wake-up from another thread.
#pragma once

#include <chrono>

#include "idl/wire/domain.hpp"

namespace slew::wire {

class Waitset {
 public:
  explicit Waitset(const Domain& domain);

  /// Wakes wait() when the reader holds samples.
  void attach(dds_entity_t reader);
  /// From any thread: wakes wait() once.
  void wake();
  /// Until samples, a wake-up or the end of the time; true unless the time ran out.
  bool wait(std::chrono::nanoseconds timeout);

 private:
  Entity waitset_;
  Entity guard_;
};

}  // namespace slew::wire
