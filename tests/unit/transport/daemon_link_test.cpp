// The daemon's side of LCM over real UDP multicast: ten thousand ticks without a call for memory on
// the tick's thread, and what it accepts as a request. The link's clock is the test's: it
// advances when the test lets it, so that no machine is too slow.
#include "softarm/transport/daemon_link.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <thread>

#include "counted_malloc.hpp"
#include "own_url.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "softarm/transport/settings.hpp"
#include "unit/transport/messages.hpp"

namespace softarm {
namespace {

using namespace softarm_messages;

class DaemonLinkOverUdp : public ::testing::Test {
 protected:
  DaemonLinkOverUdp() {
    settings.arm.segments.resize(3);
    settings.actuation.segments.assign(
        3, {{0.0, 0.839}, {1.570796, 0.839}, {3.141593, 0.839}, {4.712389, 0.839}});
    settings.control.kp.assign(6, 1.0);
    settings.control.kd.assign(6, 0.002);
    settings.reference.phases = {{LiveReference{}, 0.0}};
    transport.bodies = {.base_id = 0, .segment_ids = {1, 2, 3}};
    settings.safety.valve_readback = true;
    settings.safety.pressure_tolerance_bar = 100.0;  // the messages here follow no command
    transport.lcm.deadman_channel = "SOFTARM_GO";
    transport.lcm.url = test::own_url();
  }
  void SetUp() override {
    try {
      sender = std::make_unique<LcmNode>(transport.lcm.url);
      link = make_link();
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
  }

  std::unique_ptr<DaemonLink> make_link(bool shadow = false) const {
    return std::make_unique<DaemonLink>(settings, transport,
                                        Provenance{.version = "test", .build = "build"}, shadow);
  }

  void ask(std::int64_t sequence, std::int8_t request, std::int64_t nonce) {
    sender->publish(transport.lcm.operator_channel,
                    operator_command_t{.sequence = sequence, .nonce = nonce, .request = request});
  }
  void ask(std::int64_t sequence, std::int8_t request) {
    ask(sequence, request, link->nonce(now_ns));
  }
  void say(std::int64_t sequence, bool go, std::int64_t nonce) {
    sender->publish(
        transport.lcm.deadman_channel,
        deadman_t{
            .sequence = sequence, .nonce = nonce, .go = static_cast<std::int8_t>(go ? 1 : 0)});
  }
  void say(std::int64_t sequence, bool go) { say(sequence, go, link->nonce(now_ns)); }

  mocap_frame_t straight_frame(std::int64_t number) const {
    mocap_frame_t message{};
    message.frame_number = number;
    message.capture_time_us = now_ns / 1000;
    message.num_bodies = 4;
    message.bodies.resize(4);
    for (int i = 0; i < 4; ++i) {
      auto& body = message.bodies[static_cast<std::size_t>(i)];
      body = {};
      body.id = i;
      body.valid = 1;
      body.position_m[2] = -0.11 * i + 1e-6 * static_cast<double>(number % 3);
      body.orientation[1] = 1.0;  // hanging: half a turn about x
    }
    return message;
  }

  /// Collects until `reached` is true of an input; time stands still meanwhile.
  template <class Condition>
  bool collect_until(Condition reached) {
    const std::int64_t end_ns = monotonic_now_ns() + kPatience_ns;
    while (monotonic_now_ns() < end_ns) {
      if (reached(link->collect(now_ns))) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
  /// Collects until everything sent so far has been handled: messages come in the order in which
  /// they were sent, and this sends one more. False where `excluded` is true of an input.
  template <class Condition>
  bool nothing_comes(Condition excluded) {
    const std::int64_t malformed = link->malformed();
    sender->publish(transport.lcm.operator_channel, test::example<timing_t>(0, 0));
    bool came = false;
    EXPECT_TRUE(collect_until([&](const TickInput& input) {
      came |= excluded(input);
      return link->malformed() > malformed;
    }));
    return !came;
  }

  static constexpr std::int64_t kPatience_ns = 60'000'000'000;
  /// Of the link, an hour behind the machine's: everything arrives at this instant.
  std::int64_t now_ns = monotonic_now_ns() - 3'600'000'000'000;
  PipelineSettings settings;
  TransportSettings transport;
  std::unique_ptr<LcmNode> sender;
  std::unique_ptr<DaemonLink> link;
};

TEST_F(DaemonLinkOverUdp, TenThousandTicksAllocateNothing) {
  constexpr int kOnTheirWay = 32;  // frames that a slow machine has not delivered yet
  settings.safety.hold_after_s = settings.safety.max_latency_s = 1.0;
  settings.safety.vent_after_s = 2.0;
  ControlPipeline pipeline(settings);
  LoopTiming timing;
  const LcmSettings& lcm = transport.lcm;
  pressure_measurement_t measurement = test::example<pressure_measurement_t>(3, 4);
  measurement.sequence = 1;  // some command is in force
  curvature_reference_t reference = test::example<curvature_reference_t>(3, 4);
  operator_command_t operator_command{
      .sequence = 0, .nonce = 0, .request = operator_command_t::ARM};
  const timing_t not_a_frame = test::example<timing_t>(0, 0);
  std::int64_t frames = 0, references = 0, active = 0, lost = 0;
  long allocated = 0, released = 0;
  constexpr int kTicks = 10'000;
  int counted = 0;
  for (int k = 0; counted < kTicks; ++k) {
    sender->publish(lcm.mocap_channel, straight_frame(k));
    sender->publish(lcm.measurement_channel, measurement);
    sender->publish(lcm.deadman_channel,
                    deadman_t{.sequence = k, .nonce = link->nonce(now_ns), .go = 1});
    if (k % 10 == 0) {
      reference.sequence = k;
      sender->publish(lcm.reference_channel, reference);
      operator_command.sequence = k + 1;
      operator_command.nonce = link->nonce(now_ns);
      sender->publish(lcm.operator_channel, operator_command);
      sender->publish(lcm.mocap_channel, not_a_frame);
    }
    const long allocated_before = test::thread_allocations;
    const long released_before = test::thread_releases;
    now_ns += pipeline.period_ns();
    TickInput input = link->collect(now_ns);
    const std::int64_t wait_until_ns = monotonic_now_ns() + 1'000'000'000;
    while (k - frames - lost > kOnTheirWay && input.frames.empty()) {
      std::this_thread::yield();
      if (monotonic_now_ns() > wait_until_ns) ++lost;
      input = link->collect(now_ns);
    }
    const TickOutput& output = pipeline.tick(input);
    link->publish_command(now_ns, output);
    ++timing.ticks;
    link->publish_status(input.now_ns, pipeline, timing);
    link->publish_record(input, output);
    if (k % 100 == 0) link->publish_timing(input.now_ns, timing);
    // With its first message LCM makes itself a lock; that is start-up.
    if (frames > 0) {
      ++counted;
      allocated += test::thread_allocations - allocated_before;
      released += test::thread_releases - released_before;
    }
    frames += std::ssize(input.frames);
    references += input.reference != nullptr ? 1 : 0;
    active += output.mode == Mode::active ? 1 : 0;
  }
  EXPECT_EQ(allocated, 0);
  EXPECT_EQ(released, 0);
  EXPECT_GT(frames, kTicks / 2);
  EXPECT_GT(references, 10);
  EXPECT_GT(active, kTicks / 2);
  EXPECT_GT(link->malformed(), 0);
  EXPECT_EQ(link->unsent(), 0);
}

// A tick that is held up between its frames and its command decides for valves that were not
// vented.
TEST_F(DaemonLinkOverUdp, WhatWasDecidedBeforeTheValvesVentedIsNotSentAfterIt) {
  pressure_command_t heard{};
  int count = 0;
  sender->subscribe(transport.lcm.command_channel, 100, [&](const ReceivedMessage& packet) {
    if (decode(packet.bytes, heard)) ++count;
  });
  TickOutput output;
  output.pressure_bar = PressureVector::Constant(12, 0.5);
  const auto validity_ns = to_ns(settings.safety.command_validity_s);
  const auto arrives = [&](int wanted) {
    const std::int64_t end_ns = monotonic_now_ns() + kPatience_ns;
    while (count < wanted && monotonic_now_ns() < end_ns) sender->wait_until(end_ns);
    return count == wanted;
  };

  EXPECT_TRUE(link->collect(now_ns).command_expired) << "none was sent";
  link->publish_command(now_ns, output);
  ASSERT_TRUE(arrives(1));
  EXPECT_FALSE(link->collect(now_ns + validity_ns - 1000).command_expired);
  link->publish_command(now_ns += validity_ns, output);
  EXPECT_EQ(link->unsent(), 1);
  EXPECT_TRUE(link->collect(now_ns).command_expired) << "not until something was sent";
  link->publish_command(now_ns, output);
  ASSERT_TRUE(arrives(2));
  EXPECT_EQ(heard.sequence, 3);
  EXPECT_FALSE(link->collect(now_ns + 1000).command_expired);
  EXPECT_EQ(link->unsent(), 1);
}

// Commands may have been lost on the way although this side sent them in time.
TEST_F(DaemonLinkOverUdp, ValvesThatReportThatTheyHaveVentedAreACommandThatExpired) {
  settings.safety.valve_readback = false;  // heard all the same
  link = std::make_unique<DaemonLink>(settings, transport, Provenance{"", 0, 0, "build"}, false);
  TickOutput output;
  output.pressure_bar = PressureVector::Constant(12, 0.5);
  pressure_measurement_t report = test::example<pressure_measurement_t>(3, 4);
  const auto expired = [](const TickInput& input) { return input.command_expired; };
  EXPECT_TRUE(link->collect(now_ns).command_expired) << "none was sent";
  link->publish_command(now_ns, output);
  sender->publish(transport.lcm.measurement_channel, report);
  EXPECT_TRUE(nothing_comes(expired)) << "in force";

  report.sequence = -1;
  sender->publish(transport.lcm.measurement_channel, report);
  ASSERT_TRUE(collect_until(expired));
  EXPECT_TRUE(link->collect(now_ns).command_expired) << "until they report one";
  report.sequence = 6;
  sender->publish(transport.lcm.measurement_channel, report);
  ASSERT_TRUE(collect_until([](const TickInput& input) { return !input.command_expired; }));

  // The report of the vent was lost too; the next one counts it.
  ++report.expired;
  sender->publish(transport.lcm.measurement_channel, report);
  ASSERT_TRUE(collect_until(expired));
  EXPECT_FALSE(link->collect(now_ns).command_expired) << "once";

  // They grant less than commands ask for, so commands expire earlier.
  const std::int64_t granted_ns = to_ns(settings.safety.command_validity_s) / 2;
  report.validity_us = static_cast<std::int32_t>(granted_ns / 1000);
  sender->publish(transport.lcm.measurement_channel, report);
  ASSERT_TRUE(collect_until([&](const TickInput&) { return link->held_us() < link->asked_us(); }));
  EXPECT_FALSE(link->collect(now_ns + granted_ns - 1000).command_expired);
  EXPECT_TRUE(link->collect(now_ns + granted_ns).command_expired);
}

TEST_F(DaemonLinkOverUdp, AFloodIsBoundedWork) {
  for (int k = 0; k < 2000; ++k) sender->publish(transport.lcm.mocap_channel, straight_frame(k));
  std::size_t most = 0, all = 0;
  EXPECT_TRUE(collect_until([&](const TickInput& input) {
    most = std::max(most, input.frames.size());
    return (all += input.frames.size()) >= 64;
  }));
  EXPECT_LE(most, 64u);
}

// By the machine's own clock.
TEST_F(DaemonLinkOverUdp, CapturesLieBetweenTheSendingAndNow) {
  const std::int64_t first_ns = now_ns = monotonic_now_ns();
  std::int64_t number = 0;
  ASSERT_TRUE(collect_until([&](const TickInput& input) {
    for (const MocapFrame& frame : input.frames) {
      EXPECT_LE(frame.capture_ns, input.now_ns);
      EXPECT_GE(frame.capture_ns, first_ns - 2000) << "stamps are of microseconds";
    }
    now_ns = monotonic_now_ns();
    sender->publish(transport.lcm.mocap_channel, straight_frame(++number));
    return number > 20 && !input.frames.empty();
  }));
}

constexpr std::int8_t kArm = operator_command_t::ARM, kDisarm = operator_command_t::DISARM,
                      kStop = operator_command_t::EMERGENCY_STOP;
const auto arms = [](const TickInput& input) { return input.requests.arm; };
const auto disarms = [](const TickInput& input) { return input.requests.disarm; };
const auto stops = [](const TickInput& input) { return input.requests.emergency_stop; };

// A key that was pressed before a disarm, and is repeated after it.
TEST_F(DaemonLinkOverUdp, AnArmOlderThanADisarmOrStopIsRefused) {
  ask(1000, kArm);
  ASSERT_TRUE(collect_until(arms));
  ask(1000, kArm);
  ASSERT_TRUE(collect_until(arms)) << "the same key press";
  std::int64_t latest = 1000;
  for (const auto& [request, comes] : {std::pair{kDisarm, +disarms}, std::pair{kStop, +stops}}) {
    // On a machine whose clock is behind.
    ask(11, request);
    ASSERT_TRUE(collect_until([&](const TickInput& input) {
      EXPECT_EQ(input.requests.disarm, input.requests.disarm && request == kDisarm);
      return comes(input);
    }));
    now_ns += 1'000'000;
    ask(latest, kArm);
    EXPECT_TRUE(nothing_comes(arms)) << "the key was pressed before";
    ask(++latest, kArm);
    ASSERT_TRUE(collect_until(arms)) << "again";
  }
  ask(latest + 10, kDisarm);
  ASSERT_TRUE(collect_until(disarms));
  ask(latest + 9, kArm);
  EXPECT_TRUE(nothing_comes(arms)) << "pressed before, heard for the first time after it";
  now_ns += 3'000'000'000;  // no key press lasts as long
  ask(5, kArm);
  EXPECT_TRUE(collect_until(arms)) << "of a machine whose clock is behind";
}

TEST_F(DaemonLinkOverUdp, AnArmMustEchoAStatusOfTheLastSecondSinceTheLastStop) {
  const std::int64_t first = link->nonce(now_ns);
  std::int64_t number = 0;
  for (const std::int64_t nonce : {std::int64_t{0}, first + 1, first - 1'000'000, ~first}) {
    ask(++number, kArm, nonce);
    EXPECT_TRUE(nothing_comes(arms)) << nonce - first;
  }
  now_ns += 900'000'000;
  ask(++number, kArm, first);
  EXPECT_TRUE(collect_until(arms));
  now_ns += 100'000'000;
  ask(++number, kArm, first);
  EXPECT_TRUE(nothing_comes(arms)) << "a second old";
  // Whoever pressed the key had not heard of the disarm yet, whatever the number.
  const std::int64_t before = link->nonce(now_ns);
  now_ns += 1'000'000;
  ask(++number, kDisarm, 0);
  ASSERT_TRUE(collect_until(disarms));
  ask(++number, kArm, before);
  EXPECT_TRUE(nothing_comes(arms));
  ask(++number, kArm, link->nonce(now_ns));
  EXPECT_TRUE(collect_until(arms));
  // Nor does the status of another run of the daemon count.
  link = make_link();
  ask(++number, kArm, before + 1'000'000);
  EXPECT_TRUE(nothing_comes(arms));
}

// Nobody echoes its status.
TEST_F(DaemonLinkOverUdp, AShadowIsArmedWithTheDaemonThatCommands) {
  link = make_link(true);
  ask(1, kArm, 0);
  EXPECT_TRUE(collect_until(arms));
}

TEST_F(DaemonLinkOverUdp, AnArmFromBeforeAVentIsRefused) {
  ControlPipeline pipeline(settings);
  LoopTiming timing;
  const auto tick = [&] {
    now_ns += pipeline.period_ns();
    pipeline.tick(link->collect(now_ns));
    link->publish_status(now_ns, pipeline, timing);
  };
  tick();
  const std::int64_t before = link->nonce(now_ns);
  TickInput shut;
  shut.now_ns = now_ns += pipeline.period_ns();
  shut.requests.shutdown = true;  // any way into VENT
  ASSERT_EQ(pipeline.tick(shut).mode, Mode::vent);
  link->publish_status(now_ns, pipeline, timing);
  ask(1, kArm, before);
  EXPECT_TRUE(nothing_comes(arms));
  ask(2, kArm, link->nonce(now_ns));
  EXPECT_TRUE(collect_until(arms));
}

TEST_F(DaemonLinkOverUdp, OnlyADisarmOfSomebodyWhoSawTheFaultLeavesIt) {
  ControlPipeline pipeline(settings);
  LoopTiming timing;
  const std::int64_t before = link->nonce(now_ns);
  ask(1, 77, 0);  // nobody knows what that is
  ASSERT_TRUE(collect_until(disarms));
  ask(2, kStop, 0);
  TickInput stopped;
  ASSERT_TRUE(collect_until([&](const TickInput& input) {
    stopped = input;
    EXPECT_FALSE(input.requests.disarm) << "a disarm would acknowledge the stop";
    return input.requests.emergency_stop;
  }));
  ASSERT_EQ(pipeline.tick(stopped).mode, Mode::fault);
  link->publish_status(now_ns, pipeline, timing);
  const std::int64_t fault = link->nonce(now_ns);
  now_ns += 1'000'000;
  for (const std::int64_t nonce : {std::int64_t{0}, before - 1'000}) {
    ask(3, kDisarm, nonce);
    EXPECT_TRUE(nothing_comes(disarms)) << nonce - before;
  }
  ask(4, 77, fault);
  EXPECT_TRUE(nothing_comes(disarms)) << "an unknown request acknowledges nothing";
  // Stopped again: a disarm that waited for the first stop does not acknowledge the second.
  ask(5, kStop, 0);
  ASSERT_TRUE(collect_until(stops));
  ask(6, kDisarm, fault);
  EXPECT_TRUE(nothing_comes(disarms));
  ask(7, kDisarm, link->nonce(now_ns));
  EXPECT_TRUE(collect_until(disarms));
}

// LCM keeps the oldest and drops the newest.
TEST_F(DaemonLinkOverUdp, AFullQueueOfRequestsIsReportedAsLost) {
  EXPECT_FALSE(link->collect(now_ns).requests.lost);
  LcmNode listener(transport.lcm.url);
  int sent = 0, heard = 0;
  listener.subscribe(transport.lcm.operator_channel, 10'000,
                     [&](const ReceivedMessage&) { ++heard; });
  const std::int64_t end_ns = monotonic_now_ns() + kPatience_ns;
  bool lost = false;
  while (!lost && monotonic_now_ns() < end_ns) {
    for (int k = 0; k < 200; ++k) ask(++sent, kArm, 0);
    while (heard < sent && listener.wait_until(end_ns)) listener.drain(1000);
    lost = link->collect(now_ns).requests.lost;
  }
  EXPECT_TRUE(lost);
}

TEST_F(DaemonLinkOverUdp, AGoIsHeardOnceANumberAndTakenBackAtOnce) {
  const auto heard = [](const TickInput& input) { return input.newest_go_ns != kNever; };
  say(1, true);
  ASSERT_TRUE(collect_until(heard));
  const std::int64_t first_ns = link->collect(now_ns).newest_go_ns;
  now_ns += 1'000'000;
  const auto again = [&](const TickInput& input) { return input.newest_go_ns != first_ns; };
  say(1, true);  // a buffer that is sent again and again
  EXPECT_TRUE(nothing_comes(again));
  say(2, true, 0);
  say(3, true, link->nonce(now_ns) - 1'000'000);
  EXPECT_TRUE(nothing_comes(again)) << "a record that is played";
  say(2, true);
  ASSERT_TRUE(collect_until([&](const TickInput& input) { return input.newest_go_ns > first_ns; }));
  say(3, false, 0);
  ASSERT_TRUE(collect_until([&](const TickInput& input) { return !heard(input); }));
}

TEST_F(DaemonLinkOverUdp, OfTwoDeadMenTheOneThatReleasesWins) {
  const auto heard = [](const TickInput& input) { return input.newest_go_ns != kNever; };
  LcmNode listener(transport.lcm.url);
  int count = 0;
  listener.subscribe(transport.lcm.deadman_channel, 100, [&](const ReceivedMessage&) { ++count; });
  say(1, true);
  ASSERT_TRUE(collect_until(heard));
  // All within one tick.
  say(2, false);
  say(1000, true);
  const std::int64_t end_ns = monotonic_now_ns() + kPatience_ns;
  while (count < 3 && listener.wait_until(end_ns)) {
  }
  EXPECT_TRUE(collect_until([&](const TickInput& input) { return !heard(input); }));
}

TEST_F(DaemonLinkOverUdp, CommandsOfOthersAreHeardAndOurOwnAreNot) {
  const auto foreign = [](const TickInput& input) { return input.newest_foreign_ns != kNever; };
  pressure_command_t heard{};
  int count = 0;
  sender->subscribe(transport.lcm.command_channel, 100, [&](const ReceivedMessage& packet) {
    if (decode(packet.bytes, heard)) ++count;
  });
  TickOutput output;
  output.pressure_bar = PressureVector::Constant(12, 0.5);
  for (int k = 1; k <= 20; ++k) {
    link->collect(now_ns += 1'000'000);
    link->publish_command(now_ns, output);
    const std::int64_t end_ns = monotonic_now_ns() + kPatience_ns;
    while (count < k && sender->wait_until(end_ns)) {
    }
  }
  ASSERT_EQ(count, 20);
  EXPECT_TRUE(nothing_comes(foreign));
  const auto send = [&] { sender->publish(transport.lcm.command_channel, heard); };
  send();
  EXPECT_TRUE(nothing_comes(foreign)) << "our own, repeated by the network";
  heard.shadow = 1;
  heard.sequence = 1000;
  send();
  EXPECT_TRUE(nothing_comes(foreign)) << "a shadow's";
  sender->publish(transport.lcm.command_channel, test::example<timing_t>(0, 0));
  EXPECT_TRUE(nothing_comes(foreign)) << "no command at all";
  heard.shadow = 0;
  heard.sequence = 20;
  ++heard.time_us;
  send();
  EXPECT_TRUE(collect_until(foreign)) << "a number of ours, but another time";
}

TEST_F(DaemonLinkOverUdp, MeasuredPressuresArriveOnceAndOnlyIfTheyMakeSense) {
  const auto send = [this](int chambers, float first) {
    pressure_measurement_t message = test::example<pressure_measurement_t>(chambers / 4, 4);
    message.pressure_bar[0] = first;
    sender->publish(transport.lcm.measurement_channel, message);
  };
  send(12, 1.5F);
  ASSERT_TRUE(collect_until([](const TickInput& input) {
    if (input.measured_bar == nullptr) return false;
    EXPECT_EQ(input.measured_bar->size(), 12);
    EXPECT_EQ((*input.measured_bar)[0], 1.5);
    EXPECT_EQ((*input.measured_bar)[11], 0.125 + 0.25 * 11);
    return true;
  }));
  const std::int64_t heard_ns = link->collect(now_ns).newest_measurement_ns;
  now_ns += 1'000'000;
  send(8, 1.0F);
  send(12, std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(collect_until([&](const TickInput& input) {
    EXPECT_EQ(input.measured_bar, nullptr);
    EXPECT_EQ(input.newest_measurement_ns, heard_ns);
    return link->malformed() == 2;
  }));
}

TEST_F(DaemonLinkOverUdp, AReferenceThatBeginsAgainIsHeardAfterASilence) {
  curvature_reference_t reference = test::example<curvature_reference_t>(3, 4);
  const auto send = [&](std::int64_t sequence) {
    reference.sequence = sequence;
    sender->publish(transport.lcm.reference_channel, reference);
  };
  const auto came = [](const TickInput& input) { return input.reference != nullptr; };
  send(5000);
  ASSERT_TRUE(collect_until(came));
  send(1);
  EXPECT_TRUE(nothing_comes(came)) << "older";
  now_ns += 600'000'000;  // of silence
  send(2);
  EXPECT_TRUE(collect_until(came));
  send(1);
  send(3);
  ASSERT_TRUE(collect_until(came));
}

TEST_F(DaemonLinkOverUdp, AReferenceOfAnotherSizeIsMalformed) {
  sender->publish(transport.lcm.reference_channel, test::example<curvature_reference_t>(2, 4));
  EXPECT_TRUE(collect_until([this](const TickInput& input) {
    EXPECT_EQ(input.reference, nullptr);
    return link->malformed() == 1;
  }));
}

/// A link that listens to an external law and to targets of the tip.
class ExternalLawOverUdp : public DaemonLinkOverUdp {
 protected:
  void SetUp() override {
    settings.control.law = ExternalLaw{};
    settings.reference.phases = {{LiveTipReference{}, 0.0}};
    DaemonLinkOverUdp::SetUp();
    idle = std::make_unique<ControlPipeline>(settings);
  }
  law_command_t answer(std::int64_t sequence) const {
    law_command_t message{.sequence = sequence,
                          .nonce = link->nonce(now_ns),
                          .validity_us = 50'000,
                          .answer = law_command_t::FORCE,
                          .num_values = 6,
                          .value = test::numbers<double>(6, 0.25)};
    return message;
  }
  std::int64_t refused(LawVerdict why) const {
    return link->law_counts(*idle)[static_cast<std::size_t>(why)];
  }
  std::unique_ptr<ControlPipeline> idle;
  static bool came(const TickInput& input) { return input.law != nullptr; }
};

TEST_F(ExternalLawOverUdp, AnAnswerToARecentStateComesWithTheTimesOfBoth) {
  const std::string& channel = transport.lcm.law_channel;
  const std::int64_t state_ns = now_ns;
  const law_command_t message = answer(1);
  now_ns += 3'000'000;
  sender->publish(channel, message);
  ASSERT_TRUE(collect_until([&](const TickInput& input) {
    if (!came(input)) return false;
    EXPECT_EQ(input.law->state_ns, state_ns / 1000 * 1000);
    EXPECT_EQ(input.law->arrival_ns, now_ns);
    EXPECT_EQ(input.law->validity_ns, 50'000'000);
    EXPECT_EQ(input.law->answer, LawAnswer::force);
    EXPECT_EQ(input.law->values.size(), 6);
    EXPECT_EQ(input.law->values[5], 1.5);
    return true;
  }));
}

TEST_F(ExternalLawOverUdp, WhatIsOldForeignOrOfAnotherSizeIsRefusedAndCounted) {
  const std::string& channel = transport.lcm.law_channel;
  const auto refuses = [&](const law_command_t& message, LawVerdict why) {
    const std::int64_t before = refused(why);
    bool heard = false;
    sender->publish(channel, message);
    EXPECT_TRUE(collect_until([&](const TickInput& input) {
      heard |= came(input);
      return refused(why) == before + 1;
    })) << name(why);
    EXPECT_FALSE(heard) << name(why);
  };
  const law_command_t old = answer(10);
  sender->publish(channel, answer(5));
  ASSERT_TRUE(collect_until(came));
  refuses(answer(5), LawVerdict::out_of_order);
  refuses(answer(4), LawVerdict::out_of_order);
  law_command_t wrong = answer(6);
  wrong.num_values = 5;
  wrong.value.resize(5);
  refuses(wrong, LawVerdict::wrong_size);
  wrong = answer(6);
  wrong.answer = law_command_t::PRESSURES;  // of which there are twelve
  refuses(wrong, LawVerdict::wrong_size);
  wrong = answer(6);
  wrong.answer = 7;
  refuses(wrong, LawVerdict::wrong_size);
  wrong = answer(6);
  wrong.nonce += 1'000'000;  // a state that is yet to come
  refuses(wrong, LawVerdict::not_recent);
  now_ns += 1'100'000'000;
  refuses(old, LawVerdict::not_recent);
  sender->publish(channel, answer(1));  // a law that has started again
  EXPECT_TRUE(collect_until(came));
}

/// Where segments stretch the force has three numbers a segment.
class StretchingLawOverUdp : public ExternalLawOverUdp {
 protected:
  void SetUp() override {
    settings.arm.extensible = true;
    for (SegmentParameters& segment : settings.arm.segments) {
      segment.axial_stiffness_n_per_m = 4000.0;
      segment.axial_damping_ns_per_m = 185.0;
    }
    for (auto& chambers : settings.actuation.segments)
      for (Chamber& chamber : chambers) chamber.offset_m = 0.0125;
    ExternalLawOverUdp::SetUp();
  }
};

TEST_F(StretchingLawOverUdp, ItsForceHasAsManyNumbersAsTheState) {
  const std::string& channel = transport.lcm.law_channel;
  law_command_t message = answer(1);
  sender->publish(channel, message);
  EXPECT_TRUE(nothing_comes(came));
  EXPECT_EQ(refused(LawVerdict::wrong_size), 1);
  message = answer(2);
  message.num_values = 9;
  message.value = test::numbers<double>(9, 0.25);
  sender->publish(channel, message);
  EXPECT_TRUE(collect_until([&](const TickInput& input) {
    return came(input) && input.law->values.size() == 9 && input.law->values[8] == 2.25;
  }));
}

TEST_F(ExternalLawOverUdp, ATargetOfTheTipComesOnceAndInOrder) {
  tip_target_t target = test::example<tip_target_t>(3, 4);
  const std::string& channel = transport.lcm.tip_channel;
  const auto came = [](const TickInput& input) { return input.tip_target != nullptr; };
  sender->publish(channel, target);
  ASSERT_TRUE(collect_until([&](const TickInput& input) {
    if (!came(input)) return false;
    EXPECT_EQ(input.tip_target->position_m, Eigen::Vector3d(0.1, 0.2, -0.3));
    EXPECT_EQ(input.tip_target->velocity_mps, Eigen::Vector3d(0.4, 0.5, 0.6));
    return true;
  }));
  --target.sequence;
  sender->publish(channel, target);
  EXPECT_TRUE(nothing_comes(came)) << "older";
  now_ns += 600'000'000;  // of silence
  sender->publish(channel, target);
  EXPECT_TRUE(collect_until(came));
}

}  // namespace
}  // namespace softarm
