// lcm-logger beside softarmd and softarm-plant while things go wrong, then softarm replay of what
// it wrote; and lcm-logplayer into a daemon that knows nothing of it. SOFTARM_REPLAY_SECONDS sets
// how long the run is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <softarm_messages/mocap_frame_t.hpp>

#include "integration/processes/process.hpp"
#include "softarm/base/clock.hpp"
#include "softarm/client/arm_client.hpp"
#include "softarm/config/load.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/transport/event_log.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
using test::Process;

double seconds_asked() {
  const char* asked = std::getenv("SOFTARM_REPLAY_SECONDS");
  return asked == nullptr ? 8.0 : std::atof(asked);
}

class ReplayOfProcesses : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::temp_directory_path() / ("softarm_replay_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    url_ = "udpm://239.255.76.67:" + std::to_string(20000 + getpid() % 12000) + "?ttl=0";
    config_ = folder_ / "config.yaml";
    log_ = folder_ / "log";
    experiment_.transport.lcm.url = url_;
    std::ofstream(config_) << resolved_text(
        experiment_);  // all of it: nothing may change meanwhile
    try {
      client_ = std::make_unique<ArmClient>(experiment_);
      client_->on_status([this](const ArmStatus& status) {
        status_ = status;
        ++statuses_;
        modes_[static_cast<std::size_t>(status_.mode)] += 1;
      });
      sender_ = std::make_unique<LcmNode>(url_);
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::unique_ptr<Process> start(const std::string& program, std::vector<std::string> arguments) {
    return std::make_unique<Process>(program, arguments,
                                     folder_ / ("printed" + std::to_string(started_++)));
  }
  bool wait_for(const std::function<bool()>& reached, double patience_s = 20.0) {
    return client_->wait_for(reached, patience_s);
  }
  bool reach(Mode mode) {
    return wait_for([&] { return statuses_ > 0 && status_.mode == mode; });
  }
  void go_on(double seconds) {
    wait_for([] { return false; }, seconds);
  }

  /// Records a run of about `seconds` with a stop of the daemon, a new plant, a disarm, frames with
  /// an occluded body, and garbage among them.
  void record(double seconds) {
    // -q: a line a second is no use here.
    const auto logger = start("/lcm-logger", {"-q", "--lcm-url=" + url_, log_});
    auto plant = start("softarm-plant", {config_});
    // The logger hears: now nothing of the daemon can escape it.
    ASSERT_TRUE(wait_for([&] {
      std::error_code error;
      return std::filesystem::file_size(log_, error) > 1000 && !error;
    })) << logger->printed();
    const auto daemon = start("softarmd", {config_});
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
      ASSERT_EQ(start("softarm", {"disarm", config_})->wait(60s), 0);
      ASSERT_EQ(start("softarm", {"arm", config_})->wait(60s), 0);
      ASSERT_TRUE(reach(Mode::active)) << daemon->printed();
      plant->signal(SIGKILL);
      ASSERT_TRUE(reach(Mode::vent)) << daemon->printed();
      plant->wait(10s);  // it holds its lock until it is gone
      plant = start("softarm-plant", {config_});
      ASSERT_TRUE(reach(Mode::active)) << daemon->printed() << plant->printed();
      ++rounds_;
      if (seconds > 60.0) go_on(20.0);
    } while (monotonic_now_ns() < end_ns);
    daemon->signal(SIGTERM);
    ASSERT_EQ(daemon->wait(5s), 0) << daemon->printed();
    daemon_printed_ = daemon->printed();
    go_on(0.5);  // the logger writes ten times a second
    logger->signal(SIGTERM);
    ASSERT_NE(logger->wait(10s), -1);
  }

  /// Frames of a sender of our own among the plant's: a body not seen, numbers that are none, and
  /// numbers that jump.
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

  int replay(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"replay", log_, config_};
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

  Experiment experiment_ =
      load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) / "config/paper_arm.yaml");
  std::filesystem::path folder_, config_, log_;
  std::string url_, printed_, daemon_printed_;
  std::unique_ptr<ArmClient> client_;
  std::unique_ptr<LcmNode> sender_;
  ArmStatus status_;
  std::array<int, 16> modes_{};
  int statuses_ = 0, started_ = 0, rounds_ = 0;
};

TEST_F(ReplayOfProcesses, RecordedWithFaultsIsBitExactAndDamageIsTold) {
  ASSERT_NO_FATAL_FAILURE(record(seconds_asked()));
  const auto size = std::filesystem::file_size(log_);
  EXPECT_GT(status_.frames_rejected, 10 * rounds_) << "frames not to be believed were among them";
  EXPECT_GT(modes_[static_cast<std::size_t>(Mode::vent)], 10 * rounds_);
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
    const auto logger = start("/lcm-logger", {"-q", "--lcm-url=" + url_, log_});
    const auto plant = start("softarm-plant", {config_});
    const auto daemon = start("softarmd", {config_});
    ASSERT_TRUE(reach(Mode::active)) << daemon->printed();
    go_on(3.0);
    daemon->signal(SIGTERM);
    ASSERT_EQ(daemon->wait(5s), 0);
    go_on(0.3);
    logger->signal(SIGTERM);
    ASSERT_NE(logger->wait(10s), -1);
  }
  statuses_ = 0;
  status_ = {};
  const auto daemon = start("softarmd", {"--shadow", config_});
  ASSERT_TRUE(wait_for([&] { return statuses_ > 0; })) << daemon->printed();
  const auto player = start("/lcm-logplayer", {"--lcm-url=" + url_, "-e", "SOFTARM_MOCAP", log_});
  EXPECT_TRUE(reach(Mode::active)) << daemon->printed() << player->printed();
  EXPECT_GT(status_.frames_accepted, 40);
}

}  // namespace
}  // namespace softarm
