// Logs made here, whole and damaged, as motions to identify from.
#include "softarm/commissioning/identification/log_record.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "softarm/model/kinematics.hpp"
#include "softarm/transport/mocap_adapter.hpp"
#include "softarm/transport/softarm_mocap.hpp"
#include "test_folder.hpp"
#include "unit/recording/recorded_log.hpp"

namespace softarm {
namespace {

constexpr std::int64_t kStart_us = 1'700'000'000'000'000, kFrame_us = 5000, kFrames = 100;
const std::string kSync = "\xED\xA1\xDA\x01";

/// u of every frame: one segment that sways in a plane.
Eigen::Vector2d bend(std::int64_t k) { return {0.3 * std::sin(0.1 * static_cast<double>(k)), 0.1}; }

class MotionLog : public ::testing::Test {
 protected:
  /// Per frame its set points, a hundredth of a bar times its number on the first chamber, then itself.
  MotionLog() { bytes_ = log_with(0, 0); }
  /// `stamp_us`: by which the logger's clock was set before frame 50; `gap_us`: that passed then.
  std::string log_with(std::int64_t stamp_us, std::int64_t gap_us) const {
    const LcmSettings& lcm = experiment_.transport.lcm;
    const MocapAdapter adapter(experiment_.transport.bodies, experiment_.arm,
                               experiment_.transport.mocap);
    const auto sent = std::make_unique<SentFrame>();
    test::LogBytes log;
    for (std::int64_t k = 0; k < kFrames; ++k) {
      const std::int64_t own_us = kStart_us + kFrame_us * k + (k >= 50 ? gap_us : 0);
      const std::int64_t time_us = own_us + (k >= 50 ? stamp_us : 0);
      softarm_messages::pressure_command_t command{};
      command.pressure_bar = {0.01F * static_cast<float>(k), 0.0F, 0.0F};
      command.num_chambers = 3;
      log.add_message(lcm.command_channel, command, time_us - 1);
      MocapFrame frame;
      frame.frame_number = k + 1;
      frame.segments = 1;
      ArmParameters arm = experiment_.arm;
      std::vector<Eigen::Isometry3d> end(1);
      forward_kinematics(arm, bend(k), end);
      frame.body[0] = {arm.base_position_m, Eigen::Quaterniond(arm.base_rotation), true};
      frame.body[1] = {end[0].translation(), Eigen::Quaterniond(end[0].linear()), true};
      softarm_messages::mocap_frame_t message;
      adapter.to_sent(frame, own_us, *sent);
      to_message(*sent, message);
      log.add_message(lcm.mocap_channel, message, time_us);
    }
    return log.bytes;
  }

  LoggedMotion read(const std::string& bytes, LoggedInput input = LoggedInput::commanded) const {
    std::ofstream(path_, std::ios::binary) << bytes;
    return read_log(experiment_, path_, input);
  }
  /// Where the `number`-th event begins; set points and frames take turns.
  std::size_t event(int number) const {
    std::size_t at = 0;
    for (int k = 0; k < number; ++k) at = bytes_.find(kSync, at + 1);
    return at;
  }
  /// Frames are where they were made, at the times at which they were made.
  static void expect_motion(const MotionRecord& record) {
    for (Eigen::Index k = 0; k < record.time_s.size(); ++k) {
      const auto frame = std::llround(record.time_s[k] / (1e-6 * kFrame_us));
      EXPECT_NEAR(record.time_s[k], 1e-6 * static_cast<double>(kFrame_us * frame), 1e-5) << k;
      EXPECT_LT((record.u_rad.row(k).transpose() - bend(frame)).norm(), 1e-5) << k;
    }
  }

