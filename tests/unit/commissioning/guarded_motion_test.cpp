// What a tool plays on an arm ends with the first fault, and reports it.
#include "commissioning/guarded_motion.hpp"

#include <functional>

#include "milliseconds.hpp"
#include "softarm/transport/mocap_source.hpp"
#include "unit/client/arcs.hpp"
#include "unit/client/client_test.hpp"

namespace softarm {
namespace {

using namespace softarm_messages;

using test::kMs;
constexpr std::int64_t kLost_ns = 5000 * kMs;

class Guarded : public test::ClientTest {
 protected:
  std::unique_ptr<ArmClient> make_client() override {
    return std::make_unique<ArmClient>(experiment, [this] { return now_ns += step_ns; });
  }
  void TearDown() override { end_client(); }
  /// It vents to rest, which takes a second of its clock.
  void end_client() {
    step_ns = kMs;
    client.reset();
    step_ns = 0;
  }
  void show(double bend_rad) {
    const std::int64_t before_ns = client->seen().arrival_ns;
    now_ns += 50 * kMs;
    MocapFrame frame = test::bent_arm(experiment.arm, bend_rad);
    frame.frame_number = now_ns / kMs;
    MocapSender(experiment.transport, experiment.arm).publish(*peer, frame, now_ns / 1000);
    ASSERT_TRUE(wait_for([&] { return client->seen().arrival_ns != before_ns; }));
  }
  /// Plays for `rounds` rounds of 10 ms.
  void play(GuardedMotion& motion, int rounds) {
    motion.command(PressureVector::Constant(3, 1.0), 2.0, [&] {
      now_ns += 10 * kMs;
      return rounds-- == 0;
    });
  }

  std::int64_t now_ns = 1'000'000 * kMs;
  std::int64_t step_ns = 0;  ///< by which the clock goes on whenever it is read
};

TEST_F(Guarded, GoesOnWhileAllIsWell) {
  client->lock_commands();
  show(0.3);
  GuardedMotion motion(*client, kLost_ns, {});
  play(motion, 11);
  EXPECT_EQ(motion.aborted(), "");
  EXPECT_NEAR(client->set_points_bar()[2], 0.2, 1e-9) << "at the rate it was given";
}

TEST_F(Guarded, EndsWithTheFirstThingThatGoesWrong) {
  bool stop = false;
  const std::function<bool()> stopped = [&] { return stop; };
  experiment.motion_limits.max_theta_rad = 0.5;
  experiment.motion_limits.max_speed_radps = 0.5;
  struct Row {
    const char* says;
    std::function<void()> happens;
  };
  for (const Row& row : {
           Row{"stopped", [&] { stop = true; }},
           Row{"held up", [&] { now_ns += 500 * kMs; }},
           Row{"a daemon is armed: HOLD (frames_late)",
               [&] {
                 publish_status(Mode::hold, Reason::frames_late);
                 ASSERT_TRUE(client->wait_for_status(test::kPatience_s));
               }},
           Row{"another program commands pressures on SOFTARM_PRESSURE_COMMAND",
               [&] {
                 peer->publish(lcm.command_channel, [] {
                   auto command = test::example<pressure_command_t>(1, 3);
                   command.shadow = 0;
                   return command;
                 }());
                 ASSERT_TRUE(wait_for([&] { return client->command()->sequence == 42; }));
               }},
           Row{"a segment bends by 0.6 rad, beyond identification.max_theta_rad of 0.5 rad",
               [&] {
                 show(0.45);
                 show(0.525);
                 show(0.6);
               }},
           Row{"a segment moves at ", [&] { show(0.49); }},
       }) {
    SCOPED_TRACE(row.says);
    stop = false;
    end_client();
    client = make_client();
    client->lock_commands();
    show(0.3);
    show(0.3);
    GuardedMotion motion(*client, kLost_ns, stopped);
    play(motion, 5);
    ASSERT_EQ(motion.aborted(), "");
    ASSERT_TRUE(wait_for([&] { return client->command().has_value(); }));
    row.happens();
    const PressureVector before_bar = client->set_points_bar();
    play(motion, 5);
    EXPECT_NE(motion.aborted().find(row.says), std::string::npos) << motion.aborted();
    EXPECT_LE((client->set_points_bar() - before_bar).maxCoeff(), 2.0 * 0.01 + 1e-9);
    const PressureVector then_bar = client->set_points_bar();
    play(motion, 5);
    EXPECT_EQ(client->set_points_bar(), then_bar) << "it does not begin again";
  }
}

TEST_F(Guarded, EndsWithoutFrames) {
  client->lock_commands();
  GuardedMotion motion(*client, 200 * kMs, {});
  play(motion, 1);
  EXPECT_EQ(motion.aborted(), "no frame with every segment for 200 ms");
}

}  // namespace
}  // namespace softarm
