// Two programs command one arm, or one commands for longer than the valve side grants: softarm-valves
// and softarm-plant, which stands for valves where commands come over LCM.
#include <gtest/gtest.h>

#include <algorithm>

#include "integration/valves/valves_program.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
using test::kChambers;
using test::Process;
using test::ValvesProgram;

constexpr double kSlew_bar_per_s = 2.0;
constexpr double kValidity_s = 0.1;  // daemon.lcm.command_validity_s
/// A rise of so much needs a slew above the limit, or a command that outlives its validity; 0.1 s is
/// two cycles of the driver.
constexpr double kMostRise_bar = kSlew_bar_per_s * (kValidity_s + 0.1);

/// Whether commands go to the driver of a terminal, or to the plant.
class Senders : public ValvesProgram, public ::testing::WithParamInterface<bool> {
 protected:
  void SetUp() override {
    ValvesProgram::SetUp();
    if (IsSkipped()) return;
    node_->subscribe("SOFTARM_PLANT", 4096, [this](const ReceivedMessage& packet) {
      if (softarm_messages::plant_state_t state; decode(packet.bytes, state))
        highest_bar_ =
            std::max(highest_bar_, static_cast<double>(*std::max_element(
                                       state.pressure_bar.begin(), state.pressure_bar.end())));
    });
    node_->subscribe("SOFTARM_PRESSURE", 4096, [this](const ReceivedMessage& packet) {
      softarm_messages::pressure_measurement_t measured;
      if (decode(packet.bytes, measured) &&
          measured.reason == static_cast<std::int8_t>(ValveReason::other_sender))
        saw_other_sender_ = true;
    });
    configure(1);
    if (GetParam()) {
      plant_process_ = start_plant();
      configure(plant_process_->port());
      valves_ = start("softarm-valves");
    } else {
      valves_ = start("softarm-plant");
    }
  }
  void configure(int port) {
    write_config(port);
    std::ofstream(config_, std::ios::app)
        << "actuation: {slew_bar_per_s: " << kSlew_bar_per_s << "}\n";
  }
  /// As another program with numbers and a clock of its own.
  void intrude(double bar) {
    softarm_messages::pressure_command_t theirs = command_;
    theirs.sequence += 1'000'000;
    theirs.pressure_bar.assign(kChambers, static_cast<float>(bar));
    node_->publish("SOFTARM_PRESSURE_COMMAND", theirs);
  }

  std::unique_ptr<Process> plant_process_, valves_;
  double highest_bar_ = 0.0;
  bool saw_other_sender_ = false;
};

TEST_P(Senders, OnePacketOfAnotherProgramMovesNothingBeyondTheSlewAndVents) {
  ASSERT_TRUE(wait_for([&] { return pressure_is(0.3); }, 0.3)) << valves_->printed();
  highest_bar_ = 0.0;
  intrude(2.0);
  EXPECT_TRUE(wait_for([&] { return saw_other_sender_; }, 0.3)) << valves_->printed();
  EXPECT_TRUE(wait_for([&] { return pressure_is(0.0); }, 0.3)) << valves_->printed();
  EXPECT_LT(highest_bar_, 0.3 + kMostRise_bar);
  EXPECT_TRUE(wait_for([&] {
    return valves_->printed().find("DEGRADED (another sender)") != std::string::npos;
  })) << valves_->printed();
  // It has left, but commands must have been zero once.
  EXPECT_FALSE(wait_for([&] { return measured_.sequence >= 0; }, 0.3, 1.0));
  EXPECT_TRUE(wait_for([&] { return measured_.sequence >= 0; }, 0.0)) << valves_->printed();
  EXPECT_TRUE(wait_for([&] { return pressure_is(0.3); }, 0.3)) << valves_->printed();
}

TEST_P(Senders, TwoProgramsAtOnceHaveNoPressureAndNoneWhenOneLeaves) {
  ASSERT_TRUE(wait_for([&] { return measurements_ > 0; }, 0.0)) << valves_->printed();
  ASSERT_TRUE(wait_for(
      [&] {
        intrude(0.8);
        return saw_other_sender_;
      },
      0.3))
      << valves_->printed();
  ASSERT_TRUE(wait_for([&] { return pressure_is(0.0); }, 0.3)) << valves_->printed();
  highest_bar_ = 0.0;
  const int before = measurements_;
  EXPECT_TRUE(wait_for(
      [&] {
        intrude(0.8);
        return measurements_ > before + 20;
      },
      0.3));
  const int alone = measurements_;
  EXPECT_TRUE(wait_for([&] { return measurements_ > alone + 20; }, 0.3));
  EXPECT_LT(highest_bar_, 0.05);
}

TEST_P(Senders, ANewSenderRisesWithinTheSlewToo) {
  ASSERT_TRUE(wait_for([&] { return pressure_is(0.3); }, 0.3)) << valves_->printed();
  ASSERT_TRUE(wait_for([&] { return pressure_is(0.0); })) << "expired";
  command_.sequence = 0;  // it has started again
  highest_bar_ = 0.0;
  send(2.0);
  ASSERT_TRUE(wait_for([&] { return measured_.sequence == 1; })) << valves_->printed();
  ASSERT_TRUE(wait_for([&] { return measured_.sequence < 0 && pressure_is(0.0); }));
  EXPECT_LT(highest_bar_, kMostRise_bar);
}

TEST_P(Senders, AValidityThatIsNotGrantedIsReportedAndSoIsWhatExpired) {
  command_.validity_us = 300'000;
  ASSERT_TRUE(wait_for([&] { return measured_.sequence > 0 && pressure_is(0.3); }, 0.3))
      << valves_->printed();
  EXPECT_EQ(measured_.validity_us, 100'000);
  EXPECT_EQ(measured_.reason, 0);
  EXPECT_TRUE(wait_for([&] {
    return valves_->printed().find(
               "commands ask to be held for 0.3 s; they expire after "
               "daemon.lcm.command_validity_s, "
               "0.1 s") != std::string::npos;
  })) << valves_->printed();
  const int expired = measured_.expired;
  EXPECT_TRUE(wait_for([&] { return measured_.expired == expired + 1; })) << valves_->printed();
  EXPECT_EQ(measured_.sequence, -1);
  EXPECT_EQ(measured_.reason, static_cast<std::int8_t>(ValveReason::no_command));
}

// On one machine all read the same clock: what was recorded an hour ago, or is of an earlier boot,
// is not of this moment.
TEST_P(Senders, CommandsThatAreNotOfThisMomentMoveNothing) {
  const auto played_at = [&](std::int64_t offset_us) {
    highest_bar_ = 0.0;
    const int before = measurements_;
    EXPECT_TRUE(wait_for([&] {
      command_.time_us = monotonic_now_ns() / 1000 + offset_us;
      send(1.0);
      return measurements_ > before + 30;
    }));
    return highest_bar_;
  };
  EXPECT_LT(played_at(-3'600'000'000), 0.01);
  EXPECT_LT(played_at(+3'600'000'000), 0.01);
  EXPECT_GT(played_at(0), 0.1) << valves_->printed();
}

INSTANTIATE_TEST_SUITE_P(Of, Senders, ::testing::Values(true, false), [](const auto& test) {
  return std::string(test.param ? "ATerminal" : "ThePlant");
});

}  // namespace
}  // namespace softarm
