// A first-order lag T f' = input - f through a step, where the input is a quartic through five places: a
// power series, whose coefficients follow from each other.
#pragma once

#include <array>
#include <cstddef>

namespace slew {

class LaggedInput {
 public:
  /// The longest step over T for which the series is exact to rounding.
  static constexpr double kLongest = 0.5;

  /// The quartic in x of [0, 1] through the values at 0, 1/4, 1/2, 3/4, 1, from its constant term up.
  static std::array<double, 5> quartic(const std::array<double, 5>& v) {
    return {v[0], (-25 * v[0] + 48 * v[1] - 36 * v[2] + 16 * v[3] - 3 * v[4]) / 3,
            (70 * v[0] - 208 * v[1] + 228 * v[2] - 112 * v[3] + 22 * v[4]) / 3,
            16 * (-5 * v[0] + 18 * v[1] - 24 * v[2] + 14 * v[3] - 3 * v[4]) / 3,
            32 * (v[0] - 4 * v[1] + 6 * v[2] - 4 * v[3] + v[4]) / 3};
  }

  /// From f at the beginning, over a step of `length` of T; `input` as quartic() gives it.
  void begin(double f, const std::array<double, 5>& input, double length) {
    c_[0] = f;
    for (std::size_t k = 0; k + 1 < c_.size(); ++k)
      c_[k + 1] = ((k < input.size() ? input[k] : 0) - c_[k]) * length / static_cast<double>(k + 1);
  }

  double at(double x) const {
    double sum = 0;
    for (std::size_t k = c_.size(); k-- > 0;) sum = sum * x + c_[k];
    return sum;
  }
  /// df/dx.
  double slope(double x) const {
    double sum = 0;
    for (std::size_t k = c_.size() - 1; k > 0; --k) sum = sum * x + static_cast<double>(k) * c_[k];
    return sum;
  }

 private:
  std::array<double, 15> c_{};
};

}  // namespace slew
