// Two recordings of a real pneumatic arm through the whole pipeline: CSV -> softarm import -> log
// -> softarm run --mocap, and log -> lcm-logplayer -> softarmd --shadow.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <lcm/lcm-cpp.hpp>

#include "integration/processes/process.hpp"
#include "own_url.hpp"
#include "softarm/client/arm_client.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/logged_run.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "softarm/transport/message_decoding.hpp"
#include "test_folder.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
using test::Process;

const std::filesystem::path kSource = SOFTARM_SOURCE_DIR;
const std::filesystem::path kData = kSource.parent_path() / "shared" / "data";

struct Change {
  double t_s;
  Mode mode;
};

class Recordings : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kData)) GTEST_SKIP() << "the recordings are not here: " << kData;
  }

  std::filesystem::path import(const char* table, const char* map) {
    const auto log = folder_ / "log";
    Process process(
        "softarm", {"import", kData / table, kSource / "config" / "recordings" / map, "--out", log},
        folder_ / "import");
    EXPECT_EQ(process.wait(60s), 0) << process.printed();
    return log;
  }

  TestFolder folder_;
};

/// When each new frame arrived, read without our code: times of the log's events whose frame number
/// is new, in s since the first event on the channel.
std::vector<double> new_frame_times(const std::filesystem::path& path) {
  lcm::LogFile log(path.string(), "r");
  std::vector<double> times;
  std::int64_t start_us = -1, last_number = -1;
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    if (event->channel != "SOFTARM_MOCAP") continue;
    softarm_messages::mocap_frame_t frame{};
    EXPECT_GT(frame.decode(event->data, 0, event->datalen), 0);
    if (start_us < 0) start_us = event->timestamp;
    bool seen = true;
    for (const auto& body : frame.bodies) seen = seen && body.valid != 0;
    if (!seen || frame.frame_number == last_number) continue;
    last_number = frame.frame_number;
    times.push_back(1e-6 * static_cast<double>(event->timestamp - start_us));
  }
  return times;
}

struct Passage {
  std::vector<Change> changes;
  FrameCounters counters;
  std::vector<Eigen::Vector2d> u;  ///< every tick, 100 Hz
  double largest_speed_radps = 0.0;
};

Passage pass(const char* config, const std::filesystem::path& log) {
  const Experiment experiment = load_experiment(kSource / "config" / config);
  LoggedRun run(experiment, log);
  LogRow row;
  Passage passage;
  while (run.step(row)) {
    if (passage.changes.empty() || passage.changes.back().mode != row.mode)
      passage.changes.push_back({row.t_s, row.mode});
    passage.u.emplace_back(row.u);
    EXPECT_TRUE(row.u.allFinite() && row.velocity.allFinite());
    if (row.mode == Mode::active)
      passage.largest_speed_radps = std::max(passage.largest_speed_radps, row.velocity.norm());
  }
  passage.counters = run.pipeline().counters();
  return passage;
}

/// Every gap longer than `hold_s` must show as a HOLD when it has lasted so long, and nothing else
/// may.
void expect_holds_where_gaps_are(const std::filesystem::path& log,
                                 const std::vector<Change>& changes, double hold_s) {
  constexpr double kTick_s = 0.01;
  std::vector<double> due;
  const auto times = new_frame_times(log);
  for (std::size_t k = 1; k < times.size(); ++k)
    if (times[k] - times[k - 1] > hold_s + kTick_s) due.push_back(times[k - 1] + hold_s);
  std::vector<double> held;
  for (const Change& change : changes)
    if (change.mode == Mode::hold) held.push_back(change.t_s);
  for (const double t_s : due)
    EXPECT_TRUE(std::any_of(held.begin(), held.end(),
                            [&](double h) { return h >= t_s && h <= t_s + kTick_s + 1e-6; }))
        << "a gap should hold at " << t_s << " s";
  // A gap between hold_s and one tick more may or may not be caught by a tick: it is justified, not
  // demanded.
  for (const double h : held) {
    const auto after = std::upper_bound(times.begin(), times.end(), h);
    ASSERT_NE(after, times.begin());
    EXPECT_GT(h - *(after - 1), hold_s) << "HOLD at " << h << " s without a gap";
  }
}

void expect_changes(const std::vector<Change>& got, const std::vector<Change>& expected) {
  ASSERT_EQ(got.size(), expected.size());
  for (std::size_t k = 0; k < got.size(); ++k) {
    EXPECT_EQ(got[k].mode, expected[k].mode) << "change " << k;
    EXPECT_NEAR(got[k].t_s, expected[k].t_s, 1e-6) << "change " << k;
  }
}

