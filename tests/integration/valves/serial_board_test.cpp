// A back end that is not ours to know: examples/serial_pressure_board.cpp between LCM and a board
// at the other end of a pseudo-terminal.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "integration/valves/pressure_board.hpp"
#include "integration/valves/valves_program.hpp"

namespace softarm {
namespace {

using test::kChambers;
using test::PressureBoard;
using Answer = PressureBoard::Answer;

class SerialBoard : public test::ValvesProgram {
 protected:
  void begin() {
    // At a board that may be real, arming is explicit unless the file has it otherwise.
    configure(1, ", backend: serial_board, device: " + board_.device(), ", arming: automatic");
    driver_ = start("example_serial_pressure_board");
  }
  bool board_has(double bar) const {
    const std::vector<double> all = board_.set_points_bar();
    return all.size() == kChambers && std::all_of(all.begin(), all.end(), [bar](double each) {
             return std::abs(each - bar) < 1e-3;
           });
  }
  bool run_at(double bar) {
    return command_until(bar, [&] {
      return is(ValveState::running, ValveReason::none) && board_has(bar) &&
             std::abs(static_cast<double>(measured_.pressure_bar[kChambers - 1]) - bar) < 1e-3;
    });
  }

  PressureBoard board_;
  std::unique_ptr<test::Process> driver_;
};

TEST_F(SerialBoard, CommandsReachItExpireAndAStopVents) {
  begin();
  ASSERT_TRUE(run_at(0.4)) << driver_->printed();
  EXPECT_EQ(board_.timeout_ms(), 300);
  ASSERT_TRUE(wait_for([&] {
    return is(ValveState::vented, ValveReason::no_command) && board_has(0.0);
  })) << driver_->printed();
  ASSERT_TRUE(run_at(0.4));
  EXPECT_EQ(end(*driver_), 0) << driver_->printed();
  EXPECT_TRUE(board_has(0.0));
}

TEST_F(SerialBoard, WhateverItAnswersInsteadOfPressuresVentsAndIsSurvived) {
  begin();
  for (const Answer answer :
       {Answer::none, Answer::noise, Answer::flood, Answer::one_too_few, Answer::not_a_number}) {
    ASSERT_TRUE(run_at(0.3)) << static_cast<int>(answer) << driver_->printed();
    board_.answer = answer;
    ASSERT_TRUE(
        command_until(0.3, [&] { return is(ValveState::disconnected, ValveReason::no_answer); }))
        << static_cast<int>(answer) << driver_->printed();
    EXPECT_TRUE(command_until(0.3, [&] { return board_has(0.0); })) << static_cast<int>(answer);
    board_.answer = Answer::good;
  }
  EXPECT_TRUE(run_at(0.3)) << driver_->printed();
}

TEST_F(SerialBoard, ThatDoesNotTakeItsTimeOutIsNeverPressurised) {
  board_.takes_timeout = false;
  begin();
  ASSERT_TRUE(command_until(0.7, [&] { return valves().connections > 0; })) << driver_->printed();
  EXPECT_TRUE(command_until(
      0.7, [&] { return is(ValveState::disconnected, ValveReason::failsafe_refused); }));
  EXPECT_EQ(board_.highest_ever_bar(), 0.0);
}

TEST_F(SerialBoard, WhosePlugIsPulledIsNotConnected) {
  begin();
  ASSERT_TRUE(run_at(0.3)) << driver_->printed();
  board_.unplug();
  ASSERT_TRUE(command_until(0.3, [&] {
    return is(ValveState::disconnected, ValveReason::no_connection);
  })) << driver_->printed();
  EXPECT_TRUE(wait_for([&] {
    return driver_->printed().find("DISCONNECTED (no connection): " + board_.device()) !=
           std::string::npos;
  })) << driver_->printed();
  EXPECT_EQ(end(*driver_), 1) << "zero was not confirmed" << driver_->printed();
}

TEST_F(SerialBoard, BelongsToOneDriver) {
  begin();
  ASSERT_TRUE(wait_for([&] { return valves().state == ValveState::vented; })) << driver_->printed();
  const auto other = start("example_serial_pressure_board");
  EXPECT_EQ(end_of(*other), 75) << other->printed();
}

TEST_F(SerialBoard, IsUnknownToTheProgramThatHasNoSuchBackEnd) {
  configure(1, ", backend: serial_board, device: " + board_.device());
  const auto ours = start("softarm-valves");
  EXPECT_EQ(end_of(*ours), 78);
  EXPECT_NE(ours->printed().find("config.yaml: valves.backend: expected one that this program has "
                                 "(modbus), got serial_board"),
            std::string::npos)
      << ours->printed();
}

}  // namespace
}  // namespace softarm
