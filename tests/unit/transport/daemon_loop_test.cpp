// The daemon's loop without its process, over real UDP multicast.
#include "softarm/transport/daemon_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "own_url.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm {
namespace {

using softarm_messages::controller_status_t;
using softarm_messages::pressure_command_t;

class DaemonLoopOverUdp : public ::testing::Test {
 protected:
  void SetUp() override {
    settings.arm.segments.resize(1);
    settings.actuation.segments = {{{0.0, 0.839}, {2.094395, 0.839}, {4.188790, 0.839}}};
    settings.control.kp.assign(2, 1.0);
    settings.control.kd.assign(2, 0.002);
    settings.reference.phases = {{SetPointReference{{0.2, 0.0}}, 0.0}};
    settings.rate_hz = 200.0;
    transport.bodies = {.base_id = 0, .segment_ids = {1}};
    transport.lcm.url = test::own_url();
    try {
      listener = std::make_unique<LcmNode>(transport.lcm.url);
      listener->subscribe(transport.lcm.command_channel, 4096, [this](const ReceivedMessage& each) {
        if (pressure_command_t message; decode(each.bytes, message)) commands.push_back(message);
      });
      listener->subscribe(transport.lcm.status_channel, 4096, [this](const ReceivedMessage& each) {
        if (controller_status_t message; decode(each.bytes, message)) statuses.push_back(message);
      });
      loop = std::make_unique<DaemonLoop>(settings, transport,
                                          Provenance{.version = "test", .build = "build"}, false);
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
  }
  void hear(std::size_t count) {
    const std::int64_t end_ns = monotonic_now_ns() + 10'000'000'000;
    while (commands.size() < count && monotonic_now_ns() < end_ns)
      listener->wait_until(monotonic_now_ns() + 10'000'000);
  }

  PipelineSettings settings;
  TransportSettings transport;
  std::unique_ptr<LcmNode> listener;
  std::unique_ptr<DaemonLoop> loop;
  std::vector<pressure_command_t> commands;
  std::vector<controller_status_t> statuses;
};

TEST_F(DaemonLoopOverUdp, TicksUntilAStopThenCommandsZeroThreeTimes) {
  std::vector<DaemonLoop::Report> reports;
  loop->run([&] { return reports.size() >= 20; },
            [&](const DaemonLoop::Report& report) { reports.push_back(report); });
  // Twenty ticks, then three that are asked to stop: nothing has to be vented without frames.
  ASSERT_EQ(reports.size(), 23u);
  for (std::size_t i = 0; i < reports.size(); ++i) {
    EXPECT_EQ(reports[i].stopping, i >= 20) << i;
    if (i > 0) {
      EXPECT_GT(reports[i].woken_ns, reports[i - 1].woken_ns);
    }
  }
  EXPECT_EQ(loop->timing().ticks, 23);
  EXPECT_EQ(loop->pipeline().output().reason, Reason::shutdown);
  EXPECT_EQ(loop->link().unsent(), 0);
  hear(23);
  ASSERT_EQ(commands.size(), 23u);
  for (std::size_t i = 20; i < 23; ++i)
    EXPECT_TRUE(std::all_of(commands[i].pressure_bar.begin(), commands[i].pressure_bar.end(),
                            [](float bar) { return bar == 0.0F; }));
}

TEST_F(DaemonLoopOverUdp, AFunctionCalledAfterEachTickSeesWhatWasDecided) {
  Mode first = Mode::fault;
  int calls = 0;
  loop->run([&] { return calls > 0; },
            [&](const DaemonLoop::Report&) {
              if (calls++ == 0) first = loop->pipeline().output().mode;
            });
  EXPECT_EQ(first, Mode::wait_frames);
}

TEST_F(DaemonLoopOverUdp, AFaultIsPublishedOnceItIsKept) {
  constexpr int kAfter = 15;
  int asked = 0, ticks = 0;
  loop->keep_faults([&](Mode mode, Reason) { return mode != Mode::fault || ++asked > kAfter; });
  loop->begin_stopped();
  loop->run([&] { return ticks >= 30; }, [&](const DaemonLoop::Report&) { ++ticks; });
  hear(static_cast<std::size_t>(ticks));
  ASSERT_EQ(commands.size(), static_cast<std::size_t>(ticks)) << "commands do not wait";
  ASSERT_FALSE(statuses.empty());
  EXPECT_EQ(statuses.front().tick, kAfter + 1);
  EXPECT_EQ(statuses.front().mode, static_cast<std::int8_t>(Mode::fault));
}

}  // namespace
}  // namespace softarm
