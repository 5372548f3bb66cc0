// Two programs command one arm, or one commands for longer than the valve side grants: softarm-valves
// and softarm-plant, which stands for valves where commands come over LCM.
#include <gtest/gtest.h>

#include <algorithm>

#include "integration/valves/valves_program.hpp"

namespace softarm {
namespace {

using test::kChambers;
using test::Process;
using test::ValvesProgram;

constexpr double kSlew_bar_per_s = 2.0;
constexpr double kValidity_s = 0.3;  // daemon.lcm.command_validity_s
/// A rise of so much needs a slew above the limit, or a command that outlives its validity; 0.1 s is
/// two cycles of the driver.
constexpr double kMostRise_bar = kSlew_bar_per_s * (kValidity_s + 0.1);

/// Whether commands go to the driver of a terminal, or to the plant.
class Senders : public ValvesProgram, public ::testing::WithParamInterface<bool> {
 protected:
  void SetUp() override {
    ValvesProgram::SetUp();
    if (IsSkipped()) return;
    client_->on_plant([this](const PlantState& plant) {
      plant_ = plant;
      highest_measured_bar_ = std::max(highest_measured_bar_, largest(plant.pressure_bar));
    });
    client_->on_message([this](const ArmMessage& message) {
      if (message.channel != "SOFTARM_PRESSURE" || !decode(message.bytes, measured_)) return;
      ++measurements_;
      saw_other_sender_ |= measured_.reason == static_cast<std::int8_t>(ValveReason::other_sender);
    });
    validity_s_ = kValidity_s;
    configure_slew(1);
    if (GetParam()) {
      plant_process_ = start_terminal();
      configure_slew(plant_process_->port());
      valves_ = start("softarm-valves");
    } else {
      valves_ = start("softarm-plant");
    }
  }
  void configure_slew(int port) {
    configure(port);
    std::ofstream(config_, std::ios::app)
        << "actuation: {slew_bar_per_s: " << kSlew_bar_per_s << "}\n";
  }
  /// As another program with other numbers.
  void intrude(double bar) {
    softarm_messages::pressure_command_t theirs = sent_;
    theirs.sequence += 1'000'000;
    theirs.pressure_bar.assign(kChambers, static_cast<float>(bar));
    node_->publish("SOFTARM_PRESSURE_COMMAND", theirs);
  }

  std::unique_ptr<Process> plant_process_, valves_;
  double highest_measured_bar_ = 0.0;
  bool saw_other_sender_ = false;
};

TEST_P(Senders, OnePacketOfAnotherProgramMovesNothingBeyondTheSlewAndVents) {
  ASSERT_TRUE(command_until(0.3, [&] { return pressure_is(0.3); })) << valves_->printed();
  highest_measured_bar_ = 0.0;
  intrude(2.0);
  EXPECT_TRUE(command_until(0.3, [&] { return saw_other_sender_; })) << valves_->printed();
  EXPECT_TRUE(command_until(0.3, [&] { return pressure_is(0.0); })) << valves_->printed();
  EXPECT_LT(highest_measured_bar_, 0.3 + kMostRise_bar);
  EXPECT_TRUE(wait_for([&] {
    return valves_->printed().find("DEGRADED (another sender)") != std::string::npos;
  })) << valves_->printed();
  // It has left, but commands must have been zero once.
  const int before = measurements_;
  bool in_force = false;
  EXPECT_TRUE(command_until(0.3, [&] {
    in_force |= measured_.sequence >= 0;
    return measurements_ > before + 20;
  }));
  EXPECT_FALSE(in_force) << "zero was not commanded";
  EXPECT_TRUE(command_until(0.0, [&] { return measured_.sequence >= 0; })) << valves_->printed();
  EXPECT_TRUE(command_until(0.3, [&] { return pressure_is(0.3); })) << valves_->printed();
}

TEST_P(Senders, TwoProgramsAtOnceHaveNoPressureAndNoneWhenOneLeaves) {
  ASSERT_TRUE(command_until(0.0, [&] { return measurements_ > 0 && measured_.sequence >= 0; }))
      << valves_->printed();
  ASSERT_TRUE(command_until(0.3, [&] {
    intrude(0.8);
    return saw_other_sender_;
  })) << valves_->printed();
  ASSERT_TRUE(command_until(0.3, [&] { return pressure_is(0.0); })) << valves_->printed();
  highest_measured_bar_ = 0.0;
  const int before = measurements_;
  EXPECT_TRUE(command_until(0.3, [&] {
    intrude(0.8);
    return measurements_ > before + 20;
  }));
  const int alone = measurements_;
  EXPECT_TRUE(command_until(0.3, [&] { return measurements_ > alone + 20; }));
  EXPECT_LT(highest_measured_bar_, 0.05);
}

TEST_P(Senders, ANewSenderRisesWithinTheSlewToo) {
  ASSERT_TRUE(command_until(0.3, [&] { return pressure_is(0.3); })) << valves_->printed();
  ASSERT_TRUE(wait_for([&] { return pressure_is(0.0); })) << "expired";
  sent_.sequence = 0;  // it has started again
  highest_measured_bar_ = 0.0;
  sent_.pressure_bar.assign(kChambers, 2.0F);
  publish();
  ASSERT_TRUE(wait_for([&] { return measured_.sequence == 1; })) << valves_->printed();
  ASSERT_TRUE(wait_for([&] { return measured_.sequence < 0 && pressure_is(0.0); }));
  EXPECT_LT(highest_measured_bar_, kMostRise_bar);
}

TEST_P(Senders, AValidityThatIsNotGrantedIsReportedAndSoIsWhatExpired) {
  sent_.validity_us = 600'000;
  ASSERT_TRUE(command_until(0.3, [&] { return measured_.sequence > 0 && pressure_is(0.3); }))
      << valves_->printed();
  EXPECT_EQ(measured_.validity_us, 300'000);
  EXPECT_EQ(measured_.reason, 0);
  EXPECT_TRUE(wait_for([&] {
    return valves_->printed().find(
               "commands ask to be held for 0.6 s; they expire after "
               "daemon.lcm.command_validity_s, 0.3 s") != std::string::npos;
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
    highest_measured_bar_ = 0.0;
    const int before = measurements_;
    EXPECT_TRUE(command_until(1.0, [&] {
      sent_.time_us = monotonic_now_ns() / 1000 + offset_us;
      return measurements_ > before + 30;
    }));
    return highest_measured_bar_;
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