TEST_F(Recordings, CircleHoldsAtItsThreeGapsAndNowhereElse) {
  const auto log = import("four_columns_circle.csv", "circle_map.yaml");
  const Passage passage = pass("recorded_circle.yaml", log);
  expect_changes(passage.changes, {{0.0, Mode::wait_frames},
                                   {0.95, Mode::active},
                                   {21.28, Mode::hold},
                                   {22.14, Mode::active},
                                   {82.47, Mode::hold},
                                   {83.35, Mode::active},
                                   {117.19, Mode::hold},
                                   {117.99, Mode::active}});
  expect_holds_where_gaps_are(log, passage.changes, 3 * 0.018);
  EXPECT_EQ(passage.counters.repeated, 5122);
  EXPECT_EQ(passage.counters.missing, 82);
  EXPECT_EQ(passage.counters.not_seen, 1);
  EXPECT_EQ(passage.counters.rejected(), 1);

  // The columns repeat every 10 s, so must u: after the warm-up two periods differ by a fraction of
  // the motion.
  double difference = 0.0, motion = 0.0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t k = 3000; k < 10000; ++k) mean += passage.u[k] / 7000.0;
  for (std::size_t k = 3000; k < 10000; ++k) {
    difference += (passage.u[k + 1000] - passage.u[k]).squaredNorm();
    motion += (passage.u[k] - mean).squaredNorm();
  }
  EXPECT_LT(std::sqrt(difference / motion), 0.15);
  EXPECT_GT(std::sqrt(motion / 7000.0), 0.02);
  EXPECT_LT(passage.largest_speed_radps, 1.0);
}

TEST_F(Recordings, SineNeverHolds) {
  // 649 gaps above 0.1 s are this recording's rhythm (8 poses a second); none reaches three of its
  // periods.
  const auto log = import("one_column_sine.csv", "sine_map.yaml");
  const Passage passage = pass("recorded_sine.yaml", log);
  expect_changes(passage.changes, {{0.0, Mode::wait_frames}, {0.29, Mode::active}});
  expect_holds_where_gaps_are(log, passage.changes, 3 * 0.125);
  EXPECT_EQ(passage.counters.repeated, 308);
  EXPECT_EQ(passage.counters.missing, 10561);
  EXPECT_EQ(passage.counters.rejected(), 0);
}

TEST_F(Recordings, SineJudgedAsAHundredHertzStreamHoldsAndVentsAtItsGaps) {
  // The same log declared as a 100 Hz stream: every gap beyond 30 ms is one too many, those beyond
  // 100 ms vent.
  const auto log = import("one_column_sine.csv", "sine_map.yaml");
  Experiment experiment = load_experiment(kSource / "config" / "recorded_sine.yaml");
  experiment.safety.frame_period_s = 0.01;
  experiment.safety.good_frames = 1;
  LoggedRun run(experiment, log);
  const auto times = new_frame_times(log);
  LogRow row;
  int vents = 0;
  while (run.step(row)) {
    const auto after = std::upper_bound(times.begin(), times.end(), row.t_s + 1e-9);
    ASSERT_NE(after, times.begin());
    const double age_s = row.t_s - *(after - 1);
    if (row.mode == Mode::active) {
      ASSERT_LE(age_s, 0.03 + 1e-6) << row.t_s;
    }
    if (age_s > 0.1 + 1e-6 && row.t_s > 0.5) {
      ASSERT_EQ(row.mode, Mode::vent) << row.t_s;
    }
    vents += row.mode == Mode::vent ? 1 : 0;
  }
  EXPECT_GT(vents, 1000);
}

TEST_F(Recordings, PlayedIntoAShadowDaemonTheyGoThroughThePipeline) {
  const auto log = import("four_columns_circle.csv", "circle_map.yaml");
  const std::string url = test::own_url();
  const auto config = folder_ / "config.yaml";
  std::ofstream(config) << "include: " << kSource / "config" / "recorded_circle.yaml"
                        << "\ndaemon:\n  lcm: {url: \"" << url << "\"}\n";
  std::unique_ptr<ArmClient> client;
  try {
    client = std::make_unique<ArmClient>(config);
  } catch (const TransportError& error) {
    GTEST_SKIP() << error.what();
  }
  ArmStatus status;  // of a shadow
  int active = 0;    // a busy machine may be late with a frame: HOLD for a while is no fault
  client->on_status([&](const ArmStatus& newest) {
    status = newest;
    if (status.mode == Mode::active) ++active;
  });
  Process daemon("softarmd", {"--shadow", config}, folder_ / "daemon");
  Process player("/lcm-logplayer", {"--lcm-url=" + url, "-e", "SOFTARM_MOCAP", log},
                 folder_ / "player");
  EXPECT_TRUE(client->wait_for([&] { return status.frames_accepted >= 200; }, 30.0))
      << daemon.printed() << player.printed();
  EXPECT_GT(active, 50) << daemon.printed();
  EXPECT_GT(status.frames_repeated, 50);
  ASSERT_TRUE(client->command());
  EXPECT_TRUE(client->command()->shadow);
  EXPECT_FALSE(client->status()) << "of a daemon that commands there is none";
  EXPECT_GT(status.theta_rad[0], 1e-3);
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(1000ms), 0) << daemon.printed();
}

}  // namespace
}  // namespace softarm
