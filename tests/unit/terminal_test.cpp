// What people see: columns that line up, exit codes that tell.
#include "client/slewctl/terminal.hpp"

#include <gtest/gtest.h>

#include "client/slewctl/exit_code.hpp"

namespace {

using namespace slew::ctl;

TEST(Terminal, TablesLineUp) {
  EXPECT_EQ(table({{"name", "value", "unit"}, {"a", "1.5", "s"}, {"long name", "12", ""}}),
            "name       value  unit\n"
            "a            1.5  s\n"
            "long name     12\n");
  EXPECT_EQ(table({{"π", "x"}, {"ab", "y"}}), "π   x\nab  y\n");
}

TEST(Terminal, BarsFill) {
  EXPECT_EQ(bar(0, 4), "[····]");
  EXPECT_EQ(bar(0.5, 4), "[██··]");
  EXPECT_EQ(bar(2, 4), "[████]");
}

TEST(ExitCodes, AreTheContract) {
  EXPECT_EQ(exit_code(slew_v1_COMPLETED, "ok"), 0);
  EXPECT_EQ(exit_code(slew_v1_FAILED, "diverged"), 1);
  EXPECT_EQ(exit_code(slew_v1_REJECTED, "invalid"), 2);
  EXPECT_EQ(exit_code(slew_v1_REJECTED, "conflict"), 2);
  EXPECT_EQ(exit_code(slew_v1_CANCELLED, "cancelled"), 5);
  EXPECT_EQ(exit_code(slew_v1_INTERRUPTED, "interrupted"), 6);
  EXPECT_EQ(exit_code(slew_v1_REJECTED, "busy"), 7);
}

}  // namespace
