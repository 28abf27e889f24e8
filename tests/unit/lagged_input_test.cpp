// T f' = input - f: for an input that is a polynomial, f is known.
#include "server/propagation/lagged_input.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace slew {
namespace {

TEST(LaggedInput, takes_a_quartic_apart) {
  const auto polynomial = [](double x) { return 2 - x + 3 * x * x - 0.5 * x * x * x + 7 * x * x * x * x; };
  const auto c = LaggedInput::quartic(
      {polynomial(0), polynomial(0.25), polynomial(0.5), polynomial(0.75), polynomial(1)});
  const std::array<double, 5> expected{2, -1, 3, -0.5, 7};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(c[i], expected[i], 1e-13);
}

TEST(LaggedInput, decays_to_what_is_held) {
  LaggedInput lag;
  for (const double length : {1e-6, 0.01, 0.3, LaggedInput::kLongest}) {
    lag.begin(2, {-1, 0, 0, 0, 0}, length);
    for (const double x : {0.0, 0.3, 1.0}) {
      EXPECT_NEAR(lag.at(x), -1 + 3 * std::exp(-length * x), 1e-15);
      EXPECT_NEAR(lag.slope(x), -3 * length * std::exp(-length * x), 1e-15);
    }
  }
}

// With input f0 + T f' of f = x^3 the lag follows x^3 itself.
TEST(LaggedInput, follows_an_input_made_for_it) {
  const double length = 0.4;
  LaggedInput lag;
  lag.begin(0, {0, 0, 3 / length, 1, 0}, length);
  for (const double x : {0.1, 0.5, 1.0}) EXPECT_NEAR(lag.at(x), x * x * x, 1e-14);
}

}  // namespace
}  // namespace slew
