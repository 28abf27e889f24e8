// The vectors published with Philox (Random123's kat_vectors), quantiles to 17 digits, and what random
// numbers are expected to be like.
#include "server/random/random_stream.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/random/inverse_normal.hpp"
#include "server/random/philox.hpp"

namespace {

using namespace slew;

TEST(Philox, GivesThePublishedVectors) {
  EXPECT_EQ(philox_4x32_10({0, 0, 0, 0}, {0, 0}),
            (PhiloxCounter{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  constexpr std::uint32_t kAll = 0xffffffff;
  EXPECT_EQ(philox_4x32_10({kAll, kAll, kAll, kAll}, {kAll, kAll}),
            (PhiloxCounter{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox_4x32_10({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (PhiloxCounter{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(InverseNormal, GivesKnownQuantiles) {
  const std::vector<std::pair<double, double>> quantiles = {
      {0.75, 0.674489750196081743},    {0.9, 1.28155156554460060},    {0.925, 1.43953147093845623},
      {0.975, 1.95996398454005386},    {1e-3, -3.09023230616781354},  {1e-10, -6.36134090240405620},
      {1.3e-11, -6.66761145651074083}, {1e-11, -6.70602315549513630}, {0x1p-53, -8.20953615160138686},
  };
  for (const auto& [probability, x] : quantiles)
    EXPECT_NEAR(inverse_normal(probability), x, 1e-15 * std::max(1.0, std::abs(x))) << probability;
  EXPECT_EQ(inverse_normal(0.5), 0);
  for (const double p : {0.25, 0.0625, 0x1p-20, 0x1p-52})
    EXPECT_EQ(inverse_normal(1 - p), -inverse_normal(p));
}

// The parts meet: at |q| = 0.425 and at exp(-25).
TEST(InverseNormal, IsContinuousAndRises) {
  for (const double edge : {0.075, 0.925, std::exp(-25)}) {
    const double below = inverse_normal(edge * (1 - 1e-14)), above = inverse_normal(edge * (1 + 1e-14));
    EXPECT_NEAR(below, above, 1e-12);
  }
  double last = -9;
  for (double p = 0x1p-53; p < 1; p = p < 1e-3 ? 1.1 * p : p + 1e-3) {
    const double x = inverse_normal(p);
    EXPECT_GT(x, last) << p;
    last = x;
  }
}

TEST(RandomStream, IsTheSameOnEveryMachine) {
  const RandomStream stream(1, RandomUse::rate_noise, 2);
  const auto words = philox_4x32_10({7, 0, 3, 2}, {1, 0});
  const double expected =
      (static_cast<double>((std::uint64_t{words[1]} << 32 | words[0]) >> 12) + 0.5) / 4503599627370496.0;
  EXPECT_EQ(stream.uniform(7), expected);
  EXPECT_EQ(stream.normal(7), inverse_normal(expected));
  EXPECT_EQ(RandomStream(1, RandomUse::rate_noise, 2).normal(7), stream.normal(7));
}

TEST(RandomStream, StaysBetweenZeroAndOne) {
  EXPECT_GT(0.5 * 0x1p-52, 0);
  EXPECT_LT((0x1p52 - 0.5) * 0x1p-52, 1);
  const RandomStream stream(9, RandomUse::angle_noise, 0);
  double least = 1, most = 0;
  for (std::uint64_t i = 0; i < 100000; ++i) {
    const double u = stream.uniform(i);
    least = std::min(least, u), most = std::max(most, u);
  }
  EXPECT_GT(least, 0);
  EXPECT_LT(least, 1e-4);
  EXPECT_LT(most, 1);
  EXPECT_GT(most, 1 - 1e-4);
}

TEST(RandomStream, HasTheMomentsOfTheNormalDistribution) {
  constexpr int kCount = 400000;
  const RandomStream stream(20, RandomUse::thruster_noise, 5);
  double moments[5] = {};
  for (std::uint64_t i = 0; i < kCount; ++i) {
    const double x = stream.normal(i);
    double power = 1;
    for (int n = 1; n <= 4; ++n) moments[n] += power *= x;
  }
  // Within five standard deviations of the mean of kCount numbers.
  const double five = 5 / std::sqrt(double{kCount});
  EXPECT_NEAR(moments[1] / kCount, 0, five);
  EXPECT_NEAR(moments[2] / kCount, 1, five * std::sqrt(2));
  EXPECT_NEAR(moments[3] / kCount, 0, five * std::sqrt(15));
  EXPECT_NEAR(moments[4] / kCount, 3, five * std::sqrt(96));
}

TEST(RandomStream, FillsEqualPartsEqually) {
  constexpr int kCount = 256000, kParts = 256;
  const RandomStream stream(3, RandomUse::misalignment, 0);
  std::vector<double> counts(kParts);
  for (std::uint64_t i = 0; i < kCount; ++i) ++counts[static_cast<int>(stream.uniform(i) * kParts)];
  double chi_square = 0;
  for (const double count : counts) chi_square += (count - 1000) * (count - 1000) / 1000;
  EXPECT_NEAR(chi_square, kParts - 1, 5 * std::sqrt(2.0 * (kParts - 1)));
}

// Seed, use, index and the counter's upper half each make another stream, which knows nothing of the first,
// nor of its neighbour in time.
TEST(RandomStream, StreamsAreIndependent) {
  constexpr int kCount = 100000;
  const RandomStream stream(1, RandomUse::thruster_noise, 0);
  const auto correlation = [&](const RandomStream& other, std::uint64_t shift) {
    double sum = 0;
    for (std::uint64_t i = 0; i < kCount; ++i) sum += stream.normal(i) * other.normal(i + shift);
    return sum / kCount;
  };
  const double five = 5 / std::sqrt(double{kCount});
  EXPECT_NEAR(correlation({2, RandomUse::thruster_noise, 0}, 0), 0, five);
  EXPECT_NEAR(correlation({1 + (std::uint64_t{1} << 32), RandomUse::thruster_noise, 0}, 0), 0, five);
  EXPECT_NEAR(correlation({1, RandomUse::misalignment, 0}, 0), 0, five);
  EXPECT_NEAR(correlation({1, RandomUse::thruster_noise, 1}, 0), 0, five);
  EXPECT_NEAR(correlation(stream, std::uint64_t{1} << 32), 0, five);
  EXPECT_NEAR(correlation(stream, 1), 0, five);
  EXPECT_NEAR(correlation(stream, 0), 1, five * std::sqrt(2));
}

}  // namespace
