#include "server/control/polynomial.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace slew {

Polynomial product(std::span<const double> a, std::span<const double> b) {
  if (a.empty() || b.empty()) return {};
  Polynomial result(a.size() + b.size() - 1);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) result[i + j] += a[i] * b[j];
  return result;
}

Polynomial sum(std::span<const double> a, std::span<const double> b) {
  Polynomial result(std::max(a.size(), b.size()));
  std::copy(a.begin(), a.end(), result.end() - static_cast<std::ptrdiff_t>(a.size()));
  for (std::size_t i = 0; i < b.size(); ++i) result[result.size() - b.size() + i] += b[i];
  return result;
}

std::vector<std::complex<double>> roots(std::span<const double> polynomial) {
  while (!polynomial.empty() && polynomial.front() == 0) polynomial = polynomial.subspan(1);
  if (polynomial.size() > 3) throw std::invalid_argument("roots in closed form end at degree two");
  if (polynomial.size() < 2) return {};
  const double lead = polynomial[0];
  if (polynomial.size() == 2) return {-polynomial[1] / lead};
  const double half = 0.5 * polynomial[1] / lead, last = polynomial[2] / lead;
  const double discriminant = half * half - last;
  if (discriminant < 0) {
    const double imaginary = std::sqrt(-discriminant);
    return {{-half, imaginary}, {-half, -imaginary}};
  }
  // The sum of equal signs, then the other root from the product.
  const double first = -half - std::copysign(std::sqrt(discriminant), half);
  return {first, first == 0 ? 0 : last / first};
}

}  // namespace slew
