// What a client makes of messages on a real socket: typed, of this arm, not of a shadow.
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "softarm/transport/mocap_source.hpp"
#include "test_folder.hpp"
#include "unit/client/arcs.hpp"
#include "unit/client/client_test.hpp"

namespace softarm {
namespace {

using namespace softarm_messages;
using test::example;

class Listening : public test::ClientTest {
 protected:
  /// Its clock stands still: nothing that came grows old while the machine is busy.
  std::unique_ptr<ArmClient> make_client() override {
    return std::make_unique<ArmClient>(experiment,
                                       [now_ns = monotonic_now_ns()] { return now_ns; });
  }
};

TEST_F(Listening, AStatusIsTyped) {
  EXPECT_FALSE(client->status());
  EXPECT_EQ(client->status_ns(), kNever);
  EXPECT_EQ(client->daemon_text(), "not heard");
  publish_status(Mode::hold, Reason::frames_late, controller_status_t::ARMED);
  ASSERT_TRUE(client->wait_for_status(test::kPatience_s));
  EXPECT_EQ(client->status()->mode, Mode::hold);
  EXPECT_EQ(client->status()->reason, Reason::frames_late);
  EXPECT_TRUE(client->status()->armed);
  EXPECT_EQ(client->status()->u_rad, (SegmentVector(2) << 1.0, 1.25).finished());
  EXPECT_EQ(client->daemon_text(), "HOLD (frames_late)");
  EXPECT_LE(client->status_ns(), client->now_ns());
}

TEST_F(Listening, AShadowHidesNothing) {
  int shadows = 0, all = 0;
  client->on_status([&](const ArmStatus& newest) {
    ++all;
    shadows += newest.shadow ? 1 : 0;
  });
  const std::int16_t armed_shadow = controller_status_t::SHADOW | controller_status_t::ARMED;
  publish_status(Mode::active, Reason::none, armed_shadow);
  ASSERT_TRUE(wait_for([&] { return shadows == 1; }));
  EXPECT_FALSE(client->status());
  EXPECT_FALSE(client->daemon_armed());
  publish_status(Mode::vent, Reason::disarmed);
  publish_status(Mode::active, Reason::none, armed_shadow);
  ASSERT_TRUE(wait_for([&] { return all == 3; }));
  EXPECT_EQ(client->daemon_text(), "VENT (disarmed)");
  EXPECT_FALSE(client->daemon_armed());
  publish_status(Mode::active, Reason::none);
  ASSERT_TRUE(wait_for([&] { return all == 4; }));
  EXPECT_TRUE(client->daemon_armed());
}

TEST_F(Listening, WhatIsNoStatusOrOfAnotherArmIsNotTaken) {
  peer->publish(lcm.status_channel, example<timing_t>(0, 0));
  peer->publish(lcm.status_channel, example<controller_status_t>(2, 3));
  publish_status(Mode::fault, Reason::emergency_stop);
  ASSERT_TRUE(client->wait_for_status(test::kPatience_s));
  EXPECT_EQ(client->status()->mode, Mode::fault);
  EXPECT_EQ(client->status()->segments(), 1);
}

TEST_F(Listening, AWaitLooksAfterEveryMessage) {
  publish_status(Mode::hold, Reason::frames_late);
  publish_status(Mode::vent, Reason::frames_stale);
  publish_status(Mode::wait_frames, Reason::waiting_for_arm);
  EXPECT_TRUE(wait_for([&] { return client->status() && client->status()->mode == Mode::vent; }))
      << "however short it was";
}

TEST_F(Listening, PressuresValvesAndASimulatedArmAreTyped) {
  int measurements = 0, plants = 0;
  client->on_measured([&](const MeasuredPressures& measured) {
    ++measurements;
    EXPECT_EQ(measured.bar.size(), 3);
  });
  client->on_plant([&](const PlantState&) { ++plants; });
  EXPECT_FALSE(client->measured() || client->valves() || client->plant());
  peer->publish(lcm.measurement_channel, example<pressure_measurement_t>(1, 3));
  peer->publish(lcm.plant_channel, example<plant_state_t>(1, 3));
  auto message = example<valves_status_t>(1, 3);
  message.state = static_cast<std::int8_t>(ValveState::running);
  message.reason = static_cast<std::int8_t>(ValveReason::stuck_valve);
  message.chamber = 2;
  peer->publish(lcm.valves_channel, message);
  ASSERT_TRUE(wait_for([&] { return client->measured() && client->valves() && client->plant(); }));
  EXPECT_EQ(measurements, 1);
  EXPECT_EQ(plants, 1);
  EXPECT_EQ(client->measured()->bar, (PressureVector(3) << 0.125, 0.375, 0.625).finished());
  EXPECT_EQ(client->valves()->state, ValveState::running);
  EXPECT_EQ(client->valves()->reason, ValveReason::stuck_valve);
  EXPECT_EQ(client->valves()->chamber, 2);
  EXPECT_EQ(client->valves()->late_cycles, 9);
  EXPECT_EQ(client->valves()->actual_bar, (PressureVector(3) << 3.0, 3.25, 3.5).finished());
  EXPECT_TRUE(client->plant()->vented);
}

TEST_F(Listening, FramesComeInTheArmsOwnOrderAndShowItsBend) {
  std::vector<std::int64_t> numbers;
  client->on_frame([&](const CapturedFrame& captured) {
    numbers.push_back(captured.frame.frame_number);
    EXPECT_EQ(captured.frame.segments, 1);
    EXPECT_LE(captured.arrival_ns, client->now_ns());
  });
  MocapSender sender(experiment.transport, experiment.arm);
  MocapFrame frame = test::bent_arm(experiment.arm, 0.4);
  const auto send = [&](std::int64_t number) {
    frame.frame_number = number;
    sender.publish(*peer, frame, 1'000'000 + 5000 * number);
  };
  send(1);
  send(1);  // again
  peer->publish(lcm.mocap_channel, example<timing_t>(0, 0));
  frame.body[1].valid = false;
  send(2);
  ASSERT_TRUE(wait_for([&] { return numbers.size() == 3 && client->not_frames() == 1; }));
  EXPECT_EQ(numbers, (std::vector<std::int64_t>{1, 1, 2}));
  EXPECT_NEAR(client->seen().bend_rad, 0.4, 1e-9);
  EXPECT_NEAR(client->seen().u_rad[0], 0.4, 1e-9);
  EXPECT_NE(client->seen().arrival_ns, kNever);
}

TEST_F(Listening, WhatACallbackThrowsReachesTheCallerAndEndsNothing) {
  client->on_status([](const ArmStatus& newest) {
    if (newest.mode == Mode::fault) throw std::runtime_error("seen");
  });
  publish_status(Mode::fault, Reason::valves_silent);
  EXPECT_THROW(client->wait_for_status(test::kPatience_s), std::runtime_error);
  publish_status(Mode::vent, Reason::disarmed);
  EXPECT_TRUE(client->wait_for_status(test::kPatience_s));
  EXPECT_EQ(client->status()->mode, Mode::vent);
}

TEST_F(Listening, WhatIsRecordedIsReadAgain) {
  const TestFolder folder;
  const auto path = folder / "log";
  client->record(path);
  std::vector<std::pair<std::string, test::Bytes>> sent;
  const auto send = [&](const std::string& channel, const auto& message) {
    peer->publish(channel, message);
    sent.emplace_back(channel, test::encoded(message));
  };
  send(lcm.status_channel, status(Mode::active, Reason::none));
  send(lcm.mocap_channel, example<mocap_frame_t>(1, 3));
  send(lcm.tick_channel, example<tick_record_t>(1, 3));
  send(lcm.operator_channel, example<operator_command_t>(1, 3));
  send(lcm.deadman_channel, example<deadman_t>(1, 3));
  send(lcm.reference_channel, example<curvature_reference_t>(1, 3));
  send(lcm.command_channel, example<pressure_command_t>(1, 3));
  send(lcm.status_channel, example<timing_t>(1, 3));  // what is malformed, too
  std::size_t messages = 0;
  client->on_message([&](const ArmMessage&) { ++messages; });
  ASSERT_TRUE(wait_for([&] { return messages == sent.size(); }));
  client->stop_recording();
  publish_status(Mode::vent, Reason::disarmed);
  ASSERT_TRUE(client->wait_for_status(test::kPatience_s));

  std::ifstream file(path, std::ios::binary);
  EventLogReader log(file);
  LogEvent event;
  const std::int64_t now_us = wall_now_ns() / 1000;
  for (const auto& [channel, bytes] : sent) {
    ASSERT_TRUE(log.next(event));
    EXPECT_EQ(event.channel, channel);
    EXPECT_TRUE(std::equal(event.data.begin(), event.data.end(), bytes.begin(), bytes.end()));
    EXPECT_LE(event.time_us, now_us);
    EXPECT_GT(event.time_us, now_us - 3'600'000'000) << "the wall clock";
  }
  EXPECT_FALSE(log.next(event)) << "not after stop_recording";
  EXPECT_EQ(log.damage_count(), 0);
}

TEST_F(Listening, ARecordThatCannotBeWrittenSaysSo) {
  EXPECT_THROW(client->record("/nowhere/log"), std::runtime_error);
  client->record("/dev/full");
  EXPECT_THROW(
      {
        publish_status(Mode::active, Reason::none);
        client->wait_for_status(test::kPatience_s);
        client->stop_recording();
      },
      std::runtime_error);
}

}  // namespace
}  // namespace softarm
