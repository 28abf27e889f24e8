#include "server/random/random_stream.hpp"

#include "server/random/inverse_normal.hpp"
#include "server/random/philox.hpp"

namespace slew {

double RandomStream::uniform(std::uint64_t counter) const {
  const auto words = philox_4x32_10(
      {static_cast<std::uint32_t>(counter), static_cast<std::uint32_t>(counter >> 32), use_, index_},
      {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)});
  const std::uint64_t bits = std::uint64_t{words[1]} << 32 | words[0];
  return (static_cast<double>(bits >> 12) + 0.5) * 0x1p-52;
}

double RandomStream::normal(std::uint64_t counter) const {
  return inverse_normal(uniform(counter));
}

}  // namespace slew
