// The digest of a run: XXH3-128 over its events and its states, bit for bit (server/doc/step.md).
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "server/simulation/run.hpp"

namespace slew {

/// Collects 64-bit words and hashes them in blocks. Copies continue independently.
class Digester {
 public:
  Digester();
  Digester(const Digester& other);
  Digester& operator=(const Digester&) = delete;
  ~Digester();

  void word(std::uint64_t value) {
    block_[filled_++] = value;
    if (filled_ == block_.size()) hash_block();
  }
  void real(double value);
  /// t, channel and mode of an event.
  void event(const SwitchEvent& event);

  /// Of everything so far.
  Digest digest() const;

 private:
  struct State;
  void hash_block();

  std::array<std::uint64_t, 64> block_;
  std::size_t filled_ = 0;
  std::uint64_t words_ = 0;  ///< hashed already
  std::unique_ptr<State> state_;
};

}  // namespace slew
