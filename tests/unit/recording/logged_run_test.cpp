// The pipeline on frames out of a log, where neither valves nor people answer.
#include "softarm/recording/logged_run.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <lcm/lcm-cpp.hpp>
#include <string>

#include "softarm/base/time.hpp"
#include "softarm/config/load.hpp"
#include "softarm/simulation/simulated_arm.hpp"
#include "softarm/transport/mocap_adapter.hpp"
#include "softarm/transport/softarm_mocap.hpp"
#include "test_folder.hpp"

namespace softarm {
namespace {

class RecordedAtRest : public ::testing::Test {
 protected:
  /// Two seconds of an arm at rest, as lcm-logger writes them.
  void SetUp() override {
    lcm::LogFile log(path_, "w");
    SimulatedArm arm(experiment_.plant, 0);
    const MocapAdapter adapter(experiment_.transport.bodies, experiment_.arm,
                               experiment_.transport.mocap);
    const auto sent = std::make_unique<SentFrame>();
    softarm_messages::mocap_frame_t message;
    for (std::int64_t time_ms = 0; time_ms < 2000; ++time_ms) {
      arm.advance_to(1'000'000 * time_ms);
      for (MocapFrame frame; arm.receive(frame);) {
        adapter.to_sent(frame, frame.capture_ns / 1000, *sent);
        to_message(*sent, message);
        std::string bytes(static_cast<std::size_t>(message.getEncodedSize()), '\0');
        message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
        lcm::LogEvent event{.eventnum = 0,
                            .timestamp = 1'700'000'000'000'000 + 1000 * time_ms,
                            .channel = experiment_.transport.lcm.mocap_channel,
                            .datalen = static_cast<int>(bytes.size()),
                            .data = bytes.data()};
        ASSERT_EQ(log.writeEvent(&event), 0);
      }
    }
  }

  std::string log() const { return file_text(path_); }
  void write(const std::string& bytes) const { folder_.write("log", bytes); }

  /// Seconds of ACTIVE; the last row is in `row_`.
  double active_s() {
    LoggedRun run(experiment_, path_);
    int ticks = 0;
    while (run.step(row_)) ticks += row_.mode == Mode::active ? 1 : 0;
    return ticks / experiment_.rate_hz;
  }

  Experiment experiment_ =
      load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / "paper_arm.yaml");
  TestFolder folder_;
  std::string path_ = (folder_ / "log").string();
  LogRow row_;
};

TEST_F(RecordedAtRest, BecomesActive) {
  EXPECT_GT(active_s(), 1.5) << name(row_.mode) << ", " << name(row_.reason);
}

TEST_F(RecordedAtRest, BecomesActiveWhereAnOperatorArms) {
  experiment_.safety.arming = Arming::explicit_;
  EXPECT_GT(active_s(), 1.5) << name(row_.mode) << ", " << name(row_.reason);
}

TEST_F(RecordedAtRest, BecomesActiveWhereValvesPublishPressures) {
  experiment_.safety.valve_readback = true;
  EXPECT_GT(active_s(), 1.5) << name(row_.mode) << ", " << name(row_.reason);
}

TEST_F(RecordedAtRest, BecomesActiveWhereThereIsADeadManInput) {
  experiment_.safety.deadman = true;
  EXPECT_GT(active_s(), 1.5) << name(row_.mode) << ", " << name(row_.reason);
}

TEST_F(RecordedAtRest, HasARowEveryPeriodFromTheFirstFrameOn) {
  LoggedRun run(experiment_, path_);
  const double period_s = to_seconds(run.pipeline().period_ns());
  int ticks = 0;
  for (; run.step(row_); ++ticks) {
    ASSERT_NEAR(row_.t_s, ticks * period_s, 1e-9);
    ASSERT_EQ(row_.truth.size() + row_.real.size(), 0);
    ASSERT_FALSE(row_.tip);
  }
  EXPECT_NEAR(ticks * period_s, 2.0, 0.02);
  EXPECT_EQ(run.malformed(), 0);
  EXPECT_EQ(run.log().damage_count(), 0);
}

TEST_F(RecordedAtRest, ATickThatIsNotLoggedLeavesTheRowAlone) {
  LoggedRun run(experiment_, path_);
  row_.t_s = -7.0;
  ASSERT_TRUE(run.step(row_, false));
  EXPECT_EQ(row_.t_s, -7.0);
  ASSERT_TRUE(run.step(row_));
  EXPECT_NEAR(row_.t_s, to_seconds(run.pipeline().period_ns()), 1e-9);
}

/// What damage makes of a logger's stamp is no time: nanoseconds of it would overflow.
TEST_F(RecordedAtRest, AStampThatIsNoTimeCostsItsFrameAlone) {
  const std::string whole = log();
  const std::size_t second = whole.find("\xED\xA1\xDA\x01", 4);
  ASSERT_NE(second, std::string::npos);
  for (const char top : {'\x40', '\x90'}) {
    std::string bytes = whole;
    bytes[second + 12] = top;  // of the stamp's eight bytes
    write(bytes);
    EXPECT_GT(active_s(), 1.5);
    LoggedRun run(experiment_, path_);
    while (run.step(row_, false)) {
    }
    EXPECT_EQ(run.malformed(), 1);
    EXPECT_EQ(run.log().damage_count(), 0);
  }
}

TEST_F(RecordedAtRest, DamageIsSteppedOverAndReported) {
  std::string bytes = log();
  bytes.replace(bytes.size() / 2, 500, std::string(500, 'x'));
  write(bytes);
  LoggedRun run(experiment_, path_);
  int ticks = 0;
  while (run.step(row_)) ++ticks;
  EXPECT_NEAR(ticks / experiment_.rate_hz, 2.0, 0.02);
  EXPECT_EQ(run.log().damage_count(), 1);
  EXPECT_NE(run.log().damage_text().find("damaged"), std::string::npos);
}

TEST_F(RecordedAtRest, ALogWithoutAFrameOfThisArmIsRefused) {
  experiment_.transport.lcm.mocap_channel = "ANOTHER";
  try {
    LoggedRun run(experiment_, path_);
    FAIL() << "expected an error";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("no frame on channel ANOTHER"), std::string::npos)
        << error.what();
  }
  EXPECT_THROW(LoggedRun(experiment_, path_ + "_not_there"), std::runtime_error);
  EXPECT_THROW(LoggedRun(experiment_, std::filesystem::temp_directory_path()), std::runtime_error);
}

}  // namespace
}  // namespace softarm
