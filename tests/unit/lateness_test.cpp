// Quantiles of lateness within the width of a bin, an eighth of an octave.
#include "server/service/lateness.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace {

using slew::service::Lateness;

TEST(Lateness, QuantilesAreThoseOfTheSortedValues) {
  std::mt19937_64 random(1);
  std::lognormal_distribution<double> distribution(-9, 1.5);
  std::vector<double> values;
  Lateness lateness;
  for (int i = 0; i < 20000; ++i) {
    values.push_back(distribution(random));
    lateness.record(values.back());
  }
  std::sort(values.begin(), values.end());
  for (const double fraction : {0.01, 0.5, 0.9, 0.99, 0.999}) {
    const double exact = values[static_cast<std::size_t>(fraction * 19999)];
    EXPECT_GE(lateness.quantile_s(fraction), exact);
    EXPECT_LE(lateness.quantile_s(fraction), exact * 1.13 + 1e-6);
  }
  EXPECT_EQ(lateness.max_s(), values.back());
  EXPECT_EQ(lateness.count(), 20000u);
  std::uint64_t total = 0;
  lateness.each_bin([&](double, std::uint64_t count) { total += count; });
  EXPECT_EQ(total, 20000u);
}

TEST(Lateness, TakesExtremes) {
  Lateness lateness;
  EXPECT_EQ(lateness.quantile_s(0.5), 0);
  for (const double value : {0.0, -1.0, 1e-9, 1e6}) lateness.record(value);
  EXPECT_EQ(lateness.quantile_s(1), 1e6);
  EXPECT_LE(lateness.quantile_s(0), 1e-6);
}

}  // namespace
