// lcm-logger beside softarmd and softarm-plant while things go wrong, then softarm replay of what
// it wrote; and lcm-logplayer into a daemon that knows nothing of it. SOFTARM_REPLAY_SECONDS sets
// how long the run is.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <softarm_messages/mocap_frame_t.hpp>

#include "integration/processes/station.hpp"
#include "softarm/transport/event_log.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
using test::Process;
using test::Station;

double seconds_asked() {
  const char* asked = std::getenv("SOFTARM_REPLAY_SECONDS");
  return asked == nullptr ? 4.0 : std::atof(asked);
}

class ReplayOfProcesses : public ::testing::Test, protected Station {
 protected:
  void SetUp() override {
    experiment_ = load_experiment(config_);
    std::ofstream(config_) << resolved_text(
        experiment_);  // all of it: nothing may change meanwhile
    try {
      listen();
      sender_ = std::make_unique<LcmNode>(url_);
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
    arm_when_asked();
  }

  bool reach(Mode wanted) {
    return wait_for([&] { return statuses_ > 0 && mode() == wanted; });
  }

  /// Records a run of about `seconds` with a stop of the daemon, a new plant, a disarm, frames with
  /// an occluded body, and garbage among them.
  void record(double seconds) {
    const auto logger = start_logger();
    auto plant = start("softarm-plant");
    // The logger receives: now it misses nothing of the daemon.
    ASSERT_TRUE(wait_for([&] {
      std::error_code error;
      return std::filesystem::file_size(log_, error) > 1000 && !error;
    })) << logger->printed();
    const auto daemon = start("softarmd");
    ASSERT_TRUE(reach(Mode::active)) << daemon->printed();
    const std::int64_t end_ns = monotonic_now_ns() + to_ns(seconds);
    do {
      go_on(0.3);
      daemon->signal(SIGSTOP);
      go_on(0.3);
      daemon->signal(SIGCONT);
      ASSERT_TRUE(reach(Mode::vent)) << daemon->printed();
      ASSERT_TRUE(reach(Mode::active)) << daemon->printed();
      occlude();
      ASSERT_TRUE(reach(Mode::active)) << daemon->printed();
      for (const char* request : {"disarm", "arm"})
        ASSERT_EQ(end_of(*start("softarm", {request})), 0) << request;
      ASSERT_TRUE(reach(Mode::active)) << daemon->printed();
      plant->signal(SIGKILL);
      ASSERT_TRUE(reach(Mode::vent)) << daemon->printed();
      end_of(*plant);  // it holds its lock until it is gone
      plant = start("softarm-plant");
      ASSERT_TRUE(reach(Mode::active)) << daemon->printed() << plant->printed();
      ++rounds_;
      if (seconds > 60.0) go_on(20.0);
    } while (monotonic_now_ns() < end_ns);
    ASSERT_EQ(end(*daemon), 0) << daemon->printed();
    daemon_printed_ = daemon->printed();
    go_on(0.5);  // the logger writes ten times a second
    ASSERT_NE(end(*logger), -1);
  }

  /// Frames of a second sender among the plant's: a body not seen, NaN, and frame numbers that
  /// jump.
  void occlude() {
    softarm_messages::mocap_frame_t frame{};
    frame.num_bodies = 4;
    frame.bodies.resize(4);
    for (int i = 0; i < 4; ++i) frame.bodies[static_cast<std::size_t>(i)].id = i;
    for (int k = 0; k < 30; ++k) {
      frame.frame_number = 1'000'000'000 + k;
      frame.capture_time_us = monotonic_now_ns() / 1000;
      frame.bodies[1].valid = k % 2 == 0 ? 1 : 0;
      frame.bodies[1].position_m[0] = std::nan("");
      sender_->publish("SOFTARM_MOCAP", frame);
      go_on(0.005);
    }
  }

  std::unique_ptr<Process> start_logger() {  // -q: a line a second is no use here
    return start_as_is("/lcm-logger", {"-q", "--lcm-url=" + url_, log_});
  }

  int replay(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"replay", log_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto process = start("softarm", arguments);
    const int code = process->wait(300s);
    printed_ = process->printed();
    return code;
  }

  /// Positions in the log of the messages of a channel, and where they end.
  std::vector<std::pair<std::int64_t, std::int64_t>> places(const std::string& channel) {
    std::ifstream file(log_, std::ios::binary);
    EventLogReader log(file);
    std::vector<std::pair<std::int64_t, std::int64_t>> found;
    for (LogEvent event; log.next(event);)
      if (event.channel == channel)
        found.emplace_back(event.position,
                           event.position + 28 + std::ssize(channel) + std::ssize(event.data));
    return found;
  }
  void flip(std::int64_t position, int mask) {
    std::fstream file(log_, std::ios::binary | std::ios::in | std::ios::out);
    file.seekg(position);
    const int byte = file.get();
    file.seekp(position);
    file.put(static_cast<char>(byte ^ mask));
  }

  Experiment experiment_;
  std::unique_ptr<LcmNode> sender_;
  std::filesystem::path log_ = folder_ / "log";
  std::string printed_, daemon_printed_;
  int rounds_ = 0;
};

TEST_F(ReplayOfProcesses, RecordedWithFaultsIsBitExactAndDamageIsReported) {
  ASSERT_NO_FATAL_FAILURE(record(seconds_asked()));
  const auto size = std::filesystem::file_size(log_);
  EXPECT_GT(status_.frames_rejected, 10 * rounds_) << "frames to reject were among them";
  EXPECT_GT(statuses_of_[static_cast<std::size_t>(Mode::vent)], 10 * rounds_);
  EXPECT_EQ(replay(), 0) << printed_ << daemon_printed_;
  std::printf("%d rounds of faults, log of %.1f MB\n%s", rounds_, 1e-6 * static_cast<double>(size),
              printed_.c_str());
  EXPECT_NE(printed_.find("IDENTICAL"), std::string::npos);

  // A bit of a recorded command.
  const auto commands = places("SOFTARM_PRESSURE_COMMAND");
  ASSERT_GT(commands.size(), 500u);
  flip(commands[400].second - 4 * 12 + 3, 1);
  EXPECT_EQ(replay(), 2) << printed_;
  EXPECT_NE(printed_.find("command.pressure_bar[0] [bar]: recorded "), std::string::npos)
      << printed_;
  EXPECT_NE(printed_.find("byte " + std::to_string(commands[400].first) + " "), std::string::npos)
      << printed_;
  flip(commands[400].second - 4 * 12 + 3, 1);

  // A sync word in the middle, and the end cut off.
  const auto ticks = places("SOFTARM_TICK");
  flip(ticks[ticks.size() / 2].first, 0xff);
  const auto cut = static_cast<std::uintmax_t>(ticks.back().first + 40);
  std::filesystem::resize_file(log_, cut);
  EXPECT_EQ(replay(), 65) << printed_;
  EXPECT_NE(printed_.find(std::to_string(ticks[ticks.size() / 2].first) + " to "),
            std::string::npos)
      << printed_;
  EXPECT_NE(printed_.find(std::to_string(ticks.back().first) + " to " + std::to_string(cut)),
            std::string::npos)
      << printed_;
  EXPECT_NE(printed_.find("INCOMPLETE"), std::string::npos) << printed_;

  // Another configuration.
  experiment_.rate_hz = 400.0;
  std::ofstream(config_) << resolved_text(experiment_);
  EXPECT_EQ(replay(), 78) << printed_;
  EXPECT_NE(printed_.find("--any-configuration"), std::string::npos);
  EXPECT_EQ(replay({"--any-configuration"}), 2) << printed_;
}

TEST_F(ReplayOfProcesses, PlayedByLcmLogplayerTheFramesMakeAFreshDaemonActive) {
  {
    const auto logger = start_logger();
    const auto plant = start("softarm-plant");
    const auto daemon = start("softarmd");
    ASSERT_TRUE(reach(Mode::active)) << daemon->printed();
    go_on(3.0);
    ASSERT_EQ(end(*daemon), 0);
    go_on(0.3);
    ASSERT_NE(end(*logger), -1);
  }
  statuses_ = 0;
  status_ = {};
  const auto daemon = start("softarmd", {"--shadow"});
  ASSERT_TRUE(wait_for([&] { return statuses_ > 0; })) << daemon->printed();
  const auto player =
      start_as_is("/lcm-logplayer", {"--lcm-url=" + url_, "-e", "SOFTARM_MOCAP", log_});
  EXPECT_TRUE(reach(Mode::active)) << daemon->printed() << player->printed();
  EXPECT_TRUE(wait_for([&] { return status_.frames_accepted > 100; })) << seen_text();
}

}  // namespace
}  // namespace softarm
