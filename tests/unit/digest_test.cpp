// The digest sees the last bit.
#include "server/simulation/digest.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using namespace slew;

Digest of(double event_time_s, double state, int repeats = 300) {
  Digester digester;
  for (int i = 0; i < repeats; ++i) {
    digester.event({event_time_s, 0, -1});
    digester.real(state);
  }
  return digester.digest();
}

TEST(Digest, FlipsWithTheLastBitOfAnEventTime) {
  EXPECT_NE(of(1.5, 2), of(std::nextafter(1.5, 2), 2));
}
TEST(Digest, FlipsWithTheLastBitOfAState) {
  EXPECT_NE(of(1.5, 2), of(1.5, std::nextafter(2, 1)));
}
TEST(Digest, TellsPlusFromMinusZero) {
  EXPECT_NE(of(1.5, 0.0), of(1.5, -0.0));
}
TEST(Digest, CountsWhatItHashed) {
  EXPECT_EQ(of(1.5, 2, 7).hashed_bytes, 7u * 4 * 8);
}

TEST(Digest, CanBeAskedAlongTheWay) {
  Digester digester;
  digester.real(1);
  const auto early = digester.digest();
  const Digester copy(digester);
  digester.real(2);
  EXPECT_EQ(copy.digest(), early);
  EXPECT_NE(digester.digest(), early);
}

TEST(Digest, IsThirtyTwoDigits) {
  EXPECT_EQ(of(1, 2).hex().size(), 32u);
}

}  // namespace
