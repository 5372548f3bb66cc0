// Every finding of the pre-run check, each by the mistake that it detects: in what is seen, or in
// what is configured.
#include <gtest/gtest.h>

#include "unit/commissioning/preflight/observed.hpp"

namespace softarm {
namespace {

using test::checked;
using test::finding;
using test::for_each_body;
using test::hanging_arm;
using test::observed;

::testing::AssertionResult fails(const std::vector<Finding>& all, const std::string& check,
                                 const std::string& says) {
  const Finding one = finding(all, check);
  if (one.verdict == Verdict::fail && (one.text + one.fix).find(says) != std::string::npos)
    return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure()
         << "expected that " << check << " fails with \"" << says << "\"\n"
         << report_text(all);
}

/// No finding fails, or only this one.
::testing::AssertionResult alone(const std::vector<Finding>& all, const std::string& check = "") {
  for (const Finding& each : all)
    if (each.verdict == Verdict::fail && each.check != check)
      return ::testing::AssertionFailure() << report_text(all);
  return ::testing::AssertionSuccess();
}

TEST(Preflight, ARightArmPassesEveryCheckWithPulses) {
  const Experiment arm = hanging_arm(3);
  const std::vector<Finding> all = checked(arm, observed(arm, true));
  for (const Finding& each : all) EXPECT_EQ(each.verdict, Verdict::pass) << report_text(all);
  EXPECT_EQ(all.size(), 15U);
}

TEST(Preflight, AtRestItSaysWhatCannotBeChecked) {
  const Experiment arm = hanging_arm(2);
  const std::vector<Finding> all = checked(arm, observed(arm));
  EXPECT_TRUE(alone(all));
  for (const char* check : {"handedness", "valve map", "leaks"})
    EXPECT_EQ(finding(all, check).verdict, Verdict::not_checked) << report_text(all);
  EXPECT_EQ(obstacle_to_pulses(all), "");
}

TEST(Preflight, NoFrames) {
  const Experiment arm = hanging_arm(2);
  Observation nothing;
  nothing.channels = {"SOFTARM_MOCAP"};
  nothing.rest_end_ns = 3'000'000'000;
  const std::vector<Finding> all = checked(arm, nothing);
  EXPECT_TRUE(fails(all, "bodies", "no frame on SOFTARM_MOCAP within 3.0 s"));
  EXPECT_TRUE(alone(all, "bodies"));
  EXPECT_EQ(obstacle_to_pulses(all), "bodies");
}

TEST(Preflight, ABodyThatIsNeverSeenOrAtTimes) {
  const Experiment arm = hanging_arm(2);
  Observation seen = observed(arm);
  for (SeenFrame& frame : seen.frames) frame.body[2].valid = false;
  seen.other_ids = {7};
  EXPECT_TRUE(fails(checked(arm, seen), "bodies", "end of segment 2 (id 2) never seen"));
  EXPECT_TRUE(fails(checked(arm, seen), "bodies", "does not name ids 7"));

  seen = observed(arm);
  for (std::size_t k = 0; k < seen.frames.size(); k += 10) seen.frames[k].body[1].valid = false;
  EXPECT_TRUE(fails(checked(arm, seen), "bodies", "end of segment 1 (id 1) seen in 90.0 %"));
}

TEST(Preflight, RateAndMissingFrames) {
  Experiment arm = hanging_arm(1);
  Observation seen = observed(arm);
  Experiment configured = arm;
  configured.safety.frame_period_s = 0.01;
  EXPECT_TRUE(fails(checked(configured, seen), "rate", "frame_period_s: 0.005"));
  for (std::size_t k = seen.frames.size() - 1; k > 0; --k)
    if (k % 20 == 0) seen.frames.erase(seen.frames.begin() + static_cast<std::ptrdiff_t>(k));
  EXPECT_TRUE(fails(checked(arm, seen), "rate", "of the frames missing"));
}

TEST(Preflight, JitterThatTheDaemonWouldHoldFor) {
  const Experiment arm = hanging_arm(1);
  Observation seen = observed(arm);
  for (std::size_t k = 100; k < 110; ++k) seen.frames[k].arrival_ns = seen.frames[110].arrival_ns;
  EXPECT_TRUE(fails(checked(arm, seen), "jitter", "with a jitter of 50.0 ms"));
  EXPECT_TRUE(alone(checked(arm, seen), "jitter"));
}

TEST(Preflight, LatencyIsReportedOnlyWhereClocksAreOne) {
  const Experiment arm = hanging_arm(1);
  Observation seen = observed(arm);
  Experiment configured = arm;
  configured.safety.frame_latency_s = 0.02;
  EXPECT_TRUE(fails(checked(configured, seen), "latency", "at least 5.0 ms by our wall clock"));
  Observation elsewhere = seen;
  for (SeenFrame& frame : elsewhere.frames) frame.sender_us += 7'000'000;
  EXPECT_EQ(finding(checked(configured, elsewhere), "latency").verdict, Verdict::not_checked);
  for (SeenFrame& frame : seen.frames) frame.sender_us = 0;
  EXPECT_TRUE(fails(checked(arm, seen), "latency", "do not advance"));
}

TEST(Preflight, AnArmThatMoves) {
  const Experiment arm = hanging_arm(2);
  Observation seen = observed(arm);
  for (std::size_t k = 0; k < seen.frames.size(); k += 2)
    seen.frames[k].body[2].position_m.x() += 0.02;
  const std::vector<Finding> all = checked(arm, seen);
  EXPECT_TRUE(fails(all, "still", "of the arm's length"));
  EXPECT_EQ(finding(all, "units").verdict, Verdict::not_checked);
}

TEST(Preflight, UnitsOfLength) {
  const Experiment arm = hanging_arm(2);
  const Observation right = observed(arm);
  const auto scaled = [&](double factor) {
    Observation seen = right;
    for_each_body(seen, [&](BodyPose& body) { body.position_m *= factor; });
    return checked(arm, seen);
  };
  EXPECT_TRUE(fails(scaled(1000.0), "units", "millimetres"));
  EXPECT_TRUE(fails(scaled(1000.0), "units", "daemon.mocap.unit: mm"));
  EXPECT_TRUE(fails(scaled(100.0), "units", "centimetres"));
  EXPECT_TRUE(fails(scaled(1.0 / 0.0254), "units", "inches"));
  EXPECT_TRUE(fails(scaled(0.001), "units", "1000 times too small"));
  EXPECT_TRUE(alone(scaled(1000.0), "units"));
}

TEST(Preflight, OrderAlongTheArm) {
  const Experiment arm = hanging_arm(3);
  const Observation right = observed(arm);
  const auto swapped = [&](std::size_t a, std::size_t b) {
    Observation seen = right;
    for (SeenFrame& frame : seen.frames) std::swap(frame.body[a], frame.body[b]);
    return checked(arm, seen);
  };
  EXPECT_TRUE(fails(swapped(2, 3), "order", "end of segment 2 and end of segment 3 are exchanged"));
  EXPECT_TRUE(fails(swapped(2, 3), "order", "segment_ids: [1, 3, 2]"));
  EXPECT_TRUE(fails(swapped(0, 1), "order", "base and end of segment 1 are exchanged"));
  EXPECT_TRUE(fails(swapped(1, 3), "order", "end of segment 1 and end of segment 3 are exchanged"));
  EXPECT_TRUE(fails(swapped(0, 3), "order", "base"));
}

TEST(Preflight, LengthsOfSegments) {
  const Experiment arm = hanging_arm(3);
  Experiment configured = arm;
  configured.arm.segments[1].length_m = 0.13;
  const std::vector<Finding> all = checked(configured, observed(arm));
  EXPECT_TRUE(fails(all, "lengths", "segment 2 is 0.11"));
  EXPECT_TRUE(fails(all, "lengths", "arm.length_m: [0.11, 0.11, 0.11]"));
  EXPECT_TRUE(alone(all, "lengths"));
}

TEST(Preflight, ABentArmIsMeasuredAlongItsArc) {
  Experiment arm = hanging_arm(1);
  // Held at about 1.5 rad, where the chord is 9 % shorter than the arc.
  arm.plant.loads = {{.segment = 1, .moment_nm = {0.0, -1.0, 0.0}}};
  arm.plant.initial_u_rad << 1.5, 0.0;
  Observation seen = observed(arm);
  ASSERT_LT((seen.frames.back().body[1].position_m - seen.frames.back().body[0].position_m).norm(),
            0.104);
  EXPECT_EQ(finding(checked(arm, seen), "lengths").verdict, Verdict::pass)
      << report_text(checked(arm, seen));
}

TEST(Preflight, AWorldWithYUp) {
  const Experiment arm = hanging_arm(2);
  Observation seen = observed(arm);
  const Eigen::Quaterniond y_up(Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitX()));
  for_each_body(seen, [&](BodyPose& body) {
    body.position_m = y_up * body.position_m;
    body.orientation = y_up * body.orientation;
  });
  const std::vector<Finding> all = checked(arm, seen);
  EXPECT_TRUE(fails(all, "world axes", "points along -y"));
  EXPECT_TRUE(alone(all, "world axes"));
}

TEST(Preflight, OrderOfTheQuaternion) {
  const Experiment arm = hanging_arm(2);
  // Sent as x, y, z, w.
  const auto scalar_last = [](BodyPose& body) {
    const Eigen::Quaterniond q = body.orientation;
    body.orientation = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w());
  };
  Observation seen = observed(arm);
  for_each_body(seen, scalar_last);
  const std::vector<Finding> all = checked(arm, seen);
  EXPECT_TRUE(fails(all, "quaternions", "interchanged"));
  EXPECT_TRUE(fails(all, "quaternions", "daemon.mocap.quaternion: xyzw"));
  EXPECT_TRUE(alone(all, "quaternions"));
  EXPECT_EQ(obstacle_to_pulses(all), "quaternions");
}

