// An instant that the server chose is on the shared grid; one that was ordered is where it was ordered.
#include "server/service/wakeup_grid.hpp"

#include <gtest/gtest.h>

#include <optional>

#include "server/service/flight.hpp"
#include "tests/unit/prepared.hpp"

namespace {

using namespace slew;
using namespace slew::service;
using namespace std::chrono_literals;

bool is_on_grid(Monotonic::time_point time) {
  return time.time_since_epoch() % WakeupGrid(1) == 0ns;
}

TEST(WakeupGrid, TakesTheNextPoint) {
  const Monotonic::time_point point(WakeupGrid(4001));
  EXPECT_EQ(on_wakeup_grid(point), point);
  EXPECT_EQ(on_wakeup_grid(point + 1ns), point + WakeupGrid(1));
  EXPECT_EQ(on_wakeup_grid(point - 1ns), point);
}

Wishes pause(bool on, std::optional<std::int64_t> start_unix_ns = {}) {
  Wishes wishes;
  wishes.pause = on;
  wishes.start_unix_ns = start_unix_ns;
  return wishes;
}

Wishes rate(double value) {
  Wishes wishes;
  wishes.rate = value;
  return wishes;
}

class Anchored : public testing::Test {
 protected:
  Anchored()
      : flight(JournalEntry{}, test::prepared({{"preset", "agrawal-bang-1995/rigid-single-sided"},
                                               {"timing", {{"mode", "real_time"}, {"start", "held"}}}})) {
    EXPECT_EQ(flight.begin(), SliceEnd::goes_on);
    EXPECT_EQ(flight.follow_wishes(), SliceEnd::parked);
  }

  Flight::Anchor after(const Wishes& wishes) {
    flight.wish(wishes);
    flight.follow_wishes();
    return flight.anchor();
  }

  Flight flight;
};

// Each shares the grid, and takes up the simulated time where it was left.
TEST_F(Anchored, ResumeAndRateAreOnTheGrid) {
  const auto before = Monotonic::now();
  const Flight::Anchor begun = after(pause(false));
  EXPECT_TRUE(is_on_grid(begun.wall));
  EXPECT_GE(begun.wall, before);
  EXPECT_EQ(begun.sim_s, 0);

  flight.fly(1.25, Monotonic::time_point::max());
  const Flight::Anchor faster = after(rate(2));
  EXPECT_NE(faster.version, begun.version);
  EXPECT_TRUE(is_on_grid(faster.wall));
  EXPECT_EQ(faster.sim_s, 1.25);
  EXPECT_EQ(faster.rate, 2);

  flight.fly(1.5, Monotonic::time_point::max());
  EXPECT_EQ(after(pause(true)).version, faster.version);
  const Flight::Anchor resumed = after(pause(false));
  EXPECT_NE(resumed.version, faster.version);
  EXPECT_TRUE(is_on_grid(resumed.wall));
  EXPECT_EQ(resumed.sim_s, 1.5);
}

// It lies in the past by the time that it is told.
TEST_F(Anchored, AnOrderedStartIsKept) {
  const std::int64_t ordered_unix_ns = unix_ns() - 123'456'789;
  const Flight::Anchor anchor = after(pause(false, ordered_unix_ns));
  EXPECT_LE(anchor.wall, Monotonic::now() - 123'456'789ns);
}

// One that is told too late begins now.
TEST_F(Anchored, AStartLongPastIsOnTheGrid) {
  const auto before = Monotonic::now();
  const Flight::Anchor anchor = after(pause(false, unix_ns() - 5'000'000'000));
  EXPECT_TRUE(is_on_grid(anchor.wall));
  EXPECT_GE(anchor.wall, before);
}

}  // namespace
