// What a service manager receives, with time as an argument and its socket in our hands.
#include "softarm/base/service_notifier.hpp"

#include <gtest/gtest.h>

#include <string>

#include "counted_malloc.hpp"
#include "milliseconds.hpp"
#include "notify_socket.hpp"

namespace softarm {
namespace {

using test::AddressKind;
using test::NotifySocket;

using test::kMs;
constexpr std::int64_t kStart_ns = 1'000'000 * kMs;

class Notifier : public ::testing::TestWithParam<AddressKind> {
 protected:
  NotifySocket manager_{GetParam()};
};

TEST_P(Notifier, SaysReadyOnceAndThenOnlyWhatHasChanged) {
  ServiceNotifier notifier;
  ASSERT_EQ(notifier.problem(), "");
  EXPECT_EQ(manager_.next(), "") << "nothing before the first report";
  notifier.report(kStart_ns, {.state = "WAIT_FRAMES", .reason = "starting"});
  EXPECT_EQ(manager_.next(), "READY=1\nSTATUS=WAIT_FRAMES (starting)\n");
  notifier.report(kStart_ns + kMs, {.state = "WAIT_FRAMES", .reason = "starting"});
  EXPECT_EQ(manager_.next(), "");
  notifier.report(kStart_ns + 2 * kMs, {.state = "ACTIVE", .reason = "none"});
  EXPECT_EQ(manager_.next(), "STATUS=ACTIVE\n");
  notifier.report(kStart_ns + 4 * kMs, {.state = "VENT", .reason = "shutdown", .stopping = true});
  EXPECT_EQ(manager_.next(), "STOPPING=1\nSTATUS=VENT (shutdown)\n");
  notifier.report(kStart_ns + 5 * kMs, {.state = "VENT", .reason = "shutdown", .stopping = true});
  EXPECT_EQ(manager_.next(), "") << "each once";
}

TEST_P(Notifier, FeedsTheWatchdogOnlyWhileDeadlinesAreMet) {
  setenv("WATCHDOG_USEC", "100000", 1);
  setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  ServiceNotifier notifier;
  int feeds = 0;
  const auto run = [&](int from_ms, int to_ms, bool on_time) {
    feeds = 0;
    for (int t = from_ms; t < to_ms; t += 2) {
      notifier.report(kStart_ns + t * kMs, {.state = "ACTIVE", .reason = "", .on_time = on_time});
      if (manager_.next().find("WATCHDOG=1") != std::string::npos) ++feeds;
    }
    return feeds;
  };
  EXPECT_EQ(run(0, 1000, true), 20) << "every 50 ms";
  EXPECT_EQ(run(1000, 2000, false), 0) << "no deadline was kept";
  EXPECT_EQ(run(2000, 2002, true), 1) << "at once when one is kept again";
}

TEST_P(Notifier, LeavesAnotherProcessesWatchdogAlone) {
  setenv("WATCHDOG_USEC", "100000", 1);
  setenv("WATCHDOG_PID", "1", 1);
  ServiceNotifier notifier;
  notifier.report(kStart_ns, {.state = "ACTIVE", .reason = ""});
  EXPECT_EQ(manager_.next(), "READY=1\nSTATUS=ACTIVE\n");
}

TEST_P(Notifier, HasNoWatchdogWithAPeriodThatIsNoNumber) {
  for (const char* period : {"", "0", "-5", "12s", "99999999999999999999"}) {
    setenv("WATCHDOG_USEC", period, 1);
    ServiceNotifier notifier;
    notifier.report(kStart_ns, {.state = "ACTIVE", .reason = ""});
    EXPECT_EQ(manager_.next(), "READY=1\nSTATUS=ACTIVE\n") << period;
  }
}

TEST_P(Notifier, DoesNotWaitForAManagerThatDoesNotRead) {
  setenv("WATCHDOG_USEC", "2", 1);
  ServiceNotifier notifier;
  // The queue of a datagram socket holds some ten to some hundred datagrams: this returns at all
  // only if nothing waits.
  for (int i = 0; i < 2000; ++i)
    notifier.report(kStart_ns + i * kMs, {.state = i % 2 ? "HOLD" : "ACTIVE", .reason = ""});
  notifier.report(kStart_ns + 2000 * kMs, {.state = "VENT", .reason = "", .stopping = true});
  int queued = 0;
  for (std::string text = manager_.next(); !text.empty(); text = manager_.next()) {
    EXPECT_EQ(text.find("STOPPING"), std::string::npos) << "the queue was full";
    ++queued;
  }
  EXPECT_GT(queued, 0);
  EXPECT_LT(queued, 2000);
  // What did not fit is sent with the next report, and only the newest of it.
  notifier.report(kStart_ns + 2001 * kMs, {.state = "VENT", .reason = "", .stopping = true});
  EXPECT_EQ(manager_.next(), "STOPPING=1\nSTATUS=VENT\nWATCHDOG=1\n");
}

TEST_P(Notifier, AllocatesNothingInTheTick) {
  setenv("WATCHDOG_USEC", "2", 1);
  ServiceNotifier notifier;
  const long before = test::thread_allocations;
  for (int i = 0; i < 100; ++i)
    notifier.report(kStart_ns + i * kMs, {.state = i % 2 ? "HOLD" : "ACTIVE", .reason = "late"});
  EXPECT_EQ(test::thread_allocations, before);
}

INSTANTIATE_TEST_SUITE_P(Sockets, Notifier,
                         ::testing::Values(AddressKind::path, AddressKind::abstract),
                         [](const auto& kind) {
                           return kind.param == AddressKind::path ? "Path" : "Abstract";
                         });

TEST(NotifierWithoutManager, DoesNothing) {
  unsetenv("NOTIFY_SOCKET");
  ServiceNotifier notifier;
  notifier.report(kStart_ns, {.state = "ACTIVE", .reason = ""});
  EXPECT_EQ(notifier.problem(), "");
}

TEST(NotifierWithoutManager, ReportsAnInvalidAddress) {
  const std::string relative = "run/notify", too_long = std::string("/").append(200, 'x');
  for (const std::string& address : {relative, too_long}) {
    setenv("NOTIFY_SOCKET", address.c_str(), 1);
    ServiceNotifier notifier;
    notifier.report(kStart_ns, {.state = "ACTIVE", .reason = ""});
    EXPECT_NE(notifier.problem().find(address), std::string::npos) << notifier.problem();
  }
  unsetenv("NOTIFY_SOCKET");
}

}  // namespace
}  // namespace softarm