TEST(Preflight, QuaternionsThatAreNone) {
  const Experiment arm = hanging_arm(2);
  Observation seen = observed(arm);
  for_each_body(seen, [](BodyPose& body) { body.orientation.coeffs() *= 57.3; });
  EXPECT_TRUE(fails(checked(arm, seen), "quaternions", "of length 57.3"));
}

TEST(Preflight, AxesOfTheBodies) {
  const Experiment arm = hanging_arm(2);
  const Observation right = observed(arm);
  const auto turned = [&](std::size_t body, double angle_rad, const Eigen::Vector3d& axis) {
    Observation seen = right;
    for (SeenFrame& frame : seen.frames)
      frame.body[body].orientation =
          frame.body[body].orientation * Eigen::AngleAxisd(angle_rad, axis);
    return checked(arm, seen);
  };
  EXPECT_TRUE(
      fails(turned(1, M_PI / 2, Eigen::Vector3d::UnitX()), "quaternions", "z of every body"));
  EXPECT_TRUE(fails(turned(2, 0.2, Eigen::Vector3d::UnitY()), "rest pose", "segment 2 reads"));
  EXPECT_TRUE(fails(turned(2, 0.2, Eigen::Vector3d::UnitZ()), "rest pose", "segment 2 is twisted"));
}

