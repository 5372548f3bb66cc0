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

using namespace std::chrono_literals;
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

  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << told() << daemon->printed();

  const LcmSettings lcm = load_experiment(config_.string()).transport.lcm;
  const std::vector<Packet> hostile = hostile_packets(lcm);
  RawSender sender(url_);
  const std::int64_t before = status_.messages_malformed;
  const std::int64_t start_ns = monotonic_now_ns();
  for (int round = 0; round < 20; ++round) {
    for (const Packet& packet : hostile) sender.send(packet);
    wait_for([] { return false; }, 0.02);  // slowly enough for the real frames to come through
  }
  EXPECT_TRUE(wait_for([&] { return status_.messages_malformed > before + 200; })) << told();
  EXPECT_TRUE(stays_active(*this)) << told() << daemon->printed();
  const double passed_s = to_seconds(monotonic_now_ns() - start_ns);
  EXPECT_TRUE(wait_for([&] { return count(daemon->printed(), "malformed") > 0; }));
  EXPECT_LE(count(daemon->printed(), "malformed"), 2.0 + passed_s) << "told once a second at most";

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
      << told();
  stop = true;
  flood.join();
  EXPECT_TRUE(wait_for([&, asked = 0]() mutable {
    if (mode() != Mode::active && ++asked % 10 == 0)
      client_->send(mode() == Mode::fault ? OperatorRequest::disarm : OperatorRequest::arm);
    return under_pressure();
  })) << told()
      << daemon->printed();
  EXPECT_TRUE(stays_active(*this)) << told() << daemon->printed();
  expect_limits(*this);
  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(1000ms), 0) << daemon->printed();
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
    processes.push_back(start_plant(station));
    processes.push_back(station.start("softarmd"));
  }
  EXPECT_TRUE(wait_for([&] { return saw_bounded_; })) << told() << processes[1]->printed();
  EXPECT_TRUE(unreachable.wait_for([&] {
    return unreachable.saw_saturated_ && unreachable.saw_slew_limited_;
  })) << unreachable.told()
      << processes[3]->printed();
  EXPECT_TRUE(stays_active(unreachable)) << unreachable.told() << processes[3]->printed();
  EXPECT_TRUE(beyond.wait_for([&] { return beyond.saw(Mode::vent, Reason::soft_limit); }))
      << beyond.told() << processes[5]->printed();
  EXPECT_TRUE(becomes(beyond, Mode::vent, Reason::waiting_for_arm)) << beyond.told();
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
  const auto bounded = [&, asked = 0]() mutable {
    // A busy machine may drive the arm beyond its soft limit first.
    if (reason() == Reason::waiting_for_arm && ++asked % 10 == 0)
      client_->send(OperatorRequest::arm);
    return saw_bounded_;
  };
  EXPECT_TRUE(wait_for(bounded, 30.0)) << told() << daemon->printed();
  const int commands = commands_;
  EXPECT_TRUE(wait_for([&] { return commands_ > commands + 200; })) << daemon->printed();
  expect_limits(*this);
}

SOFTARM_ON_BOTH_MACHINES(MessagesAndLimits);

}  // namespace
}  // namespace softarm
