// The fault injector makes the faults it names: judged by the verdicts of the frame validator.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "dev/fault/fault_injector.hpp"
#include "softarm/estimation/frame_validator.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/transport/mocap_adapter.hpp"
#include "softarm/transport/settings.hpp"
#include "softarm/transport/softarm_mocap.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kPeriod_ns = 5'000'000;

/// An arm of three segments that swings slowly, seen exactly.
class Injector : public ::testing::Test {
 protected:
  Injector() {
    arm.segments.resize(3);
    bodies.segment_ids = {1, 2, 3};
  }

  softarm_messages::mocap_frame_t sent(std::int64_t number) const {
    SegmentVector u(6);
    const double phi = 0.01 * static_cast<double>(number);
    for (int i = 0; i < 3; ++i) u.segment<2>(2 * i) << 0.5 * std::cos(phi), 0.5 * std::sin(phi);
    MocapFrame frame;
    frame.frame_number = number;
    frame.segments = 3;
    frame.body[0] = {arm.base_position_m, Eigen::Quaterniond(arm.base_rotation), true};
    std::array<Eigen::Isometry3d, 3> ends;
    forward_kinematics(arm, u, ends);
    for (std::size_t i = 0; i < 3; ++i)
      frame.body[i + 1] = {ends[i].translation(), Eigen::Quaterniond(ends[i].linear()), true};
    softarm_messages::mocap_frame_t message;
    const auto passed = std::make_unique<SentFrame>();
    MocapAdapter(bodies, arm).to_sent(frame, number * kPeriod_ns / 1000, *passed);
    to_message(*passed, message);
    return message;
  }

  /// Twenty healthy frames, then forty with the fault: how many verdicts of each kind these got.
  std::map<FrameVerdict, int> verdicts(const char* fault) const {
    const EstimationSettings settings;
    FrameValidator validator(settings, arm, body_noise(settings, 3));
    const MocapAdapter adapter(bodies, arm);
    FaultInjector injector;
    std::map<FrameVerdict, int> found;
    for (std::int64_t k = 1; k <= 60; ++k) {
      if (k == 21) {
        Fault chosen = *find_fault(fault);
        chosen.body = 2;
        injector.set(chosen);
      }
      injector.take(sent(100 + k), k * kPeriod_ns);
      softarm_messages::mocap_frame_t message;
      while (injector.next(k * kPeriod_ns, message)) {
        MocapFrame frame;
        const auto passed = std::make_unique<SentFrame>();
        to_sent(message, *passed);
        adapter.to_frame(*passed, frame);
        frame.capture_ns = message.capture_time_us * 1000;
        const FrameVerdict verdict = validator.accept(frame);
        if (k > 20) ++found[verdict];
      }
    }
    return found;
  }

  ArmParameters arm;
  BodySettings bodies;
};

using Verdicts = std::map<FrameVerdict, int>;

TEST_F(Injector, MakesTheFaultsItNames) {
  EXPECT_EQ(verdicts("stop"), Verdicts());
  EXPECT_EQ(verdicts("nan"), (Verdicts{{FrameVerdict::not_finite, 40}}));
  EXPECT_EQ(verdicts("inf"), (Verdicts{{FrameVerdict::not_finite, 40}}));
  EXPECT_EQ(verdicts("quaternion"), (Verdicts{{FrameVerdict::bad_quaternion, 40}}));
  EXPECT_EQ(verdicts("length"), (Verdicts{{FrameVerdict::bad_length, 40}}));
  EXPECT_EQ(verdicts("duplicate"),
            (Verdicts{{FrameVerdict::accepted, 40}, {FrameVerdict::repeated, 40}}));
  EXPECT_EQ(verdicts("reorder"),
            (Verdicts{{FrameVerdict::accepted, 20}, {FrameVerdict::out_of_order, 20}}));
  EXPECT_EQ(verdicts("jump"), (Verdicts{{FrameVerdict::accepted, 20}, {FrameVerdict::jump, 20}}));
  EXPECT_EQ(verdicts("restart"),
            (Verdicts{{FrameVerdict::accepted, 39}, {FrameVerdict::sender_restarted, 1}}));
  EXPECT_EQ(verdicts("freeze"), (Verdicts{{FrameVerdict::accepted, 40}}));
  EXPECT_EQ(verdicts("occlude"), (Verdicts{{FrameVerdict::accepted, 40}})) << "one segment is seen";
  EXPECT_EQ(verdicts("turn"), (Verdicts{{FrameVerdict::bad_torsion, 40}}));
  EXPECT_GT(verdicts("stale")[FrameVerdict::accepted], 0) << "its segment is not seen";
  const Verdicts swapped = verdicts("swap");
  EXPECT_EQ(swapped.count(FrameVerdict::accepted), 0u);
}

