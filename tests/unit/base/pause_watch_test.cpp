#include <gtest/gtest.h>

#include <thread>

#include "milliseconds.hpp"
#include "softarm/base/clock.hpp"
#include "suspended_clock.hpp"

namespace softarm {
namespace {

using test::kMs;

TEST(PauseWatch, ReportsASuspendOnce) {
#ifndef SOFTARM_SETS_CLOCK
  GTEST_SKIP() << "a sanitizer brings its own clock_gettime";
#endif
  PauseWatch watch;
  EXPECT_FALSE(watch.paused());
  for (const std::int64_t ns : {5 * kMs, 3'600'000 * kMs}) {
    test::suspended_ns += ns;
    EXPECT_TRUE(watch.paused());
    EXPECT_FALSE(watch.paused());
  }
  test::suspended_ns = 0;
  EXPECT_TRUE(watch.paused()) << "backwards too: one of the clocks is not what it should be";
}

TEST(PauseWatch, IsNotDeceivedByAThreadThatIsHeldUpBetweenItsReadings) {
  PauseWatch watch;
  std::atomic<bool> done = false;
  std::thread load([&] {
    while (!done) std::this_thread::yield();
  });
  for (int k = 0; k < 200'000; ++k) ASSERT_FALSE(watch.paused());
  done = true;
  load.join();
}

}  // namespace
}  // namespace softarm
