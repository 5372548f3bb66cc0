// The pipeline on frames out of a log, where neither valves nor people answer.
#include "softarm/recording/logged_run.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <lcm/lcm-cpp.hpp>
#include <string>

#include "softarm/config/load.hpp"
#include "softarm/simulation/simulated_arm.hpp"
#include "softarm/transport/mocap_adapter.hpp"
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
    softarm_messages::mocap_frame_t message;
    for (std::int64_t time_ms = 0; time_ms < 2000; ++time_ms) {
      arm.advance_to(1'000'000 * time_ms);
      for (MocapFrame frame; arm.receive(frame);) {
        adapter.to_message(frame, frame.capture_ns / 1000, message);
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

  /// Seconds of ACTIVE; the last row is in `row_`.
  double active_s() {
    LoggedRun run(experiment_, path_);
    int ticks = 0;
    while (run.step(row_)) ticks += row_.mode == Mode::active ? 1 : 0;
    return ticks / experiment_.rate_hz;
  }

  Experiment experiment_ =
      load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / "paper_arm.yaml");
  std::string path_ =
      (std::filesystem::temp_directory_path() / ("softarm_logged_run_" + std::to_string(getpid())))
          .string();
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

}  // namespace
}  // namespace softarm
