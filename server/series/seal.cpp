#include "server/series/seal.hpp"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <memory>

namespace slew {
namespace {

constexpr std::array<char, 8> kName{'S', 'L', 'E', 'W', 'S', 'E', 'A', 'L'};
constexpr std::size_t kSeal = kName.size() + sizeof(XXH128_canonical_t);

using State = std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)>;

State begun() {
  State state(XXH3_createState(), XXH3_freeState);
  XXH3_128bits_reset(state.get());
  return state;
}

std::array<char, kSeal> seal_of(const State& state) {
  XXH128_canonical_t hash;
  XXH128_canonicalFromHash(&hash, XXH3_128bits_digest(state.get()));
  std::array<char, kSeal> seal;
  std::copy(kName.begin(), kName.end(), seal.begin());
  std::memcpy(seal.data() + kName.size(), &hash, sizeof hash);
  return seal;
}

}  // namespace

void seal(std::vector<char>& bytes) {
  const State state = begun();
  XXH3_128bits_update(state.get(), bytes.data(), bytes.size());
  const auto seal = seal_of(state);
  bytes.insert(bytes.end(), seal.begin(), seal.end());
}

bool is_sealed(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  const auto size = static_cast<std::streamoff>(stream.tellg());
  if (!stream || size < static_cast<std::streamoff>(kSeal)) return false;
  stream.seekg(0);
  const State state = begun();
  std::vector<char> piece(std::size_t{1} << 16);
  for (auto left = static_cast<std::size_t>(size) - kSeal; left > 0;) {
    const std::size_t count = std::min(left, piece.size());
    if (!stream.read(piece.data(), static_cast<std::streamsize>(count))) return false;
    XXH3_128bits_update(state.get(), piece.data(), count);
    left -= count;
  }
  std::array<char, kSeal> found;
  return stream.read(found.data(), kSeal) && found == seal_of(state);
}

}  // namespace slew
