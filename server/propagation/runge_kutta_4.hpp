// The classical Runge-Kutta method of order 4, and Hermite's cubic between the ends of a step.
#pragma once

#include <array>
#include <cstddef>

namespace slew {

template <std::size_t kMost>
class RungeKutta4 {
 public:
  using State = std::array<double, kMost>;

  /// The first `size` components move.
  explicit RungeKutta4(std::size_t size) : size_(size) {}

  template <typename Slope>
  void begin(const Slope& slope, double t, const State& x) {
    for (std::size_t i = 0; i < size_; ++i) x0_[i] = x[i];
    slope(t, x0_, k1_);
  }
  const State& first_slope() const { return k1_; }

  template <typename Slope>
  void step(const Slope& slope, double t, double h) {
    State x, k2, k3, k4;
    h_ = h;
    for (std::size_t i = 0; i < size_; ++i) x[i] = x0_[i] + 0.5 * h * k1_[i];
    slope(t + 0.5 * h, x, k2);
    for (std::size_t i = 0; i < size_; ++i) x[i] = x0_[i] + 0.5 * h * k2[i];
    slope(t + 0.5 * h, x, k3);
    for (std::size_t i = 0; i < size_; ++i) x[i] = x0_[i] + h * k3[i];
    slope(t + h, x, k4);
    for (std::size_t i = 0; i < size_; ++i)
      x1_[i] = x0_[i] + h / 6 * (k1_[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
    is_extended_ = false;
  }

  double length() const { return h_; }
  const State& start() const { return x0_; }
  const State& end() const { return x1_; }

  /// At start + x h; the slope at the end is evaluated when it is first needed.
  template <typename Slope>
  void at(const Slope& slope, double t_end, double x, double* state) {
    if (!is_extended_) slope(t_end, x1_, last_slope_);
    is_extended_ = true;
    const double y = 1 - x;
    for (std::size_t i = 0; i < size_; ++i) {
      const double change = x1_[i] - x0_[i];
      const double a = h_ * k1_[i] - change, b = change - h_ * last_slope_[i];
      state[i] = x0_[i] + x * (change + y * (y * a + x * b));
    }
  }

 private:
  std::size_t size_;
  double h_ = 0;
  bool is_extended_ = false;
  State x0_{}, x1_{}, k1_{}, last_slope_{};
};

}  // namespace slew
