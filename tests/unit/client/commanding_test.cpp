// Commands of a client as the valves hear them, on a clock that the test sets.
#include <cmath>

#include "milliseconds.hpp"
#include "softarm/base/instance_lock.hpp"
#include "suspended_clock.hpp"
#include "unit/client/client_test.hpp"

namespace softarm {
namespace {

using namespace softarm_messages;

using test::kMs;

class Commanding : public test::ClientTest {
 protected:
  std::unique_ptr<ArmClient> make_client() override {
    return std::make_unique<ArmClient>(experiment, [this] { return now_ns += step_ns; });
  }
  void SetUp() override {
    ClientTest::SetUp();
    if (!IsSkipped()) sent = peer_hears<pressure_command_t>(lcm.command_channel);
  }
  void TearDown() override {
    step_ns = kMs;  // where it has to vent, that takes a second of its clock
    client.reset();
  }
  /// The valves hear so many commands.
  bool arrive(std::size_t count) {
    return wait_for([&] { return sent->size() >= count; });
  }

  std::int64_t now_ns = 1'000'000 * kMs;
  std::int64_t step_ns = 0;  ///< by which the clock goes on whenever it is read
  std::shared_ptr<std::vector<pressure_command_t>> sent;
};

TEST_F(Commanding, NeedsTheLockChambersAndTheRightSize) {
  const PressureVector bar = PressureVector::Zero(3);
  EXPECT_THROW(client->command_chambers(bar), std::logic_error);
  EXPECT_THROW(client->vent(), std::logic_error);
  client->vent_to_rest();  // there is nothing to vent
  client->lock_commands();
  EXPECT_THROW(client->lock_commands(), std::logic_error);
  EXPECT_THROW(client->command_chambers(PressureVector::Zero(4)), std::invalid_argument);
  client->command_chambers(bar);
  ASSERT_TRUE(arrive(1));
  EXPECT_EQ(sent->front().num_chambers, 3);
  set_torque_actuation(experiment.actuation, 1, 0.5);
  EXPECT_THROW(ArmClient(experiment).lock_commands(), std::logic_error);
}

// The valves were vented meanwhile, by their own clock.
TEST_F(Commanding, BeginsAtZeroAfterASuspend) {
#ifndef SOFTARM_SETS_CLOCK
  GTEST_SKIP() << "a sanitizer brings its own clock_gettime";
#endif
  step_ns = kMs;
  client->lock_commands();
  const PressureVector wanted = PressureVector::Constant(3, 1.0);
  while (client->set_points_bar()[0] < 0.5) client->command_chambers(wanted);
  EXPECT_FALSE(client->held_up());
  test::suspended_ns += 60'000 * kMs;
  client->command_chambers(wanted);
  EXPECT_LT(client->set_points_bar()[0], 0.1);
  EXPECT_TRUE(client->held_up());
}

TEST_F(Commanding, BeginsAtZeroWhereTheValvesReportThatTheyHaveVented) {
  step_ns = kMs;
  client->lock_commands();
  auto measurement = test::example<pressure_measurement_t>(1, 3);
  peer->publish(lcm.measurement_channel, measurement);
  ASSERT_TRUE(wait_for([&] { return client->measured().has_value(); }));
  const PressureVector wanted = PressureVector::Constant(3, 1.0);
  while (client->set_points_bar()[0] < 0.5) client->command_chambers(wanted);
  ++measurement.expired;
  measurement.pressure_bar[0] += 0.5F;
  const double reported = static_cast<double>(measurement.pressure_bar[0]);
  peer->publish(lcm.measurement_channel, measurement);
  ASSERT_TRUE(wait_for([&] { return client->measured()->bar[0] == reported; }));
  EXPECT_EQ(client->set_points_bar()[0], 0.0);
  EXPECT_TRUE(client->held_up());
}

TEST_F(Commanding, IsForOneAtATime) {
  client->lock_commands();
  ArmClient second(experiment);
  EXPECT_THROW(second.lock_commands(), OtherInstance);
  EXPECT_THROW(InstanceLock(lock_name(lcm.command_channel, lcm.url)), OtherInstance)
      << "the lock is softarmd's own";
  client.reset();
  second.lock_commands();
}

TEST_F(Commanding, LimitsHoldOnTheWireAndAStallBeginsAtZero) {
  client->lock_commands();
  PressureVector wanted = PressureVector::Constant(3, 9.0);
  wanted[1] = std::nan("");
  for (int k = 0; k < 60; ++k, now_ns += 10 * kMs) {
    client->command_chambers(wanted);
    client->command_chambers(wanted);  // not due yet
  }
  ASSERT_TRUE(arrive(60));
  EXPECT_EQ(sent->size(), 60u);
  for (std::size_t k = 0; k < 60; ++k) {
    const auto& command = (*sent)[k];
    const double expected_bar = std::min(1.5, 0.04 * static_cast<double>(k));
    EXPECT_NEAR(static_cast<double>(command.pressure_bar[0]), expected_bar, 1e-6) << k;
    EXPECT_EQ(command.pressure_bar[1], 0.0F) << "not a number moves nothing";
    EXPECT_EQ(command.sequence, static_cast<std::int64_t>(k) + 1);
    EXPECT_EQ(command.validity_us, 100'000);
    EXPECT_EQ(command.shadow, 0);
  }
  EXPECT_EQ(client->set_points_bar()[0], 1.5);
  EXPECT_FALSE(client->held_up());

  now_ns += 100 * kMs;
  client->command_chambers(wanted);
  ASSERT_TRUE(arrive(61));
  EXPECT_EQ(sent->back().pressure_bar[0], 0.0F) << "the valves have vented meanwhile";
  EXPECT_TRUE(client->held_up());
}

TEST_F(Commanding, EndsVented) {
  client->lock_commands();
  for (int k = 0; k < 20; ++k, now_ns += 10 * kMs)
    client->command_chambers(PressureVector::Constant(3, 1.0));
  ASSERT_TRUE(arrive(20));
  EXPECT_GT(sent->back().pressure_bar[0], 0.5F);
  step_ns = kMs;
  bool called = false;
  client->on_command([&](const ChamberCommand&) { called = true; });
  client.reset();
  EXPECT_FALSE(called) << "what a callback refers to may be gone";
  ASSERT_TRUE([&] {
    for (int k = 0; k < 100 && (sent->empty() || sent->back().pressure_bar[0] > 0.0F); ++k)
      peer->wait_until(monotonic_now_ns() + 20 * kMs);
    peer->drain(1000);
    return sent->back().pressure_bar[0] == 0.0F;
  }());
  std::size_t zeros = 0;
  for (const auto& command : *sent) zeros += command.pressure_bar[0] == 0.0F ? 1 : 0;
  EXPECT_GT(zeros, 20u) << "for a second, that one that is lost is no harm";
  for (std::size_t k = 21; k < sent->size(); ++k)
    EXPECT_LE((*sent)[k].pressure_bar[0], (*sent)[k - 1].pressure_bar[0]);
}

TEST_F(Commanding, OthersAreNoticedAndOneselfIsNot) {
  std::size_t heard = 0;
  client->on_command([&](const ChamberCommand&) { ++heard; });
  const auto publish = [&](std::int64_t sequence, bool shadow) {
    auto command = test::example<pressure_command_t>(1, 3);
    command.sequence = sequence;
    command.shadow = shadow ? 1 : 0;
    peer->publish(lcm.command_channel, command);
  };
  publish(1, true);
  ASSERT_TRUE(wait_for([&] { return heard == 1; }));
  EXPECT_EQ(client->other_commander(), "") << "a shadow's";
  client->lock_commands();
  for (int k = 0; k < 5; ++k, now_ns += 10 * kMs) client->vent();
  ASSERT_TRUE(wait_for([&] { return heard == 6; }));
  EXPECT_EQ(client->other_commander(), "") << "our own";
  EXPECT_EQ(client->command()->sequence, 5);
  publish(3, false);
  ASSERT_TRUE(wait_for([&] { return heard == 7; }));
  EXPECT_NE(client->other_commander().find(lcm.command_channel), std::string::npos);
  now_ns += 1001 * kMs;
  EXPECT_EQ(client->other_commander(), "") << "it has fallen silent";
  publish_status(Mode::vent, Reason::waiting_for_arm);
  ASSERT_TRUE(client->wait_for_status(test::kPatience_s));
  EXPECT_EQ(client->other_commander(), "") << "a daemon that is not armed";
  publish_status(Mode::vent, Reason::waiting_for_frames, controller_status_t::ARMED);
  ASSERT_TRUE(client->wait_for_status(test::kPatience_s));
  EXPECT_NE(client->other_commander().find("VENT (waiting_for_frames)"), std::string::npos);
  now_ns += 1001 * kMs;
  EXPECT_EQ(client->other_commander(), "") << "a daemon that is heard no longer";
}

}  // namespace
}  // namespace softarm
