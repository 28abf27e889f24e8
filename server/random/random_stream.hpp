// Random numbers by their place in a stream (Philox4x32-10): what one use draws changes nothing for another,
// and the same seed gives the same bits in whatever order they are asked for.
#pragma once

#include <cstdint>

namespace slew {

/// What a stream is for. The numbers are part of the bits of a run: new uses go to the end.
enum class RandomUse : std::uint32_t {
  thruster_noise,
  misalignment,
  angle_noise,
  rate_noise,
  maneuver_start,
  elastic_noise,
  structure_sensor_noise
};

class RandomStream {
 public:
  /// `index` tells streams of one use apart: the thruster, the axis.
  RandomStream(std::uint64_t seed, RandomUse use, std::uint32_t index)
      : seed_(seed), use_(static_cast<std::uint32_t>(use)), index_(index) {}

  /// In (0, 1): the middles of 2^52 equal parts.
  double uniform(std::uint64_t counter) const;
  /// Of mean 0 and standard deviation 1; at most 8.21 in size.
  double normal(std::uint64_t counter) const;

 private:
  std::uint64_t seed_;
  std::uint32_t use_, index_;
};

}  // namespace slew
