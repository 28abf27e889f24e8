// No root is missed, and none is made up.
#include "server/propagation/quartic.hpp"

#include <gtest/gtest.h>

#include <random>

namespace slew {
namespace {

template <typename Function>
Quartic through(const Function& f) {
  return Quartic::through({f(0.0), f(0.25), f(0.5), f(0.75), f(1.0)});
}

TEST(Quartic, is_the_polynomial_through_its_points) {
  const auto f = [](double x) { return ((((3 * x - 2) * x + 1) * x - 5) * x) + 0.3; };
  const Quartic curve = through(f);
  for (double x = 0; x <= 1; x += 0.05) EXPECT_NEAR(curve.at(x), f(x), 1e-13);
  for (double x = 0; x <= 1; x += 0.05) EXPECT_NEAR(curve.reversed().at(x), f(1 - x), 1e-13);
  for (double x = 0; x <= 1; x += 0.05) EXPECT_NEAR(curve.shifted(-1, 2).at(x), 2 - f(x), 1e-13);
}

TEST(Quartic, finds_the_first_of_four_roots) {
  const auto f = [](double x) { return (x - 0.2) * (x - 0.21) * (x - 0.6) * (x - 0.61); };
  const auto x = through(f).shifted(-1, 0).first_positive();
  ASSERT_TRUE(x.has_value());
  EXPECT_NEAR(*x, 0.2, 1e-10);
  EXPECT_EQ(through(f).first_positive().value(), 0);
}

TEST(Quartic, an_excursion_of_a_thousandth_is_seen) {
  const auto f = [](double x) { return 1e-3 * 1e-3 - (x - 0.3713) * (x - 0.3713); };
  EXPECT_NEAR(through(f).first_positive().value(), 0.3703, 1e-9);
}

TEST(Quartic, what_stays_below_crosses_nowhere) {
  EXPECT_FALSE(through([](double x) { return -1e-9 - (x - 0.4) * (x - 0.4); }).first_positive().has_value());
  EXPECT_FALSE(through([](double) { return 0.0; }).first_positive().has_value());
}

TEST(Quartic, agrees_with_a_fine_grid_on_random_curves) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    const Quartic curve = Quartic::through({any(random), any(random), any(random), any(random), any(random)});
    std::optional<double> grid;
    for (int k = 0; k <= 4000 && !grid; ++k)
      if (curve.at(k / 4000.0) > 0) grid = k / 4000.0;
    const auto x = curve.first_positive();
    if (!grid) continue;  // what crosses between two points of the grid only is seen by the curve alone
    ASSERT_TRUE(x.has_value());
    EXPECT_LE(*x, *grid + 1e-12);
    if (*x > 0) {
      EXPECT_NEAR(curve.at(*x), 0, 1e-12);
    }
  }
}

}  // namespace
}  // namespace slew
