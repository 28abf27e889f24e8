// The black box: what was being flown when the process ended without a word is known to the next one.
#include "server/service/black_box.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/service/process.hpp"

namespace {

using namespace slew;
using service::BlackBox;

TEST(BlackBox, KnowsWhatWasFlownWhenTheServerWasKilled) {
  const test::TemporaryDirectory directory;
  const auto file = directory.path() / "under_way";
  const auto done = wire::Id::make(), flown = wire::Id::make();
  const pid_t pid = fork();
  if (pid == 0) {
    BlackBox box(file);
    const auto first = box.seat(), second = box.seat();
    first.take(done);
    second.take(flown);
    first.leave();
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  {
    const BlackBox next(file);
    EXPECT_EQ(next.suspects(), std::vector{flown});
  }
  EXPECT_TRUE(BlackBox(file).suspects().empty());
}

TEST(BlackBox, HasASeatForEverybody) {
  const test::TemporaryDirectory directory;
  BlackBox box(directory.path() / "under_way");
  for (int i = 0; i < 2000; ++i) box.seat().take(wire::Id::make());
}

TEST(BlackBox, ThatCannotBeWrittenSaysSo) {
  EXPECT_THROW(BlackBox("/proc/no/such"), std::runtime_error);
}

}  // namespace
