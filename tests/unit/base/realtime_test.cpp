// What the machine permits the tick's thread. Every case in a separate process, with which its
// limits and locked pages end.
#include "softarm/base/realtime.hpp"

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <functional>

namespace softarm {
namespace {

constexpr int kNotPermitted = 77;

/// Exit code of a child that does this.
int in_a_child(const std::function<int()>& body) {
  const pid_t child = fork();
  if (child == 0) _exit(body());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Page faults without input or output that writing to this much of the stack causes.
[[gnu::noinline]] long faults_of_deep_stack() {
  rusage before{}, after{};
  getrusage(RUSAGE_THREAD, &before);
  char pages[200 * 1024];
  volatile char* const touched = pages;
  for (std::size_t at = 0; at < sizeof pages; at += 1024) touched[at] = 1;
  getrusage(RUSAGE_THREAD, &after);
  return after.ru_minflt - before.ru_minflt;
}

TEST(Realtime, APriorityOneAboveTheLimitIsRefusedAndReported) {
  const int code = in_a_child([] {
    // Root may do anything; nobody only what the limit permits, which may be nothing.
    rlimit limit{.rlim_cur = 49, .rlim_max = 49};
    if (setrlimit(RLIMIT_RTPRIO, &limit) != 0) getrlimit(RLIMIT_RTPRIO, &limit);
    if (limit.rlim_cur > 98 || setresuid(65534, 65534, 65534) != 0) return kNotPermitted;
    const int permitted = static_cast<int>(limit.rlim_cur);
    if (permitted > 0 && !apply_realtime_settings({.fifo = true, .priority = permitted}).empty())
      return kNotPermitted;
    const auto refused = apply_realtime_settings({.fifo = true, .priority = permitted + 1});
    if (refused.size() != 1) return 1;
    const std::string wanted = "priority " + std::to_string(permitted + 1);
    return refused[0].find(wanted) != std::string::npos &&
                   refused[0].find("LimitRTPRIO") != std::string::npos
               ? 0
               : 2;
  });
  if (code == kNotPermitted) GTEST_SKIP() << "needs root, to become nobody, and real-time limits";
  EXPECT_EQ(code, 0);
}

TEST(Realtime, LockedMemoryIncludesTheStackThatATickNeeds) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers keep their own stacks";
#endif
  EXPECT_GT(in_a_child([] { return static_cast<int>(std::min(faults_of_deep_stack(), 100L)); }), 20)
      << "200 KiB that are not there yet";
  EXPECT_LT(in_a_child([] {
              apply_realtime_settings({.lock_memory = true});
              return static_cast<int>(std::min(faults_of_deep_stack(), 100L));
            }),
            5);
}

TEST(Realtime, SleepsEndWhenDueWithoutFifoToo) {
  const int slack_ns = in_a_child([] {
    apply_realtime_settings({});
    return prctl(PR_GET_TIMERSLACK);
  });
  EXPECT_EQ(slack_ns, 1);
}

TEST(Realtime, ACpuThatIsNotThereIsReported) {
  const int lines =
      in_a_child([] { return static_cast<int>(apply_realtime_settings({.cpu = 1023}).size()); });
  EXPECT_EQ(lines, 1);
}

}  // namespace
}  // namespace softarm
