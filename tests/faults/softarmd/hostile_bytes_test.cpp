// Thousands of malformed packets (label slow: millions) while the arm is under control, and the one
// packet that no process survives.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "dev/fault/hostile_packets.hpp"
#include "faults/softarmd/fault_test.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/base/time.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
using test::FaultTest;
using test::Process;
using test::Station;

#ifdef SOFTARM_SANITIZED
constexpr bool kSanitized = true;  // a sanitizer keeps what is freed
#else
constexpr bool kSanitized = false;
#endif

class HostileBytes : public FaultTest {
 protected:
  void arm() {
    arm_when_asked();
    EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text();
    meanwhile_ = {};
  }

  bool arm_is_vented() const {
    return plant_.vented && plant_.pressure_bar.size() > 0 && largest(plant_.pressure_bar) < 1e-3F;
  }
};

/// Resident memory of a process, kB.
long resident_kb(int pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  long kb = 0;
  for (std::string line; std::getline(file, line);)
    if (std::sscanf(line.c_str(), "VmRSS: %ld kB", &kb) == 1) return kb;
  return 0;
}

TEST_P(HostileBytes, MalformedPacketsWithoutEndAreRefusedWhileTheArmIsControlled) {
  const char* wanted = std::getenv("SOFTARM_HOSTILE_PACKETS");
  const long packets = wanted != nullptr ? std::atol(wanted) : 10'000;
  lcm_ = ", deadman_channel: GO";
  validity_s_ = 0.5;
  // Thresholds that no machine reaches by being busy: whatever is seen, the packets have done.
  write_config("paper_arm.yaml",
               "  safety: {hold_after_s: 1, vent_after_s: 2, deadman_timeout_s: 2, "
               "valve_readback: true, valve_silence_s: 2, pressure_settling_s: 2, good_frames: "
               "20}\n");
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  const auto deadman = start("softarm", {"deadman"});
  arm();
  const std::int64_t before = status_.messages_malformed;
  long memory_kb = 0;
  forget();

  HostilePackets hostile(load_experiment(config_.string()).transport.lcm, 3, 12, 20261122);
  RawSender sender(url_);
  const std::int64_t start_ns = monotonic_now_ns();
  const int ticks_before = statuses_;
  for (long sent = 0; sent < packets;) {  // slowly enough for the real frames to come through
    for (int k = 0; k < 4 && sent < packets; ++k) sent += sender.send(hostile.next()) ? 1 : 0;
    client_->update(client_->now_ns() + test::kSecond / 1000);
    // LCM's buffers grow to what they need first.
    if (memory_kb == 0 && sent > packets / 10) memory_kb = resident_kb(daemon->pid());
  }
  const double passed_s = to_seconds(monotonic_now_ns() - start_ns);
  EXPECT_TRUE(stays_active(*this)) << seen_text() << daemon->printed();
  const std::int64_t refused = status_.messages_malformed - before;
  const long grown_kb = resident_kb(daemon->pid()) - memory_kb;
  std::cout << packets << " malformed packets in " << passed_s << " s, " << refused
            << " reached softarmd's decoders and were refused, " << statuses_ - ticks_before
            << " statuses; resident memory " << memory_kb << " kB after a tenth of them, "
            << grown_kb << " kB more in the end\n";
  EXPECT_GT(refused, packets / 10);
  EXPECT_LT(refused, packets);
  for (const auto& [seen_mode, seen_reason] : seen_)
    EXPECT_EQ(seen_mode, Mode::active) << name(seen_reason);
  if (!kSanitized) {
    EXPECT_LT(grown_kb, 1024);
  }
  EXPECT_TRUE(wait_for([&] { return under_pressure(); }))
      << "the plant took the daemon's commands and none of these";
  EXPECT_LT(largest(plant_.pressure_bar), 2.01F);
  EXPECT_EQ(end(*daemon), 0) << daemon->printed();
  EXPECT_EQ(plant->wait(0ms), -1) << "the plant lives" << plant->printed();
}

// A second fragment that lies about its place ends every subscriber of its channel inside LCM
// 1.3.1: daemon and valve driver. The terminal vents by its own time-out; started again, as systemd
// does, the daemon waits for frames and for a person, and commands nothing meanwhile.
TEST_P(HostileBytes, TheFragmentThatEndsEverySubscriberLeavesTheArmVentedAndTheRestartUnarmed) {
  // A busy machine must look like nothing else: at 50 Hz, with time for every answer.
  const std::string safety =
      "  safety: {arming: explicit, valve_readback: true, valve_silence_s: 2, "
      "pressure_settling_s: 2, hold_after_s: 0.5, vent_after_s: 1, good_frames: 20}\n";
  write_config("paper_arm_modbus.yaml", safety);
  const auto plant = start_terminal();
  const int port = plant->port();
  ASSERT_GT(port, 0) << plant->printed();
  write_config("paper_arm_modbus.yaml", safety,
               "valves: {port: " + std::to_string(port) +
                   ", rate_hz: 50, response_timeout_s: 0.019, tolerated_failures: 2, "
                   "failsafe_timeout_s: 0.3}\n");
  auto valves = start("softarm-valves");
  auto daemon = start("softarmd");
  arm();

  client_.reset();  // it would end us as well
  RawSender sender(url_);
  for (const char* channel : {"SOFTARM_MOCAP", "SOFTARM_PRESSURE_COMMAND"})
    for (const Packet& packet : fragments_that_end_subscribers(channel)) sender.send(packet);
  const int ended = daemon->wait(20s);
  if (ended == -1) GTEST_SKIP() << "this LCM survives the fragment";
  EXPECT_NE(ended, 0) << "a supervisor must see a failure";
  EXPECT_GT(valves->wait(60s), 0);
  EXPECT_EQ(plant->wait(0ms), -1) << "a process without subscriptions survives";

  plant_ = {};
  listen();
  EXPECT_TRUE(wait_for([&] { return arm_is_vented(); })) << plant->printed();

  status_ = {};
  statuses_ = commands_ = 0;
  forget();
  daemon = start("softarmd");
  valves = start("softarm-valves");
  EXPECT_TRUE(wait_for([&] {
    return mode() == Mode::wait_frames && reason() == Reason::waiting_for_arm && statuses_ > 200;
  })) << seen_text()
      << daemon->printed();
  EXPECT_FALSE(saw(Mode::active, Reason::none)) << "it was not armed";
  EXPECT_GT(commands_, 0);
  EXPECT_EQ(largest(command_.pressure_bar), 0.0F);
  EXPECT_TRUE(arm_is_vented() || largest(plant_.pressure_bar) < 1e-3F);
  arm();
}

INSTANTIATE_TEST_SUITE_P(AsItIs, HostileBytes, ::testing::Values(test::Machine::idle));

}  // namespace
}  // namespace softarm
