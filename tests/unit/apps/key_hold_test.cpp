#include "apps/softarm/key_hold.hpp"

#include <gtest/gtest.h>

#include "milliseconds.hpp"

namespace softarm {
namespace {

using test::kMs;

TEST(KeyHold, OneKeyLastsUntilARepeatWouldHaveCome) {
  KeyHold hold;
  EXPECT_FALSE(hold.held(0));
  hold.event(5 * kMs);
  EXPECT_TRUE(hold.held(5 * kMs));
  EXPECT_TRUE(hold.held(705 * kMs));
  EXPECT_FALSE(hold.held(805 * kMs));
}

TEST(KeyHold, RepeatsHoldAndTheirEndReleasesSooner) {
  KeyHold hold;
  hold.event(0);
  std::int64_t now_ns = 660 * kMs;
  for (; now_ns < 3000 * kMs; now_ns += 40 * kMs) {
    EXPECT_TRUE(hold.held(now_ns));
    hold.event(now_ns);
  }
  EXPECT_TRUE(hold.held(now_ns + 100 * kMs));
  EXPECT_FALSE(hold.held(now_ns + 300 * kMs));
  // Pressed again: the first repeat may again take long.
  hold.event(now_ns + 400 * kMs);
  EXPECT_TRUE(hold.held(now_ns + 1000 * kMs));
}

}  // namespace
}  // namespace softarm
