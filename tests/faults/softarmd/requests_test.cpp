// Requests that are lost, late, repeated, recorded or of somebody else, on the wire.
#include <fcntl.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <softarm_messages/deadman_t.hpp>
#include <softarm_messages/operator_command_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>

#include "dev/clock/preloaded_clocks.hpp"
#include "faults/softarmd/fault_test.hpp"
#include "softarm/transport/message_decoding.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
using softarm_messages::operator_command_t;
using test::FaultTest;
using test::Process;

class RequestFaults : public FaultTest {
 protected:
  void SetUp() override {
    FaultTest::SetUp();
    if (!IsSkipped()) node_ = std::make_unique<LcmNode>(url_);
  }
  int ask(const char* command) { return start("softarm", {command})->wait(20s); }
  void stop_for(const Process& process, double seconds) {
    process.signal(SIGSTOP);
    wait_for([] { return false; }, seconds);
  }
  /// Nothing that comes from now on, until time_s have passed, shows ACTIVE.
  bool stays_away(double time_s) {
    forget();
    wait_for([] { return false; }, time_s);
    for (const auto& [mode, reason] : seen_)
      if (mode == Mode::active) return false;
    return true;
  }
  void arm_again() {
    ask_until_done(*this, OperatorRequest::disarm);
    EXPECT_TRUE(wait_for([&] {
      return mode() == Mode::vent && reason() == Reason::waiting_for_arm;
    })) << seen_text();
    ask_until_done(*this, OperatorRequest::arm);
    EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text();
  }
  const LcmSettings& lcm() const { return client_->experiment().transport.lcm; }

  std::unique_ptr<LcmNode> node_;
};

TEST_P(RequestFaults, AnEmergencyStopReachesADaemonThatIsHeldUp) {
  configure(*this);
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  for (const double seconds : {0.1, 0.5, 2.0, 5.0}) {  // the tool waits for less at most times
    SCOPED_TRACE(seconds);
    ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text() << daemon->printed();
    daemon->signal(SIGSTOP);
    wait_for([] { return false; }, 0.5 * seconds);
    const auto stop = start("softarm", {"estop"});
    wait_for([] { return false; }, 0.5 * seconds);
    daemon->signal(SIGCONT);
    EXPECT_TRUE(becomes(*this, Mode::fault, Reason::emergency_stop)) << seen_text();
    EXPECT_EQ(stop->wait(20s), 0) << stop->printed();
    EXPECT_TRUE(stays_away(1.5)) << seen_text();
    arm_again();
  }
}

TEST_P(RequestFaults, WithoutADaemonTheStopGoesOnUntilSomebodyEndsIt) {
  const auto stop = start("softarm", {"estop"});
  EXPECT_TRUE(
      wait_for([&] { return stop->printed().find("waiting for FAULT") != std::string::npos; }));
  EXPECT_FALSE(wait_for([] { return false; }, 2.5));
  configure(*this);
  const auto daemon = start("softarmd");
  EXPECT_TRUE(becomes(*this, Mode::fault, Reason::emergency_stop)) << daemon->printed();
  EXPECT_EQ(stop->wait(20s), 0) << stop->printed();
  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(5s), 0) << daemon->printed();
  const auto other = start("softarm", {"estop"});
  EXPECT_TRUE(
      wait_for([&] { return other->printed().find("waiting for FAULT") != std::string::npos; }));
  other->signal(SIGINT);
  EXPECT_EQ(other->wait(20s), 1) << other->printed();
}

