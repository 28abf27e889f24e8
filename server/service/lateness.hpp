// How late the slices of paced work were: a histogram with bins 1/8 of an octave wide, from 1 us to 17 min.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstdint>

namespace slew::service {

/// Written by one thread, read by any.
class Lateness {
 public:
  void record(double seconds) {
    const double us = seconds * 1e6;
    bins_[bin(us)].fetch_add(1, std::memory_order_relaxed);
    count_.fetch_add(1, std::memory_order_relaxed);
    sum_s_.fetch_add(seconds, std::memory_order_relaxed);
    if (seconds > max_s_.load(std::memory_order_relaxed)) max_s_.store(seconds, std::memory_order_relaxed);
  }

  std::uint64_t count() const { return count_.load(std::memory_order_relaxed); }
  double sum_s() const { return sum_s_.load(std::memory_order_relaxed); }
  double max_s() const { return max_s_.load(std::memory_order_relaxed); }

  /// The upper edge of the bin that holds this quantile (0 to 1), at most max_s(); 0 when nothing was
  /// recorded.
  double quantile_s(double fraction) const {
    const std::uint64_t total = count();
    if (total == 0) return 0;
    const auto rank = static_cast<std::uint64_t>(fraction * static_cast<double>(total - 1)) + 1;
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < kBins; ++i) {
      below += bins_[i].load(std::memory_order_relaxed);
      if (below >= rank) return i + 1 < kBins ? std::min(upper_edge_us(i) * 1e-6, max_s()) : max_s();
    }
    return max_s();
  }

  /// Calls `each(upper edge in s, count)` for every bin that is not empty.
  template <typename Function>
  void each_bin(Function&& each) const {
    for (std::size_t i = 0; i < kBins; ++i)
      if (const std::uint64_t count = bins_[i].load(std::memory_order_relaxed); count > 0)
        each(upper_edge_us(i) * 1e-6, count);
  }

 private:
  static constexpr std::size_t kPerOctave = 8;
  static constexpr std::size_t kBins = 30 * kPerOctave + 1;

  // Bin 0 holds everything below 1 us; within an octave the bins are equally wide.
  static std::size_t bin(double us) {
    if (!(us >= 1)) return 0;
    const auto scaled = us * kPerOctave < 9e18 ? static_cast<std::uint64_t>(us * kPerOctave) : UINT64_MAX;
    const auto octave = static_cast<std::size_t>(std::bit_width(scaled)) - 4;
    const auto within = static_cast<std::size_t>(scaled >> octave) - kPerOctave;
    const std::size_t index = 1 + octave * kPerOctave + within;
    return index < kBins ? index : kBins - 1;
  }
  static double upper_edge_us(std::size_t index) {
    if (index == 0) return 1;
    const std::size_t octave = (index - 1) / kPerOctave;
    const std::size_t within = (index - 1) % kPerOctave;
    return static_cast<double>(std::uint64_t{kPerOctave + within + 1} << octave) / kPerOctave;
  }

  std::array<std::atomic<std::uint32_t>, kBins> bins_{};
  std::atomic<std::uint64_t> count_{0};
  std::atomic<double> sum_s_{0};
  std::atomic<double> max_s_{0};
};

}  // namespace slew::service
