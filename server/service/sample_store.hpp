// The samples of one experiment, kept until they are archived. Grows in chunks, so that no sample waits for
// what came before it to be copied.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace slew::service {

class SampleStore {
 public:
  explicit SampleStore(std::size_t width) : stride_(width + 1) {}

  void push(double t_s, std::span<const double> first, std::span<const double> second) {
    if (rows_ % kRowsPerChunk == 0) chunks_.push_back(std::make_unique<double[]>(kRowsPerChunk * stride_));
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
    chunks_.clear();
    chunks_.shrink_to_fit();
    rows_ = 0;
  }

 private:
  static constexpr std::size_t kRowsPerChunk = 256;
  std::size_t stride_;
  std::size_t rows_ = 0;
  std::vector<std::unique_ptr<double[]>> chunks_;
};

}  // namespace slew::service