TEST(Preflight, HandednessShowsWhenTheArmBends) {
  const Experiment arm = hanging_arm(2);
  const Observation right = observed(arm, true);
  const auto corrupted = [&](const std::function<void(BodyPose&)>& corrupt) {
    Observation seen = right;
    for_each_body(seen, corrupt);
    return checked(arm, seen);
  };
  EXPECT_TRUE(fails(corrupted([](BodyPose& body) { body.position_m.y() *= -1.0; }), "handedness",
                    "positions with y reversed"));
  EXPECT_TRUE(fails(corrupted([](BodyPose& body) { body.position_m.x() *= -1.0; }), "handedness",
                    "positions with x reversed"));
  EXPECT_TRUE(
      fails(corrupted([](BodyPose& body) { body.orientation = body.orientation.conjugate(); }),
            "handedness", "world to body"));
  // z shows already at rest: the arm would point against its own axis.
  EXPECT_TRUE(fails(corrupted([](BodyPose& body) { body.position_m.z() *= -1.0; }), "handedness",
                    "positions with z reversed"));
}

// Positions and orientations mirrored alike belong together, but the chambers do not.
TEST(Preflight, AMirroredWorldShowsInTheValveMap) {
  const Experiment arm = hanging_arm(2);
  Observation seen = observed(arm, true);
  for_each_body(seen, [](BodyPose& body) {
    body.position_m.y() *= -1.0;
    const Eigen::Quaterniond q = body.orientation;
    body.orientation = Eigen::Quaterniond(q.w(), -q.x(), q.y(), -q.z());
  });
  const std::vector<Finding> all = checked(arm, seen);
  EXPECT_TRUE(fails(all, "valve map", "as in a mirror"));
  EXPECT_TRUE(alone(all, "valve map"));
}