TEST_F(Injector, DelaysInOrderAndFreezesThePoses) {
  FaultInjector injector;
  Fault delay = *find_fault("delay");
  delay.amount = 0.05;
  injector.set(delay);
  softarm_messages::mocap_frame_t message;
  injector.take(sent(1), 0);
  injector.take(sent(2), kPeriod_ns);
  EXPECT_FALSE(injector.next(49'999'999, message));
  EXPECT_EQ(injector.next_due_ns(), 50'000'000);
  ASSERT_TRUE(injector.next(50'000'000, message));
  EXPECT_EQ(message.frame_number, 1);
  injector.set({});
  injector.take(sent(3), 2 * kPeriod_ns);
  ASSERT_TRUE(injector.next(60'000'000, message));
  EXPECT_EQ(message.frame_number, 2) << "a frame without delay does not overtake";

  injector.set(*find_fault("freeze"));
  injector.take(sent(4), 0);
  injector.take(sent(5), 0);
  while (injector.next(60'000'000, message) && message.frame_number < 4) {
  }
  const double before = message.bodies[3].position_m[0];
  ASSERT_TRUE(injector.next(60'000'000, message));
  EXPECT_EQ(message.frame_number, 5);
  EXPECT_EQ(message.bodies[3].position_m[0], before);
}

TEST_F(Injector, NumbersBeginAgainAlsoAfterTheSenderItselfDid) {
  FaultInjector injector;
  softarm_messages::mocap_frame_t message;
  const auto number_of = [&](std::int64_t number) {
    injector.take(sent(number), 0);
    EXPECT_TRUE(injector.next(0, message));
    return message.frame_number;
  };
  number_of(5000);
  injector.set(*find_fault("restart"));
  EXPECT_EQ(number_of(5001), 1);
  EXPECT_EQ(number_of(5002), 2);
  EXPECT_EQ(number_of(1), 1) << "another sender";
  EXPECT_EQ(number_of(300), 300);
  injector.set(*find_fault("restart"));
  EXPECT_EQ(number_of(301), 1) << "numbers go back, not on from below zero";
}

TEST_F(Injector, CorruptsPressures) {
  FaultInjector injector;
  softarm_messages::pressure_measurement_t measured{};
  measured.pressure_bar = {1.0F, 2.0F, 3.0F};
  EXPECT_TRUE(injector.pass(measured));
  Fault burst = *find_fault("burst");
  burst.body = 2;
  injector.set(burst);
  EXPECT_TRUE(injector.pass(measured));
  EXPECT_EQ(measured.pressure_bar, (std::vector<float>{1.0F, 2.0F, 0.0F}));
  Fault leak = *find_fault("leak");
  leak.body = 1;
  leak.amount = 0.25;
  injector.set(leak);
  EXPECT_TRUE(injector.pass(measured));
  EXPECT_EQ(measured.pressure_bar, (std::vector<float>{1.0F, 1.5F, 0.0F}));
  Fault stick = *find_fault("stick");
  stick.body = 0;
  injector.set(stick);
  EXPECT_TRUE(injector.pass(measured));
  measured.pressure_bar[0] = 0.5F;
  EXPECT_TRUE(injector.pass(measured));
  EXPECT_EQ(measured.pressure_bar[0], 1.0F);
  injector.set(*find_fault("silence"));
  EXPECT_FALSE(injector.pass(measured));
}

TEST_F(Injector, MirrorsPositionsAlone) {
  const softarm_messages::mocap_frame_t right = sent(1);
  FaultInjector injector;
  injector.set(*find_fault("mirror"));
  injector.take(right, 0);
  softarm_messages::mocap_frame_t frame;
  ASSERT_TRUE(injector.next(0, frame));
  for (std::size_t i = 0; i < right.bodies.size(); ++i) {
    const auto& body = right.bodies[i];
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_EQ(frame.bodies[i].position_m[axis], (axis == 1 ? -1.0 : 1.0) * body.position_m[axis]);
    for (int k = 0; k < 4; ++k) EXPECT_EQ(frame.bodies[i].orientation[k], body.orientation[k]);
  }
}

TEST(Faults, HaveDistinctNames) {
  for (const FaultDescription& each : fault_list()) {
    ASSERT_TRUE(find_fault(each.name));
    EXPECT_EQ(find_fault(each.name)->kind, each.kind) << each.name;
  }
  EXPECT_FALSE(find_fault("no such fault"));
}

}  // namespace
}  // namespace softarm