  Experiment experiment_ =
      load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / "one_segment.yaml");
  std::string bytes_;
  TestFolder folder_;
  std::filesystem::path path_ = folder_ / "log";
};

TEST_F(MotionLog, IsReadWhole) {
  const LoggedMotion read = this->read(bytes_);
  EXPECT_EQ(read.damage, "");
  ASSERT_EQ(read.record.time_s.size(), kFrames);
  expect_motion(read.record);
  ASSERT_EQ(read.record.input.time_s.size(), kFrames);
  EXPECT_TRUE(read.record.input.held);
  EXPECT_NEAR(read.record.input.value(42, 0), 0.42, 1e-6);
  EXPECT_NEAR(read.record.input.time_s[42], 42 * 1e-6 * kFrame_us, 1e-5);
}

/// A stamp that damage made too large for nanoseconds, or below zero: that message is left out, and
/// the others keep their times.
TEST_F(MotionLog, AStampThatIsNoTimeCostsItsMessageAlone) {
  for (const int number : {41, 40}) {  // a frame, set points
    for (const char top : {'\x40', '\x7f', '\x90'}) {
      std::string bytes = bytes_;
      bytes[event(number) + 12] = top;
      const LoggedMotion read = this->read(bytes);
      expect_motion(read.record);
      EXPECT_EQ(read.record.time_s.size(), kFrames - (number == 41 ? 1 : 0));
      EXPECT_EQ(read.record.input.time_s.size(), kFrames - (number == 40 ? 1 : 0));
      EXPECT_NE(read.damage.find("1 messages"), std::string::npos) << read.damage;
    }
  }
}

/// The clock of the logger is set while it logs: the motion is that of the good log.
TEST_F(MotionLog, AStepOfTheLoggersClockChangesNothing) {
  const LoggedMotion good = read(bytes_);
  for (const std::int64_t step_us : {-2'000'000LL, 2'000'000LL, -600'000'000LL,
                                     31'536'000'000'000LL, -1'700'000'000'000'000LL}) {
    const LoggedMotion set = read(log_with(step_us, 0));
    ASSERT_EQ(set.record.time_s.size(), good.record.time_s.size()) << step_us;
    EXPECT_LT((set.record.time_s - good.record.time_s).cwiseAbs().maxCoeff(), 1e-3) << step_us;
    EXPECT_LT((set.record.input.time_s - good.record.input.time_s).cwiseAbs().maxCoeff(), 0.006);
    EXPECT_EQ(set.damage, "") << step_us;
    EXPECT_NE(set.notes.find("at byte"), std::string::npos) << set.notes;
    expect_motion(set.record);
  }
}

/// Nothing is logged for long: one part is used, and the other one is reported.
TEST_F(MotionLog, AfterALongGapOnePartIsUsed) {
  for (const std::int64_t gap_us : {60'000'000LL, 600'000'000LL, 86'400'000'000LL}) {
    const LoggedMotion read = this->read(log_with(0, gap_us));
    EXPECT_EQ(read.record.time_s.size(), 50);
    const double span_s = read.record.time_s[read.record.time_s.size() - 1] - read.record.time_s[0];
    EXPECT_NEAR(span_s, 49e-6 * kFrame_us, 1e-6);
    EXPECT_NE(read.damage.find("the longest part"), std::string::npos) << read.damage;
    EXPECT_NE(read.notes.find("nothing was logged for"), std::string::npos) << read.notes;
  }
}

/// Two recordings in one file, as `cat` puts them together.
TEST_F(MotionLog, AppendedRecordingsAreNotOneMotion) {
  const LoggedMotion twice = read(bytes_ + log_with(0, 0));
  EXPECT_EQ(twice.record.time_s.size(), kFrames);
  EXPECT_NE(twice.damage.find("another recording"), std::string::npos) << twice.damage;
}

TEST_F(MotionLog, PressuresThatAreNoneAreNotUsed) {
  std::string bytes = bytes_;
  // The first pressure of a message, behind its channel, fingerprint, three integers, flag and size.
  const std::size_t at = event(40) + 28 + experiment_.transport.lcm.command_channel.size() + 31;
  for (const char* bad : {"\x7f\xc0\x00\x01", "\x7f\x80\x01\x01", "\x7e\x01\x01\x01"}) {
    bytes.replace(at, 4, bad, 4);
    const LoggedMotion read = this->read(bytes);
    EXPECT_EQ(read.record.input.time_s.size(), kFrames - 1);
    EXPECT_NE(read.damage, "");
  }
}

TEST_F(MotionLog, WhatPrecedesAndFollowsDamageIsUsedAndTheDamageReported) {
  std::string bytes = bytes_;
  const std::size_t from = event(100) + 10, to = event(104) - 10;
  bytes.replace(from, to - from, to - from, 'x');
  const LoggedMotion read = this->read(bytes);
  expect_motion(read.record);
  EXPECT_GE(read.record.time_s.size(), kFrames - 3);
  EXPECT_LT(read.record.time_s.size(), kFrames);
  EXPECT_NE(read.damage.find("damaged or cut"), std::string::npos) << read.damage;
  const LoggedMotion cut = this->read(bytes_.substr(0, event(150) + 7));
  EXPECT_EQ(cut.record.time_s.size(), 75);
  EXPECT_NE(cut.damage, "");
}

TEST_F(MotionLog, TooLittleIsAnErrorThatSaysWhere) {
  const auto error_of = [&](const auto& reading) -> std::string {
    try {
      reading();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_NE(error_of([&] { read(bytes_.substr(0, event(8))); }).find("at least 8 frames"),
            std::string::npos);
  EXPECT_NE(error_of([&] { read(bytes_, LoggedInput::measured); }).find("--input"),
            std::string::npos);
  EXPECT_NE(error_of([&] {
              read_log(experiment_, path_.string() + "_not_there", LoggedInput::measured);
            }).find("is it an LCM log"),
            std::string::npos);
}

}  // namespace
}  // namespace softarm
