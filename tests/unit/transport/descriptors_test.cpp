// Too few file descriptors, and too many inherited ones: the error is about them.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

/// Ends this process; its standard error is what the caller compares.
[[noreturn]] void start_node() {
  try {
    LcmNode node("udpm://239.255.76.67:" + std::to_string(20000 + getpid() % 12000) + "?ttl=0");
    node.subscribe("CHANNEL", 1, [](const ReceivedMessage&) {});
    std::fprintf(stderr, "started");
  } catch (const TransportError& error) {
    std::fprintf(stderr, "%s", error.what());
  }
  std::_Exit(0);
}

[[noreturn]] void start_with_limit(rlim_t limit) {
  const rlimit few{limit, limit};
  setrlimit(RLIMIT_NOFILE, &few);
  start_node();
}

[[noreturn]] void start_after_inheriting(int descriptors) {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  while (open("/dev/null", O_RDONLY) < descriptors) {
  }
  start_node();
}

TEST(Descriptors, WhereTheyAreLackingThatIsReported) {
  for (const rlim_t limit : {rlim_t{4}, rlim_t{10}, rlim_t{18}})
    EXPECT_EXIT(start_with_limit(limit), testing::ExitedWithCode(0), "file descriptors.*ulimit")
        << limit;
}

TEST(Descriptors, WhereLcmCannotUseThemThatIsReported) {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  if (limit.rlim_max < 1200) GTEST_SKIP() << "no more than " << limit.rlim_max << " descriptors";
  EXPECT_EXIT(start_after_inheriting(1100), testing::ExitedWithCode(0), "below 1024");
  EXPECT_EXIT(start_after_inheriting(1015), testing::ExitedWithCode(0), "below 1024");
}

}  // namespace
}  // namespace softarm