TEST(Preflight, ValveMap) {
  const Experiment arm = hanging_arm(2);
  const Observation right = observed(arm, true);
  Experiment configured = arm;
  auto& chambers = configured.actuation.segments;

  std::swap(chambers[0][0].angle_rad, chambers[0][1].angle_rad);
  EXPECT_TRUE(fails(checked(configured, right), "valve map",
                    "chamber 1 of segment 1 acts as chamber 2 of segment 1"));
  EXPECT_TRUE(
      fails(checked(configured, right), "valve map", "valves.order: [1, 0, 2, 3, 4, 5, 6, 7]"));
  EXPECT_TRUE(alone(checked(configured, right), "valve map"));

  configured = arm;
  for (auto& segment : chambers)
    for (Chamber& chamber : segment) chamber.angle_rad += M_PI;
  EXPECT_TRUE(fails(checked(configured, right), "valve map", "bends away from a chamber"));

  configured = arm;
  chambers[1][2].gain_nm_per_bar *= 3.0;
  EXPECT_TRUE(
      fails(checked(configured, right), "valve map", "chamber 3 of segment 2 pushes with 0.3"));

  // Tubes of the two segments exchanged: the pulses went to the other one.
  Observation exchanged = right;
  for (Pulse& pulse : exchanged.pulses) {
    pulse.segment = 1 - pulse.segment;
    pulse.valve = (pulse.valve + 4) % 8;
  }
  EXPECT_TRUE(fails(checked(arm, exchanged), "valve map",
                    "chamber 1 of segment 2 acts as chamber 1 of segment 1"));
  EXPECT_TRUE(
      fails(checked(arm, exchanged), "valve map", "valves.order: [4, 5, 6, 7, 0, 1, 2, 3]"));
}

TEST(Preflight, PulsesThatEndedEarlyProveNothing) {
  const Experiment arm = hanging_arm(2);
  Observation seen = observed(arm, true);
  seen.pulses.resize(3);
  const std::vector<Finding> all = checked(arm, seen);
  EXPECT_EQ(finding(all, "valve map").verdict, Verdict::not_checked) << report_text(all);
  EXPECT_EQ(finding(all, "leaks").verdict, Verdict::not_checked) << report_text(all);
}

