// Dormand & Prince's explicit Runge-Kutta method of order 5(4) with its continuous extension of order 4
// (Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, sections II.5 and II.6). Its size is
// fixed at compile time: no allocation.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace slew {

template <std::size_t kMost>
class DormandPrince {
 public:
  using State = std::array<double, kMost>;

  /// The first `size` components move.
  explicit DormandPrince(std::size_t size) : size_(size) {}

  /// A new start: `slope(t, x, dx)` is evaluated there.
  template <typename Slope>
  void begin(const Slope& slope, double t, const State& x) {
    std::copy_n(x.begin(), size_, x0_.begin());
    slope(t, x0_, k_[0]);
  }
  /// Goes on from the end of the last attempt, with the slope found there.
  void go_on() {
    std::copy_n(x1_.begin(), size_, x0_.begin());
    std::copy_n(k_[6].begin(), size_, k_[0].begin());
  }

  /// A step of length h from the start; may be tried again with another h.
  template <typename Slope>
  void attempt(const Slope& slope, double t, double h) {
    h_ = h;
    stage(slope, t, 1, 1.0 / 5, {1.0 / 5});
    stage(slope, t, 2, 3.0 / 10, {3.0 / 40, 9.0 / 40});
    stage(slope, t, 3, 4.0 / 5, {44.0 / 45, -56.0 / 15, 32.0 / 9});
    stage(slope, t, 4, 8.0 / 9, {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729});
    stage(slope, t, 5, 1, {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656});
    stage(slope, t, 6, 1, {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84});
    is_extended_ = false;
  }

  /// Ends the last attempt a little later or earlier, along the slope there: out by (by / length)^2 of what a
  /// step changes.
  void move_end(double by) {
    for (std::size_t i = 0; i < size_; ++i) x1_[i] += by * k_[6][i];
    h_ += by;
    is_extended_ = false;
  }

  /// Of the last attempt: root mean square of the error's estimate over `relative` |x| + absolute[i]. At most
  /// 1 is good enough.
  double error(double relative, const State& absolute) const {
    double sum = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      const double e = h_ * (71.0 / 57600 * k_[0][i] - 71.0 / 16695 * k_[2][i] + 71.0 / 1920 * k_[3][i] -
                             17253.0 / 339200 * k_[4][i] + 22.0 / 525 * k_[5][i] - 1.0 / 40 * k_[6][i]);
      const double scaled = e / (absolute[i] + relative * std::max(std::abs(x0_[i]), std::abs(x1_[i])));
      sum += scaled * scaled;
    }
    return std::sqrt(sum / static_cast<double>(size_));
  }

  /// How much longer the next step may be. Square roots only: they are the same on every processor.
  static double growth(double error) {
    constexpr double kSafety = 0.9, kLeast = 0.1, kMostGrowth = 5;
    if (!(error > 1e-4)) return kMostGrowth;
    return std::clamp(kSafety / std::sqrt(std::sqrt(error)), kLeast, kMostGrowth);
  }

  std::size_t size() const { return size_; }
  double length() const { return h_; }
  const State& start() const { return x0_; }
  const State& end() const { return x1_; }
  const State& first_slope() const { return k_[0]; }
  const State& last_slope() const { return k_[6]; }

  /// The continuous extension at start + x h, of the components [from, to).
  void at(double x, std::size_t from, std::size_t to, double* state) {
    if (!is_extended_) extend();
    const double y = 1 - x;
    for (std::size_t i = from; i < to; ++i)
      state[i - from] = x0_[i] + x * (d_[0][i] + y * (d_[1][i] + x * (d_[2][i] + y * d_[3][i])));
  }

 private:
  template <typename Slope, std::size_t n>
  void stage(const Slope& slope, double t, std::size_t to, double c, const double (&a)[n]) {
    for (std::size_t i = 0; i < size_; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < n; ++j) sum += a[j] * k_[j][i];
      x1_[i] = x0_[i] + h_ * sum;
    }
    slope(t + c * h_, x1_, k_[to]);
  }

  void extend() {
    for (std::size_t i = 0; i < size_; ++i) {
      const double change = x1_[i] - x0_[i];
      d_[0][i] = change;
      d_[1][i] = h_ * k_[0][i] - change;
      d_[2][i] = change - h_ * k_[6][i] - d_[1][i];
      d_[3][i] = h_ * (-12715105075.0 / 11282082432 * k_[0][i] + 87487479700.0 / 32700410799 * k_[2][i] -
                       10690763975.0 / 1880347072 * k_[3][i] + 701980252875.0 / 199316789632 * k_[4][i] -
                       1453857185.0 / 822651844 * k_[5][i] + 69997945.0 / 29380423 * k_[6][i]);
    }
    is_extended_ = true;
  }

  std::size_t size_;
  double h_ = 0;
  bool is_extended_ = false;
  State x0_{}, x1_{};
  std::array<State, 7> k_{};
  std::array<State, 4> d_{};
};

}  // namespace slew
