// The samples of one experiment, kept until they are archived. Grows in chunks, so that no sample waits for
// what came before it to be copied.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <new>
#include <span>
#include <utility>
#include <vector>

namespace slew::service {

/// Thrown where a sample finds no room.
class SampleBudgetSpent : public std::bad_alloc {
 public:
  const char* what() const noexcept override {
    return "the samples of experiments that are not archived yet take all the memory that they may; record "
           "less (telemetry.sample_period_s), try later, or give slewd more (--sample-memory)";
  }
};

/// What the stores of all experiments may take together. Safe to use from several threads.
class SampleBudget {
 public:
  explicit SampleBudget(std::size_t bytes) : left_(static_cast<std::ptrdiff_t>(bytes)) {}
  /// False when so much is not left.
  bool charge(std::size_t bytes) {
    const auto wanted = static_cast<std::ptrdiff_t>(bytes);
    if (left_.fetch_sub(wanted, std::memory_order_relaxed) >= wanted) return true;
    give_back(bytes);
    return false;
  }
  void give_back(std::size_t bytes) {
    left_.fetch_add(static_cast<std::ptrdiff_t>(bytes), std::memory_order_relaxed);
  }

 private:
  std::atomic<std::ptrdiff_t> left_;
};

class SampleStore {
 public:
  /// The budget, if there is one, must outlive the store.
  explicit SampleStore(std::size_t width, SampleBudget* budget = nullptr)
      : stride_(width + 1), budget_(budget) {}
  SampleStore(SampleStore&& other) noexcept
      : stride_(other.stride_),
        budget_(other.budget_),
        rows_(std::exchange(other.rows_, 0)),
        chunks_(std::move(other.chunks_)) {}
  SampleStore(const SampleStore&) = delete;
  SampleStore& operator=(const SampleStore&) = delete;
  ~SampleStore() { clear(); }

  /// Throws SampleBudgetSpent, or std::bad_alloc; then the sample is not in the store.
  void push(double t_s, std::span<const double> first, std::span<const double> second) {
    if (rows_ == chunks_.size() * kRowsPerChunk) add_chunk();
    double* slot = chunks_.back().get() + (rows_ % kRowsPerChunk) * stride_;
    *slot++ = t_s;
    for (const double value : first) *slot++ = value;
    for (const double value : second) *slot++ = value;
    ++rows_;
  }

  std::size_t rows() const { return rows_; }
  std::size_t columns() const { return stride_; }

  /// One column as it stands: 0 is the time.
  std::vector<double> column(std::size_t index) const {
    std::vector<double> values(rows_);
    for (std::size_t row = 0; row < rows_; ++row)
      values[row] = chunks_[row / kRowsPerChunk][(row % kRowsPerChunk) * stride_ + index];
    return values;
  }

  void clear() {
    if (budget_) budget_->give_back(chunks_.size() * chunk_bytes());
    chunks_.clear();
    chunks_.shrink_to_fit();
    rows_ = 0;
  }

 private:
  static constexpr std::size_t kRowsPerChunk = 256;

  std::size_t chunk_bytes() const { return kRowsPerChunk * stride_ * sizeof(double); }
  void add_chunk() {
    if (budget_ && !budget_->charge(chunk_bytes())) throw SampleBudgetSpent();
    try {
      chunks_.push_back(std::make_unique<double[]>(kRowsPerChunk * stride_));
    } catch (...) {
      if (budget_) budget_->give_back(chunk_bytes());
      throw;
    }
  }

  std::size_t stride_;
  SampleBudget* budget_;
  std::size_t rows_ = 0;
  std::vector<std::unique_ptr<double[]>> chunks_;
};

}  // namespace slew::service
