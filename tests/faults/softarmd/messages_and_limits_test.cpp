// Bytes that are no message, more of them than anybody can read, and references that lead to where
// the arm cannot or must not go.
#include <atomic>
#include <chrono>
#include <thread>

#include "dev/fault/raw_packets.hpp"
#include "faults/softarmd/fault_test.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

using test::FaultTest;
using test::Station;

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t found = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1))
    ++found;
  return found;
}

class MessagesAndLimits : public FaultTest {};

TEST_P(MessagesAndLimits, HostileBytesAndAFloodAreCountedAndHarmless) {
  lcm_ = ", deadman_channel: GO";
  configure(*this, ", valve_readback: true");
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  const auto deadman = start("softarm", {"deadman"});
  arm_when_asked();
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text() << daemon->printed();

  const LcmSettings lcm = load_experiment(config_.string()).transport.lcm;
  const std::vector<Packet> hostile = hostile_packets(lcm);
  RawSender sender(url_);
  const std::int64_t before = status_.messages_malformed;
  const std::int64_t start_ns = monotonic_now_ns();
  for (int round = 0; round < 20; ++round) {
    for (const Packet& packet : hostile) sender.send(packet);
    go_on(0.02);  // slowly enough for the real frames to come through
  }
  EXPECT_TRUE(wait_for([&] { return status_.messages_malformed > before + 200; })) << seen_text();
  EXPECT_TRUE(stays_active(*this)) << seen_text() << daemon->printed();
  const double passed_s = to_seconds(monotonic_now_ns() - start_ns);
  EXPECT_TRUE(wait_for([&] { return count(daemon->printed(), "malformed") > 0; }));
  EXPECT_LE(count(daemon->printed(), "malformed"), 2.0 + passed_s)
      << "reported at most once a second";

  // As fast as it goes: the daemon keeps ticking, and is back when it is over. What it needs to
  // hear may be lost meanwhile, so it may ask for an operator.
  const Packet garbage = lcm_packet("SOFTARM_MOCAP", Packet(100, std::byte{7}));
  std::atomic<bool> stop{false};
  std::thread flood([&] {
    while (!stop)
      for (int k = 0; k < 100; ++k) sender.send(garbage);
  });
  const std::int64_t tick = status_.tick;
  const int commands = commands_;
  EXPECT_TRUE(wait_for([&] { return status_.tick > tick + 500 && commands_ > commands; }))
      << seen_text();
  stop = true;
  flood.join();
  EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text() << daemon->printed();
  EXPECT_TRUE(stays_active(*this)) << seen_text() << daemon->printed();
  expect_limits(*this);
  EXPECT_EQ(end(*daemon), 0) << daemon->printed();
}

TEST_P(MessagesAndLimits, ReferencesOutOfReachAndThroughTheStraightPoseStayBounded) {
  // In polar coordinates, through theta = 0 and back.
  const char* polar =
      "control: {coordinates: polar, kp_nm_per_rad: [[0.5, 1], [0.5, 1], [0.5, 1]]}\n"
      "reference:\n"
      "  - kind: way_points\n    repeat: true\n    points:\n"
      "      - {time_s: 0, theta_rad: 0.2}\n      - {time_s: 0.5, theta_rad: -0.2}\n"
      "      - {time_s: 1, theta_rad: 0.2}\n";
  // More than the chambers give, and faster than they fill.
  const char* far =
      "actuation: {max_pressure_bar: 0.5, slew_bar_per_s: 3}\n"
      "control: {max_theta_rad: 2}\n"
      "reference:\n"
      "  - kind: way_points\n    repeat: true\n    points:\n"
      "      - {time_s: 0, theta_rad: 0}\n      - {time_s: 0.4, theta_rad: 1.9}\n"
      "      - {time_s: 0.8, theta_rad: 0}\n";
  // Something pushes the arm beyond its soft limit.
  const char* pushed = "control: {max_theta_rad: 0.5}\nplant: {tip_force_n: [3, 0, 0]}\n";
  Station unreachable, beyond;
  Station* stations[] = {this, &unreachable, &beyond};
  const char* settings[] = {polar, far, pushed};
  std::vector<std::unique_ptr<test::Process>> processes;
  for (int k = 0; k < 3; ++k) {
    Station& station = *stations[k];
    configure(station, "", "", settings[k]);
    if (k > 0) station.listen();
    if (k < 2) station.arm_when_asked();
    processes.push_back(start_plant(station));
    processes.push_back(station.start("softarmd"));
  }
  EXPECT_TRUE(wait_for([&] { return saw_bounded_; })) << seen_text() << processes[1]->printed();
  EXPECT_TRUE(unreachable.wait_for([&] {
    return unreachable.saw_saturated_ && unreachable.saw_slew_limited_;
  })) << unreachable.seen_text()
      << processes[3]->printed();
  EXPECT_TRUE(stays_active(unreachable)) << unreachable.seen_text() << processes[3]->printed();
  EXPECT_TRUE(beyond.wait_for([&] { return beyond.saw(Mode::vent, Reason::soft_limit); }))
      << beyond.seen_text() << processes[5]->printed();
  EXPECT_TRUE(becomes(beyond, Mode::vent, Reason::waiting_for_arm)) << beyond.seen_text();
  for (const Station* station : stations) expect_limits(*station);
}

// The paper's A (15) is singular at theta = pi: a soft arm is led there.
TEST_P(MessagesAndLimits, TheSingularPoseOfTheCouplesStaysBounded) {
  configure(*this, "", "",
            "arm: {actuation_model: couple, stiffness_nm_per_rad: 0.3}\n"
            "control: {max_theta_rad: 3.3}\n"
            "reference:\n"
            "  - kind: way_points\n    repeat: true\n    points:\n"
            "      - {time_s: 0, theta_rad: 0}\n      - {time_s: 2, theta_rad: 3.1}\n"
            "      - {time_s: 4, theta_rad: 0}\n");
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  arm_when_asked();
  EXPECT_TRUE(wait_for([&] { return saw_bounded_; })) << seen_text() << daemon->printed();
  const int commands = commands_;
  EXPECT_TRUE(wait_for([&] { return commands_ > commands + 200; })) << daemon->printed();
  expect_limits(*this);
}

SOFTARM_ON_BOTH_MACHINES(MessagesAndLimits);

}  // namespace
}  // namespace softarm
