// Real polynomials in s as they are printed: coefficients from the highest power down.
#pragma once

#include <complex>
#include <span>
#include <vector>

namespace slew {

using Polynomial = std::vector<double>;

Polynomial product(std::span<const double> a, std::span<const double> b);
Polynomial sum(std::span<const double> a, std::span<const double> b);

template <typename Scalar>
Scalar value_at(std::span<const double> polynomial, const Scalar& s) {
  Scalar value = 0;
  for (const double coefficient : polynomial) value = value * s + coefficient;
  return value;
}

/// Of degree two or less, without cancellation; leading zeros are passed over. Of a conjugate pair the upper
/// root comes first. Throws std::invalid_argument for a higher degree.
std::vector<std::complex<double>> roots(std::span<const double> polynomial);

}  // namespace slew
