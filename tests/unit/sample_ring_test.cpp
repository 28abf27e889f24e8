// The ring between a pacer and the publisher: nothing torn, nothing twice, every loss counted.
#include "server/service/sample_ring.hpp"

#include <gtest/gtest.h>

#include <array>
#include <thread>

namespace {

using slew::service::SampleRing;

TEST(SampleRing, GivesRowsInOrder) {
  SampleRing ring(2, 1024);
  for (int i = 0; i < 5; ++i) ring.push(i, std::array{10.0 * i}, std::array{100.0 * i});
  std::array<double, 3> row{};
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(ring.pop(row));
    EXPECT_EQ(row, (std::array{1.0 * i, 10.0 * i, 100.0 * i}));
  }
  EXPECT_FALSE(ring.pop(row));
}

TEST(SampleRing, FullDropsTheOldestAndCountsIt) {
  SampleRing ring(1, 0);  // the smallest: 16 rows
  ASSERT_EQ(ring.capacity(), 16u);
  for (int i = 0; i < 20; ++i) ring.push(i, std::array{0.0}, {});
  EXPECT_EQ(ring.dropped(), 4u);
  EXPECT_EQ(ring.size(), 16u);
  std::array<double, 2> row{};
  ASSERT_TRUE(ring.pop(row));
  EXPECT_EQ(row[0], 4);
}

// A producer that never waits against a consumer that comes and goes.
TEST(SampleRing, NothingIsTornBetweenThreads) {
  SampleRing ring(3, 4096);
  constexpr int kRows = 300000;
  std::thread producer([&] {
    for (int i = 0; i < kRows; ++i) {
      const double value = i;
      ring.push(value, std::array{value, value}, std::array{value});
    }
  });
  std::array<double, 4> row{};
  double last = -1;
  std::uint64_t taken = 0;
  while (last < kRows - 1) {
    if (!ring.pop(row)) continue;
    ++taken;
    ASSERT_GT(row[0], last);
    last = row[0];
    for (const double value : row) ASSERT_EQ(value, row[0]);
  }
  producer.join();
  EXPECT_EQ(taken + ring.dropped(), static_cast<std::uint64_t>(kRows));
}

}  // namespace