// One message only, and it does not fit into the socket any more.
TEST_P(RequestFaults, AStopThatTheSocketDroppedLeavesTheArmVented) {
  configure(*this);
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  daemon->signal(SIGSTOP);
  const std::vector<std::byte> much(1400, std::byte{0});
  for (int k = 0; k < 10'000; ++k) node_->publish_encoded("NOISE", much);
  client_->send(OperatorRequest::emergency_stop);
  wait_for([] { return false; }, 0.5);
  forget();
  daemon->signal(SIGCONT);
  EXPECT_TRUE(wait_for([&] { return saw(Mode::vent, Reason::requests_lost); })) << seen_text();
  EXPECT_TRUE(becomes(*this, Mode::vent, Reason::waiting_for_arm)) << seen_text();
  EXPECT_TRUE(stays_away(1.0)) << seen_text();
  EXPECT_EQ(ask("arm"), 0);
  EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text();
}

TEST_P(RequestFaults, AFloodOfRequestsNeitherHidesNorUndoesAnEmergencyStop) {
  configure(*this);
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  for (const int times_ms : {5, 0}) {
    std::atomic<bool> ends{false};
    std::thread flood([&] {
      LcmNode node(url_);
      for (std::int64_t k = 1; !ends; ++k) {
        node.publish(lcm().operator_channel,
                     operator_command_t{.sequence = k, .nonce = 0, .request = k % 2 == 0});
        if (times_ms > 0) std::this_thread::sleep_for(std::chrono::milliseconds(times_ms));
      }
    });
    EXPECT_EQ(ask("estop"), 0);
    EXPECT_TRUE(becomes(*this, Mode::fault, Reason::emergency_stop)) << seen_text();
    forget();
    wait_for([] { return false; }, 1.0);
    EXPECT_EQ(seen_.size(), 1u) << seen_text();
    ends = true;
    flood.join();
    EXPECT_EQ(ask("disarm"), 0);
    EXPECT_EQ(ask("arm"), 0) << seen_text();
    ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text();
  }
}

TEST_P(RequestFaults, AnEmergencyStopSurvivesTheDaemon) {
  configure(*this);
  const auto plant = start_plant(*this);
  auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  EXPECT_EQ(ask("estop"), 0);
  for (const int signal : {SIGKILL, SIGTERM}) {
    SCOPED_TRACE(signal);
    daemon->signal(signal);
    daemon->wait(5s);
    statuses_ = 0;
    forget();
    daemon = start("softarmd");
    ASSERT_TRUE(becomes(*this, Mode::fault, Reason::emergency_stop)) << daemon->printed();
    EXPECT_TRUE(wait_for([&] {
      return daemon->printed().find("softarm disarm " + config_.string()) != std::string::npos;
    })) << daemon->printed();
    EXPECT_EQ(ask("arm"), 1);
    EXPECT_TRUE(stays_away(1.0)) << seen_text();
  }
  arm_again();
  // Acknowledged: the next one knows nothing of it.
  daemon->signal(SIGKILL);
  daemon->wait(5s);
  statuses_ = 0;
  daemon = start("softarmd");
  EXPECT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text() << daemon->printed();
}

// Whoever has seen FAULT may rely on it, at once and on a slow disk.
TEST_P(RequestFaults, AnEmergencyStopThatWasReportedIsKept) {
#ifdef SOFTARM_SANITIZED
  GTEST_SKIP() << "a sanitizer's runtime must be loaded first";
#endif
  configure(*this);
  PreloadedClocks clocks((folder_ / "clocks").string());
  ASSERT_TRUE(clocks.made());
  std::vector<std::string> preloaded = clocks.preload();
  preloaded.push_back(std::string(SOFTARM_BINARY_DIR) + "/bin/softarmd");
  auto daemon = start("/env", preloaded);
  ASSERT_TRUE(wait_for([&] { return mode() == Mode::wait_frames; })) << daemon->printed();
  clocks.slow_disk(test::kSecond / 5);
  client_->send(OperatorRequest::emergency_stop);
  ASSERT_TRUE(becomes(*this, Mode::fault, Reason::emergency_stop)) << daemon->printed();
  daemon->signal(SIGKILL);
  daemon->wait(5s);
  client_->update(client_->now_ns());  // its last statuses
  statuses_ = 0;
  forget();
  daemon = start("softarmd");
  EXPECT_TRUE(wait_for([&] { return statuses_ > 0; }));
  EXPECT_EQ(seen_.size(), 1u) << seen_text();
  EXPECT_TRUE(saw(Mode::fault, Reason::emergency_stop)) << seen_text();
}

TEST_P(RequestFaults, WhereTheFaultCannotBeKeptThatIsReported) {
  const std::filesystem::path taken = folder_ / "softarm";
  std::ofstream(taken) << "a file where the folder should be";
  configure(*this);
  const auto daemon = start("softarmd");
  EXPECT_TRUE(wait_for([&] {
    return daemon->printed().find("a FAULT will be forgotten") != std::string::npos;
  })) << daemon->printed();
  EXPECT_NE(daemon->printed().find(taken.string()), std::string::npos) << daemon->printed();
  EXPECT_TRUE(wait_for([&] { return mode() == Mode::wait_frames; }));
}

// The key was pressed before; what kept the daemon from obeying is gone.
TEST_P(RequestFaults, AnArmIsNotObeyedAfterALaterDisarmOrStop) {
  lcm_ = ", deadman_channel: GO";
  configure(*this, ", arming: explicit");
  Experiment arm = client_->experiment();
  arm.transport.lcm.deadman_channel = "GO";
  OperatorClient person(arm.transport.lcm);
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  ASSERT_TRUE(becomes(*this, Mode::wait_frames, Reason::deadman_released)) << daemon->printed();
  int arms = 0;
  client_->listen(lcm().operator_channel);
  client_->on_message([&](const ArmMessage& message) {
    operator_command_t request;
    arms += message.channel == lcm().operator_channel && decode(message.bytes, request) &&
            request.request == operator_command_t::ARM;
  });
  for (const OperatorRequest against :
       {OperatorRequest::disarm, OperatorRequest::emergency_stop, OperatorRequest::disarm}) {
    arms = 0;
    const auto arming = start("softarm", {"arm"});
    ASSERT_TRUE(wait_for([&] { return arms > 0; }));
    ASSERT_TRUE(person.wait_for_status(10.0));
    person.send(against);
    bool armed = false;
    const auto end_ns = person.now_ns() + 2'500'000'000;
    while (person.now_ns() < end_ns) {
      person.send_go(true);
      person.update(person.now_ns() + 10'000'000);
      wait_for([&] { return armed |= status_.armed; }, 0.01);
    }
    EXPECT_FALSE(armed) << seen_text();
    EXPECT_EQ(arming->wait(20s), 1) << arming->printed();
    person.send_go(false);
    wait_for([&] { return reason() == Reason::deadman_released; }, 0.5);
  }
}

TEST_P(RequestFaults, ARecordThatIsPlayedNeitherArmsNorHoldsTheDeadMan) {
  lcm_ = ", deadman_channel: GO";
  configure(*this, ", arming: explicit, deadman_timeout_s: 1");
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  std::vector<std::pair<std::string, std::vector<std::byte>>> record;
  client_->listen("GO");
  client_->listen(lcm().operator_channel);
  client_->on_message([&](const ArmMessage& message) {
    if (message.channel == "GO" || message.channel == lcm().operator_channel)
      record.push_back({message.channel, {message.bytes.begin(), message.bytes.end()}});
  });
  auto deadman = start("softarm", {"deadman"});
  ASSERT_TRUE(becomes(*this, Mode::wait_frames, Reason::waiting_for_arm)) << daemon->printed();
  ask_until_done(*this, OperatorRequest::arm);
  ASSERT_TRUE(wait_for([&] { return under_pressure() && record.size() > 10; }))
      << daemon->printed();
  EXPECT_EQ(ask("estop"), 0);
  EXPECT_EQ(ask("disarm"), 0);
  deadman->signal(SIGINT);
  EXPECT_EQ(deadman->wait(5s), 0);
  EXPECT_EQ(ask("estop"), 0);
  ASSERT_TRUE(becomes(*this, Mode::fault, Reason::emergency_stop)) << seen_text();
  client_->on_message({});
  wait_for([] { return false; }, 1.1);  // as long as a nonce counts
  for (int round = 0; round < 3; ++round)
    for (const auto& [channel, bytes] : record) {
      node_->publish_encoded(channel, bytes);
      wait_for([] { return false; }, 0.002);
      EXPECT_EQ(mode(), Mode::fault) << "a disarm of the record acknowledges nothing";
    }
  // Nobody is at the dead-man input; somebody disarms, and the record goes on.
  EXPECT_EQ(ask("disarm"), 0);
  ASSERT_TRUE(becomes(*this, Mode::vent, Reason::deadman_released)) << seen_text();
  wait_for([] { return false; }, 0.5);  // the last of its repetitions is history
  forget();
  for (const auto& [channel, bytes] : record) {
    operator_command_t request;
    if (decode(bytes, request) && request.request != operator_command_t::ARM) continue;
    node_->publish_encoded(channel, bytes);
    wait_for([] { return false; }, 0.002);
  }
  EXPECT_EQ(seen_.size(), 1u) << seen_text();
  EXPECT_TRUE(saw(Mode::vent, Reason::deadman_released)) << seen_text();
}

TEST_P(RequestFaults, ACommandOfSomebodyElseVents) {
  configure(*this);
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  EXPECT_FALSE(saw(Mode::vent, Reason::foreign_commands)) << seen_text();
  softarm_messages::pressure_command_t foreign{};
  foreign.sequence = 1'000'000'000;
  foreign.validity_us = 1000;
  foreign.num_chambers = static_cast<std::int16_t>(command_.pressure_bar.size());
  foreign.pressure_bar.assign(static_cast<std::size_t>(foreign.num_chambers), 0.0F);
  node_->publish(lcm().command_channel, foreign);
  EXPECT_TRUE(becomes(*this, Mode::vent, Reason::foreign_commands)) << seen_text();
  EXPECT_TRUE(becomes(*this, Mode::vent, Reason::waiting_for_arm)) << seen_text();
  // While there is somebody else, nobody can arm.
  std::atomic<bool> ends{false};
  std::thread other([&] {
    LcmNode node(url_);
    for (; !ends; std::this_thread::sleep_for(20ms)) {
      ++foreign.sequence;
      node.publish(lcm().command_channel, foreign);
    }
  });
  EXPECT_TRUE(becomes(*this, Mode::vent, Reason::foreign_commands)) << seen_text();
  EXPECT_EQ(ask("arm"), 1);
  EXPECT_TRUE(stays_away(0.5)) << seen_text();
  ends = true;
  other.join();
}

// The end of softarmd waits for nobody who does not read what it prints.
TEST_P(RequestFaults, AStuckStandardErrorKeepsNothingFromEnding) {
  const std::filesystem::path pipe = folder_ / "stderr";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int end = open(pipe.c_str(), O_RDWR | O_NONBLOCK);
  ASSERT_GE(end, 0);
  const std::vector<char> full(1 << 20, 'x');
  while (write(end, full.data(), full.size()) > 0) {
  }
  configure(*this);
  const auto plant = start_plant(*this);
  Process daemon("/sh",
                 {"-c", "exec " + std::string(SOFTARM_BINARY_DIR) + "/bin/softarmd " +
                            config_.string() + " 2>" + pipe.string()},
                 (folder_ / "stuck").string());
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text();
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(10s), 0);
  close(end);
}

// Many includes of itself, a pipe that nobody writes to: the stop is sent first, and by anybody.
TEST_P(RequestFaults, AnEmergencyStopDoesNotWaitForAFile) {
  configure(*this);
  const auto daemon = start("softarmd");
  ASSERT_TRUE(wait_for([&] { return mode() == Mode::wait_frames; })) << daemon->printed();
  const std::filesystem::path good = config_;
  config_ = folder_ / "often.yaml";
  std::ofstream often(config_);
  for (int k = 0; k < 12; ++k) often << "include: often.yaml\n";
  often << "daemon: {lcm: {url: \"" << url_ << "\"}}\n";
  often.close();
  EXPECT_EQ(ask("estop"), 0);
  EXPECT_TRUE(becomes(*this, Mode::fault, Reason::emergency_stop)) << seen_text();
  config_ = folder_ / "pipe.yaml";
  ASSERT_EQ(mkfifo(config_.c_str(), 0600), 0);
  for (const char* command : {"estop", "disarm", "arm", "check"}) EXPECT_EQ(ask(command), 78);
  config_ = good;
}

SOFTARM_ON_BOTH_MACHINES(RequestFaults);

}  // namespace
}  // namespace softarm
