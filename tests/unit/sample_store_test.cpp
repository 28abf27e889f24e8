// What experiments record together is bounded, and what one gives back another may take.
#include "server/service/sample_store.hpp"

#include <gtest/gtest.h>

namespace {

using namespace slew::service;

std::size_t fill(SampleStore& store) {
  const double row[] = {1, 2};
  try {
    while (store.rows() < 100000) store.push(0, row, {});
  } catch (const SampleBudgetSpent&) {
  }
  return store.rows();
}

TEST(SampleStore, StopsWhereTheBudgetIsSpent) {
  SampleBudget budget(std::size_t{64} << 10);
  SampleStore first(2, &budget);
  const std::size_t rows = fill(first);
  EXPECT_EQ(rows, 2560u);  // of 24 bytes, in chunks of 256
  EXPECT_EQ(first.column(1), std::vector<double>(rows, 1.0));
  SampleStore second(2, &budget);
  EXPECT_EQ(fill(second), 0u);
  first.clear();
  EXPECT_EQ(fill(second), 2560u);
}

TEST(SampleStore, GivesBackWhatItTook) {
  SampleBudget budget(std::size_t{64} << 10);
  for (int i = 0; i < 100; ++i) {
    SampleStore store(2, &budget);
    EXPECT_EQ(fill(store), 2560u);
  }
}

}  // namespace
