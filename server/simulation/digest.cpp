#include "server/simulation/digest.hpp"

#include <xxhash.h>

#include <bit>
#include <cstdio>
#include <new>

namespace slew {

static_assert(std::endian::native == std::endian::little, "words are hashed as they stand in memory");

struct Digester::State {
  XXH3_state_t* xxh3 = XXH3_createState();
  State() {
    if (!xxh3) throw std::bad_alloc();
  }
  ~State() { XXH3_freeState(xxh3); }
};

Digester::Digester() : state_(std::make_unique<State>()) {
  XXH3_128bits_reset(state_->xxh3);
}

Digester::Digester(const Digester& other)
    : block_(other.block_), filled_(other.filled_), words_(other.words_), state_(std::make_unique<State>()) {
  XXH3_copyState(state_->xxh3, other.state_->xxh3);
}

Digester::~Digester() = default;

void Digester::real(double value) {
  word(std::bit_cast<std::uint64_t>(value));
}

void Digester::event(const SwitchEvent& event) {
  real(event.t_s);
  word(event.channel);
  word(static_cast<std::uint64_t>(static_cast<std::int64_t>(event.mode)));
}

void Digester::hash_block() {
  XXH3_128bits_update(state_->xxh3, block_.data(), filled_ * sizeof(std::uint64_t));
  words_ += filled_;
  filled_ = 0;
}

Digest Digester::digest() const {
  Digester whole(*this);
  whole.hash_block();
  const XXH128_hash_t hash = XXH3_128bits_digest(whole.state_->xxh3);
  return {hash.high64, hash.low64, whole.words_ * sizeof(std::uint64_t)};
}

std::string Digest::hex() const {
  char text[33];
  std::snprintf(text, sizeof text, "%016llx%016llx", static_cast<unsigned long long>(high),
                static_cast<unsigned long long>(low));
  return text;
}

}  // namespace slew