TEST(Preflight, AChamberWithoutAirAndAnArmWithout) {
  Experiment arm = hanging_arm(2);
  const Experiment configured = arm;
  arm.plant.actuation.segments[1][0].gain_nm_per_bar = 0.01;
  EXPECT_TRUE(fails(checked(configured, observed(arm, true)), "valve map",
                    "chamber 1 of segment 2 moves nothing"));
  for (auto& segment : arm.plant.actuation.segments)
    for (Chamber& chamber : segment) chamber.gain_nm_per_bar = 0.01;
  EXPECT_TRUE(fails(checked(configured, observed(arm, true)), "valve map", "air supply"));
}

TEST(Preflight, PressuresAndLeaks) {
  Experiment arm = hanging_arm(2);
  const Observation right = observed(arm, true);
  Observation seen = right;
  for (SeenPressures& each : seen.pressures) each.bar[5] += 0.1;
  EXPECT_TRUE(fails(checked(arm, seen), "pressures", "chamber 2 of segment 2 shows 0.100 bar"));

  seen = right;
  for (SeenPressures& each : seen.pressures) each.bar[5] *= 0.7;
  EXPECT_TRUE(fails(checked(arm, seen), "leaks", "chamber 2 of segment 2 reaches 0.077 bar of"));
  EXPECT_TRUE(alone(checked(arm, seen), "leaks"));

  seen = right;
  for (const Pulse& pulse : seen.pulses)
    for (SeenPressures& each : seen.pressures)
      if (pulse.valve == 6 && each.arrival_ns >= pulse.held_ns && each.arrival_ns < pulse.end_ns)
        each.bar[6] -= 0.3 * 1e-9 * static_cast<double>(each.arrival_ns - pulse.held_ns);
  EXPECT_TRUE(fails(checked(arm, seen), "leaks", "chamber 3 of segment 2 falls from"));

  seen = right;
  for (SeenPressures& each : seen.pressures) std::swap(each.bar[0], each.bar[7]);
  EXPECT_TRUE(fails(checked(arm, seen), "leaks",
                    "chamber 4 of segment 2 shows 0.110 bar when chamber 1 of segment 1"));

  seen.pressures.clear();
  EXPECT_EQ(finding(checked(arm, seen), "leaks").verdict, Verdict::not_checked);
  arm.safety.valve_readback = true;
  EXPECT_TRUE(fails(checked(arm, seen), "pressures", "start softarm-valves"));
}

// What the daemon would refuse, although every other check passes.
TEST(Acceptance, IsThatOfTheDaemonsOwnValidator) {
  const Experiment arm = hanging_arm(2);
  const Observation right = observed(arm);
  EXPECT_NE(finding(checked(arm, right), "bodies").text.find("the daemon accepts 100.0 %"),
            std::string::npos);

  Observation still = right;
  for (SeenFrame& frame : still.frames) frame.number = 7;
  EXPECT_TRUE(fails(checked(arm, still), "accepted", "repeated"));

  Observation two_senders = right;
  for (std::size_t k = 0; k < two_senders.frames.size(); k += 2)
    two_senders.frames[k].number += 5000;
  EXPECT_TRUE(any_failed(checked(arm, two_senders)));

  Observation turned = right;
  for (SeenFrame& frame : turned.frames)
    frame.body[2].orientation =
        frame.body[2].orientation * Eigen::AngleAxisd(1.5708, Eigen::Vector3d::UnitZ());
  EXPECT_TRUE(any_failed(checked(arm, turned)));

  Observation zero = right;
  for_each_body(zero, [](BodyPose& body) { body.orientation.coeffs().setZero(); });
  EXPECT_TRUE(any_failed(checked(arm, zero)));

  Observation late = right;
  for (SeenFrame& frame : late.frames) frame.capture_ns = frame.arrival_ns - 80 * test::kMs;
  EXPECT_TRUE(fails(checked(arm, late), "accepted", "older than max_latency_s"));

  Observation stale = right;
  for (SeenFrame& frame : stale.frames) frame.body[2] = stale.frames.front().body[2];
  EXPECT_TRUE(fails(checked(arm, stale), "accepted", "repeats an old pose"));
}

}  // namespace
}  // namespace softarm
