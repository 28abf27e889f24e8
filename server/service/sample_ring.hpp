// Samples on their way from the thread that flies an experiment to the one that publishes it: one producer,
// one consumer, no locks, no waiting, bounded.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace slew::service {

/// A row is one time and `width` values. When the ring is full the oldest row gives way and is counted.
class SampleRing {
 public:
  /// Room for as many rows as fit into `bytes`, at least 16; a power of two.
  SampleRing(std::size_t width, std::size_t bytes)
      : stride_(width + 1),
        capacity_(std::bit_floor(std::max<std::size_t>(16, bytes / (stride_ * sizeof(double))))),
        slots_(capacity_ * stride_) {}

  std::size_t width() const { return stride_ - 1; }
  std::size_t capacity() const { return capacity_; }
  std::size_t size() const {
    return static_cast<std::size_t>(head_.load(std::memory_order_acquire) -
                                    tail_.load(std::memory_order_acquire));
  }
  std::size_t free() const { return capacity_ - std::min(capacity_, size()); }
  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

  /// Producer only. The spans together are `width()` long.
  void push(double t_s, std::span<const double> first, std::span<const double> second) {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    std::uint64_t tail = tail_.load(std::memory_order_acquire);
    // The consumer claims rows by the same exchange, so a row is either dropped or taken, never both.
    while (head - tail == capacity_) {
      if (tail_.compare_exchange_weak(tail, tail + 1, std::memory_order_acq_rel)) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        break;
      }
    }
    store(head, 0, t_s);
    std::size_t column = 1;
    for (const double value : first) store(head, column++, value);
    for (const double value : second) store(head, column++, value);
    head_.store(head + 1, std::memory_order_release);
  }

  /// Consumer only: the oldest row into `row` (t first, then the values); false when there is none.
  bool pop(std::span<double> row) {
    std::uint64_t tail = tail_.load(std::memory_order_acquire);
    while (tail != head_.load(std::memory_order_acquire)) {
      for (std::size_t column = 0; column < stride_; ++column) row[column] = load(tail, column);
      // When the producer took this row away meanwhile, what was read is not used.
      if (tail_.compare_exchange_weak(tail, tail + 1, std::memory_order_acq_rel)) return true;
    }
    return false;
  }

 private:
  // Relaxed atomics: the producer may overwrite a row that the consumer is about to find taken away.
  void store(std::uint64_t row, std::size_t column, double value) {
    std::atomic_ref<double>(slots_[(row & (capacity_ - 1)) * stride_ + column])
        .store(value, std::memory_order_relaxed);
  }
  double load(std::uint64_t row, std::size_t column) {
    return std::atomic_ref<double>(slots_[(row & (capacity_ - 1)) * stride_ + column])
        .load(std::memory_order_relaxed);
  }

  const std::size_t stride_;
  const std::size_t capacity_;
  std::vector<double> slots_;
  std::atomic<std::uint64_t> head_{0};
  std::atomic<std::uint64_t> tail_{0};
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace slew::service
