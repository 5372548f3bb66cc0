// What was done to the clock of a logger, undone by the messages' own clocks.
#include "softarm/transport/log_timeline.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <softarm_messages/mocap_frame_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <string>
#include <vector>

namespace softarm {
namespace {

constexpr std::int64_t kMs_us = 1000;

template <class Message>
std::string text_of(const Message& message) {
  std::string bytes(static_cast<std::size_t>(message.getEncodedSize()), '\0');
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

struct Logged {
  std::int64_t true_us;   ///< when it arrived
  std::int64_t stamp_us;  ///< what the logger's clock showed
  std::string channel, bytes;
};

/// A frame every 5 ms and a command every 2 ms, for ten seconds.
class Timeline : public ::testing::Test {
 protected:
  Timeline() {
    for (std::int64_t t = 0; t < 10'000 * kMs_us; t += kMs_us) {
      if (t % (2 * kMs_us) == 0) add_command(t, t + 77'000'000);
      if (t % (5 * kMs_us) == 0) add_frame(t, t + 5'000'000);
    }
  }
  void add_command(std::int64_t t, std::int64_t own_us) {
    softarm_messages::pressure_command_t message{};
    message.time_us = own_us;
    events_.push_back({t, kWall_us + t, transport_.lcm.command_channel, text_of(message)});
  }
  void add_frame(std::int64_t t, std::int64_t own_us) {
    softarm_messages::mocap_frame_t message{};
    message.capture_time_us = own_us;
    events_.push_back({t, kWall_us + t, transport_.lcm.mocap_channel, text_of(message)});
  }
  /// Sets the logger's clock by `step_us` at the instant `at_us`.
  void set_clock(std::int64_t at_us, std::int64_t step_us) {
    for (Logged& each : events_)
      if (each.true_us >= at_us) each.stamp_us += step_us;
  }
  /// Reads all; errors of the arrivals in s, relative to the first event.
  std::vector<double> errors() {
    std::vector<double> found;
    std::int64_t newest_ns = 0, position = 0;
    for (const Logged& each : events_) {
      const LogEvent event{.position = position += 100,
                           .number = 0,
                           .time_us = each.stamp_us,
                           .channel = each.channel,
                           .data = std::as_bytes(std::span(each.bytes))};
      const auto arrival_ns = timeline_.arrival_ns(event);
      EXPECT_TRUE(arrival_ns);
      EXPECT_GE(*arrival_ns, newest_ns) << "the line never runs back";
      newest_ns = *arrival_ns;
      found.push_back(to_seconds(*arrival_ns - 1000 * (kWall_us + each.true_us)));
    }
    return found;
  }
  static double largest(const std::vector<double>& errors) {
    double most = 0.0;
    for (const double each : errors) most = std::max(most, std::abs(each));
    return most;
  }

  static constexpr std::int64_t kWall_us = 1'700'000'000'000'000;
  TransportSettings transport_;
  LogTimeline timeline_{transport_};
  std::vector<Logged> events_;
};

TEST_F(Timeline, OfAGoodLogIsThatOfItsStamps) {
  EXPECT_EQ(largest(errors()), 0.0);
  EXPECT_EQ(timeline_.text(), "");
}

TEST_F(Timeline, AClockThatIsSetIsBridged) {
  for (const std::int64_t step_us :
       {-2'000 * kMs_us, 2'000 * kMs_us, -100 * kMs_us, 400 * kMs_us, -600'000 * kMs_us,
        60'000 * kMs_us, -86'400'000 * kMs_us, 31'536'000'000 * kMs_us, -kWall_us}) {
    const auto before = events_;
    timeline_ = LogTimeline(transport_);
    set_clock(4'001 * kMs_us, step_us);
    EXPECT_LT(largest(errors()), 0.006) << step_us;
    ASSERT_EQ(timeline_.breaks().size(), 1u) << step_us << ": " << timeline_.text();
    EXPECT_EQ(timeline_.breaks()[0].kind, LogBreak::Kind::clock_set);
    EXPECT_NEAR(timeline_.breaks()[0].seconds, 1e-6 * static_cast<double>(step_us), 0.006);
    EXPECT_FALSE(timeline_.restarted());
    EXPECT_NE(timeline_.text().find("at byte"), std::string::npos);
    events_ = before;
  }
}

TEST_F(Timeline, ASmallStepIsFoundByTheClocksOfOurPrograms) {
  set_clock(4'001 * kMs_us, 60 * kMs_us);
  const auto found = errors();
  EXPECT_LT(std::abs(found.back()), 0.001);
  EXPECT_EQ(timeline_.breaks().size(), 1u) << timeline_.text();
}

TEST_F(Timeline, SeveralStepsAreBridged) {
  set_clock(2'000 * kMs_us, -2'000 * kMs_us);
  set_clock(5'000 * kMs_us, 7'000 * kMs_us);
  set_clock(8'000 * kMs_us, -5'000 * kMs_us);
  EXPECT_LT(largest(errors()), 0.006);
  EXPECT_EQ(timeline_.breaks().size(), 3u);
}

// Motion capture on the logger's computer, stamped by its wall clock.
TEST_F(Timeline, FramesMayBeStampedByTheClockThatIsSet) {
  for (const std::int64_t step_us : {-3'000 * kMs_us, 3'000 * kMs_us}) {
    timeline_ = LogTimeline(transport_);
    events_.clear();
    for (std::int64_t t = 0; t < 10'000 * kMs_us; t += kMs_us) {
      if (t % (2 * kMs_us) == 1 * kMs_us) add_command(t, t + 77'000'000);
      if (t % (5 * kMs_us) == 0) add_frame(t, kWall_us + t + (t >= 4'000 * kMs_us ? step_us : 0));
    }
    set_clock(4'000 * kMs_us, step_us);
    EXPECT_LT(largest(errors()), 0.006) << step_us;
  }
}

TEST_F(Timeline, FramesAloneAreBridgedByTheirSendersClock) {
  std::erase_if(events_,
                [&](const Logged& each) { return each.channel != transport_.lcm.mocap_channel; });
  set_clock(4'000 * kMs_us, -2'000 * kMs_us);
  EXPECT_LT(largest(errors()), 0.006);
  EXPECT_EQ(timeline_.breaks().size(), 1u);
}

TEST_F(Timeline, ADamagedStampMovesNothing) {
  events_[3000].stamp_us += 1'000'000'000'000;
  events_[4000].stamp_us -= 1'000'000'000'000;
  EXPECT_LT(largest(errors()), 0.006);
  EXPECT_FALSE(timeline_.restarted());
}

TEST_F(Timeline, ALongGapIsShortened) {
  for (Logged& each : events_)
    if (each.true_us >= 5'000 * kMs_us) {
      each.true_us += 600'000 * kMs_us;
      each.stamp_us += 600'000 * kMs_us;
    }
  std::vector<Logged> late;
  for (Logged& each : events_) late.push_back(each);
  events_.clear();
  for (const Logged& each : late) {  // the senders' clocks have run on
    const bool frame = each.channel == transport_.lcm.mocap_channel;
    frame ? add_frame(each.true_us, each.true_us + 5'000'000)
          : add_command(each.true_us, each.true_us + 77'000'000);
  }
  const auto found = errors();
  EXPECT_NEAR(found.back(), -590.0, 0.01);
  ASSERT_EQ(timeline_.breaks().size(), 1u) << timeline_.text();
  EXPECT_EQ(timeline_.breaks()[0].kind, LogBreak::Kind::gap);
  EXPECT_NEAR(timeline_.breaks()[0].seconds, 600.0, 0.01);
}

// As `cat first.log second.log`, the computers started again in between, with and without battery.
TEST_F(Timeline, AnotherRecordingIsARestart) {
  for (const std::int64_t wall_us : {kWall_us + 3'600'000 * kMs_us, kWall_us - 3'600'000 * kMs_us,
                                     std::int64_t{60'000 * kMs_us}}) {
    timeline_ = LogTimeline(transport_);
    events_.resize(7000);
    const std::size_t first = events_.size();
    for (std::int64_t t = 0; t < 5'000 * kMs_us; t += kMs_us) {
      if (t % (2 * kMs_us) == 0) add_command(t, t + 11'000'000);
      if (t % (5 * kMs_us) == 0) add_frame(t, t + 1'000'000);
    }
    for (std::size_t k = first; k < events_.size(); ++k) events_[k].stamp_us += wall_us - kWall_us;
    const auto found = errors();
    EXPECT_TRUE(timeline_.restarted());
    EXPECT_EQ(timeline_.breaks().size(), 1u) << timeline_.text();
    // Within the second one, times are right.
    EXPECT_NEAR(found[first + 200], found.back(), 1e-6);
  }
}

// Stamps of a sender that has no clock are those of the logger.
TEST_F(Timeline, SendersWithoutAClockAreAccepted) {
  events_.clear();
  for (std::int64_t t = 0; t < 10'000 * kMs_us; t += kMs_us) {
    if (t % (2 * kMs_us) == 0) add_command(t, 0);
    if (t % (5 * kMs_us) == 0) add_frame(t, t + 5'000'000);
  }
  EXPECT_EQ(largest(errors()), 0.0);
}

TEST_F(Timeline, OtherChannelsAndStampsThatAreNoTimesHaveNone) {
  EXPECT_FALSE(timeline_.arrival_ns({.time_us = 1, .channel = "ANOTHER", .data = {}}));
  EXPECT_FALSE(
      timeline_.arrival_ns({.time_us = -1, .channel = transport_.lcm.command_channel, .data = {}}));
  EXPECT_TRUE(
      timeline_.arrival_ns({.time_us = 1, .channel = transport_.lcm.command_channel, .data = {}}));
}

}  // namespace
}  // namespace softarm
