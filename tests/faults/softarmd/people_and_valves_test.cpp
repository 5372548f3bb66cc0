// Requests of operators to a running softarmd, and what it concludes from the valves' read-back.
#include <chrono>

#include "faults/softarmd/fault_test.hpp"

namespace softarm {
namespace {

using test::FaultTest;
using test::Process;

class PeopleAndValves : public FaultTest {
 protected:
  /// `softarm COMMAND`: its exit code.
  int ask(const char* command, std::string* printed = nullptr) {
    const auto process = start("softarm", {command});
    const int code = end_of(*process);
    if (printed != nullptr) *printed = process->printed();
    return code;
  }
  bool vented() {
    return wait_for([&] { return mode() >= Mode::vent && largest(command_.pressure_bar) == 0.0F; });
  }
};

TEST_P(PeopleAndValves, ArmDisarmEmergencyStopAndDeadMan) {
  lcm_ = ", deadman_channel: GO";
  configure(*this, ", arming: explicit");
  const auto plant = start_plant(*this);
  const auto daemon = start("softarmd");
  ASSERT_TRUE(becomes(*this, Mode::wait_frames, Reason::deadman_released)) << daemon->printed();
  auto deadman = start("softarm", {"deadman"});
  ASSERT_TRUE(becomes(*this, Mode::wait_frames, Reason::waiting_for_arm)) << daemon->printed();
  EXPECT_FALSE(wait_for([&] { return mode() == Mode::active; }, 0.2));
  EXPECT_EQ(ask("arm"), 0);
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();

  EXPECT_EQ(ask("disarm"), 0);
  EXPECT_TRUE(vented()) << seen_text();
  ASSERT_TRUE(becomes(*this, Mode::vent, Reason::waiting_for_arm)) << seen_text();
  EXPECT_EQ(ask("arm"), 0);
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();

  // The configuration is edited: that prevents arming, but not an emergency stop.
  std::string printed;
  const std::filesystem::path good = config_;
  config_ = folder_ / "typo.yaml";
  std::ofstream(config_) << "include: " << good << "\nname: edited\ndaemon: {typo: 1}\n";
  EXPECT_EQ(ask("arm"), 78);
  // It is latched: arming alone is refused, and the message states what to do.
  EXPECT_EQ(ask("estop", &printed), 0);
  EXPECT_NE(printed.find("daemon.typo"), std::string::npos) << printed;
  config_ = good;
  EXPECT_TRUE(becomes(*this, Mode::fault, Reason::emergency_stop)) << seen_text();
  EXPECT_TRUE(vented()) << seen_text();
  EXPECT_EQ(ask("arm", &printed), 1);
  EXPECT_NE(printed.find("FAULT (emergency_stop); disarm first"), std::string::npos) << printed;
  EXPECT_EQ(mode(), Mode::fault) << seen_text();
  config_ = folder_ / "broken.yaml";  // no YAML any more
  std::ofstream(config_) << "include: " << good << "\nname: [edited\n";
  EXPECT_EQ(ask("disarm", &printed), 0) << printed;
  config_ = good;
  ASSERT_TRUE(becomes(*this, Mode::vent, Reason::waiting_for_arm)) << seen_text();
  EXPECT_EQ(ask("arm"), 0);
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();

  // The dead-man input falls silent and comes back: that alone moves nothing.
  deadman->signal(SIGSTOP);
  EXPECT_TRUE(becomes(*this, Mode::vent, Reason::deadman_released)) << seen_text();
  EXPECT_TRUE(vented()) << seen_text();
  deadman->signal(SIGCONT);
  ASSERT_TRUE(becomes(*this, Mode::vent, Reason::waiting_for_arm)) << seen_text();
  EXPECT_EQ(ask("arm"), 0);
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();
  EXPECT_EQ(end(*deadman, SIGINT), 0) << deadman->printed();  // it withdraws the dead-man input
  EXPECT_TRUE(becomes(*this, Mode::vent, Reason::deadman_released)) << seen_text();
  expect_limits(*this);
  for (const char* line : {"FAULT (emergency_stop)", "VENT (deadman_released)", "VENT (disarmed)"})
    EXPECT_TRUE(daemon->printed().find(line) != std::string::npos) << line << daemon->printed();
}

TEST_P(PeopleAndValves, SilentOrLeakingValvesAreALatchedFault) {
  configure(*this, ", valve_readback: true, valve_silence_s: 0.4, pressure_settling_s: 0.5");
  const auto relay = start_relay(*this);
  relay->set(*find_fault("silence"));
  const auto plant = start_plant(*this, kSensorSuffix);
  const auto daemon = start("softarmd");
  // Nothing is pressurised yet: no fault, but no control either.
  ASSERT_TRUE(wait_for([&] { return status_.frames_accepted > 60; })) << daemon->printed();
  EXPECT_EQ(mode(), Mode::wait_frames) << seen_text();
  EXPECT_EQ(reason(), Reason::valves_silent) << seen_text();
  relay->set({});
  ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << daemon->printed();

  struct Row {
    const char* fault;
    Reason reason;
  };
  for (const Row& row :
       {Row{"silence", Reason::valves_silent}, Row{"burst", Reason::pressure_mismatch},
        Row{"stick", Reason::pressure_mismatch}}) {
    SCOPED_TRACE(row.fault);
    // A burst shows where there should be pressure: in the fullest chamber.
    arm_when_asked();
    ASSERT_TRUE(wait_for([&] {
      return mode() == Mode::active && largest(command_.pressure_bar) > 0.5F;
    })) << seen_text();
    meanwhile_ = {};
    Fault fault = *find_fault(row.fault);
    command_.pressure_bar.maxCoeff(&fault.body);  // the index of the largest
    relay->set(fault);
    EXPECT_TRUE(becomes(*this, Mode::fault, row.reason)) << seen_text() << daemon->printed();
    EXPECT_TRUE(vented()) << seen_text();
    relay->set({});
    const std::int64_t accepted = status_.frames_accepted;
    ASSERT_TRUE(wait_for([&] { return status_.frames_accepted > accepted + 40; }));
    EXPECT_EQ(mode(), Mode::fault) << "it is latched";
    ask_until_done(*this, OperatorRequest::disarm);
    ASSERT_TRUE(becomes(*this, Mode::vent, Reason::waiting_for_arm)) << seen_text();
    ask_until_done(*this, OperatorRequest::arm);
    ASSERT_TRUE(wait_for([&] { return under_pressure(); })) << seen_text();
  }
  expect_limits(*this);
}

SOFTARM_ON_BOTH_MACHINES(PeopleAndValves);

}  // namespace
}  // namespace softarm
