// A number with its derivatives along kSize directions (forward differentiation), for what is written once as
// a template over the scalar.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace slew {

template <int kSize>
struct Dual {
  using Gradient = Eigen::Matrix<double, kSize, 1>;

  double value = 0;
  Gradient gradient = Gradient::Zero();

  Dual() = default;
  Dual(double constant) : value(constant) {}  // NOLINT: constants mix with duals as they do with doubles
  Dual(double given, const Gradient& slope) : value(given), gradient(slope) {}
  /// The variable number `direction`.
  static Dual variable(double given, int direction) { return {given, Gradient::Unit(direction)}; }

  Dual operator-() const { return {-value, -gradient}; }
  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }

  friend Dual operator+(const Dual& a, const Dual& b) { return {a.value + b.value, a.gradient + b.gradient}; }
  friend Dual operator-(const Dual& a, const Dual& b) { return {a.value - b.value, a.gradient - b.gradient}; }
  friend Dual operator*(const Dual& a, const Dual& b) {
    return {a.value * b.value, b.value * a.gradient + a.value * b.gradient};
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double ratio = a.value / b.value;
    return {ratio, (a.gradient - ratio * b.gradient) / b.value};
  }
  friend bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.value > b.value; }

  friend Dual sqrt(const Dual& a) {
    const double root = std::sqrt(a.value);
    return {root, a.gradient / (2 * root)};
  }
  friend Dual sin(const Dual& a) { return {std::sin(a.value), std::cos(a.value) * a.gradient}; }
  friend Dual cos(const Dual& a) { return {std::cos(a.value), -std::sin(a.value) * a.gradient}; }
  friend Dual atan(const Dual& a) { return {std::atan(a.value), a.gradient / (1 + a.value * a.value)}; }
  friend Dual atan2(const Dual& y, const Dual& x) {
    const double square = x.value * x.value + y.value * y.value;
    return {std::atan2(y.value, x.value), (x.value * y.gradient - y.value * x.gradient) / square};
  }
};

}  // namespace slew

template <int kSize>
struct Eigen::NumTraits<slew::Dual<kSize>> : Eigen::NumTraits<double> {
  using Real = slew::Dual<kSize>;
  using NonInteger = slew::Dual<kSize>;
  using Nested = slew::Dual<kSize>;
  enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 1 };
};
