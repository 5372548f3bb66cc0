// A run as its messages tell it: whose statuses count, and what a simulated arm adds to them.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "softarm/config/load.hpp"
#include "softarm/recording/status_record.hpp"
#include "softarm/transport/settings.hpp"
#include "test_folder.hpp"
#include "unit/transport/messages.hpp"

namespace softarm {
namespace {

using softarm_messages::controller_status_t;
using softarm_messages::plant_state_t;
using test::encoded;

constexpr std::int64_t kPeriod_us = 2000, kStart_us = 50'000'000;

/// A motion whose interpolation by cubics is exact.
double truth_rad(double t_s, std::size_t component) {
  return 0.1 + 0.2 * t_s - 0.3 * t_s * t_s +
         0.05 * static_cast<double>(component + 1) * t_s * t_s * t_s;
}
double truth_radps(double t_s, std::size_t component) {
  return 0.2 - 0.6 * t_s + 0.15 * static_cast<double>(component + 1) * t_s * t_s;
}

plant_state_t plant_at(std::int64_t time_us) {
  auto state = test::example<plant_state_t>(3, 4);
  state.time_us = time_us;
  const double t_s = 1e-6 * static_cast<double>(time_us - kStart_us);
  for (std::size_t c = 0; c < 6; ++c) {
    state.u_rad[c / 2][c % 2] = truth_rad(t_s, c);
    state.velocity_radps[c / 2][c % 2] = truth_radps(t_s, c);
  }
  return state;
}

controller_status_t status_at(std::int64_t tick, Mode mode = Mode::active, int segments = 3) {
  auto status = test::example<controller_status_t>(segments, 4);
  status.time_us = kStart_us + kPeriod_us * tick;
  status.tick = tick;
  status.mode = static_cast<std::int8_t>(mode);
  status.reason = 0;
  status.flags = 0;
  return status;
}

TEST(TruthTrack, IsExactForACubicBetweenTwoReportsAndEmptyElsewhere) {
  TruthTrack truth;
  LogRow row;
  truth.fill(kStart_us, row);
  EXPECT_EQ(row.truth.size(), 0);
  for (const std::int64_t time_us : {kStart_us, kStart_us + 500'000}) {
    PlantState state;
    ASSERT_TRUE(decode(encoded(plant_at(time_us)), state));
    truth.add(state);
  }
  EXPECT_TRUE(truth.reaches(kStart_us + 500'000));
  EXPECT_FALSE(truth.reaches(kStart_us + 500'001));
  for (const std::int64_t later_us : {0, 123'456, 250'000, 500'000}) {
    truth.fill(kStart_us + later_us, row);
    ASSERT_EQ(row.truth.size(), 6);
    for (std::size_t c = 0; c < 6; ++c)
      EXPECT_NEAR(row.truth[static_cast<Eigen::Index>(c)],
                  truth_rad(1e-6 * static_cast<double>(later_us), c), 1e-14);
  }
  LogRow later;
  truth.fill(kStart_us + 500'001, later);
  EXPECT_EQ(later.truth.size(), 0);
  EXPECT_FALSE(later.tip);
}

class Record : public ::testing::Test {
 protected:
  bool take(StatusRecord& record, const controller_status_t& status) {
    return record.take(experiment_.transport.lcm.status_channel, encoded(status));
  }
  /// Rows of log.csv, cell by cell, the two lines before them left out.
  std::vector<std::vector<std::string>> rows() const {
    std::ifstream file(folder_ / "log.csv");
    std::vector<std::vector<std::string>> found;
    for (std::string line; std::getline(file, line);) {
      if (line.starts_with('#') || line.starts_with('t')) continue;
      std::istringstream stream(line + ",");
      found.emplace_back();
      for (std::string cell; std::getline(stream, cell, ',');) found.back().push_back(cell);
    }
    return found;
  }
  nlohmann::json summary() const {
    return nlohmann::json::parse(std::ifstream(folder_ / "summary.json"));
  }

  Experiment experiment_ =
      load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / "paper_arm.yaml");
  TestFolder parent_;
  std::filesystem::path folder_ = parent_ / "record";  // not there yet
};

TEST_F(Record, EveryStatusIsARowAndTheTruthOfItsInstantIsInIt) {
  StatusRecord record(experiment_, folder_);
  const std::string& plant = experiment_.transport.lcm.plant_channel;
  for (std::int64_t k = 0; k < 1000; ++k) {
    if (k % 4 == 0) record.take(plant, encoded(plant_at(kStart_us + kPeriod_us * k)));
    EXPECT_TRUE(take(record, status_at(k)));
  }
  EXPECT_NEAR(record.time_s(), 2.0, 0.01);
  EXPECT_EQ(record.rows(), 1000);
  record.close();
  const auto found = rows();
  ASSERT_EQ(found.size(), 1000U);
  EXPECT_EQ(found[500][1], "ACTIVE");
  EXPECT_NEAR(std::stod(found[500][0]), 1.0, 1e-9);
  // The row belongs to the middle of its period.
  const std::size_t truth_x = 5 + 6;
  EXPECT_NEAR(std::stod(found[500][truth_x]), truth_rad(1.001, 0), 1e-8);
  EXPECT_EQ(found[999][truth_x], "") << "the plant did not say it any more";
  EXPECT_EQ(summary()["ticks"], 1000);
  EXPECT_FALSE(summary()["tracking"]["u_rms_rad"].is_null());
}

TEST_F(Record, WithoutASimulatedArmRowsAreWrittenAllTheSame) {
  StatusRecord record(experiment_, folder_);
  for (std::int64_t k = 0; k < 10; ++k) take(record, status_at(k, Mode::hold));
  record.close();
  ASSERT_EQ(rows().size(), 10U);
  EXPECT_EQ(rows()[9][1], "HOLD");
  EXPECT_TRUE(summary()["tracking"]["u_rms_rad"].is_null());
}

TEST_F(Record, OtherArmsAndMessagesThatAreNoneDoNotCount) {
  StatusRecord record(experiment_, {});
  EXPECT_FALSE(take(record, status_at(1, Mode::active, 2)));
  EXPECT_FALSE(record.take("ANOTHER_CHANNEL", encoded(status_at(2))));
  auto broken = encoded(status_at(3));
  broken.resize(broken.size() - 1);
  EXPECT_FALSE(record.take(experiment_.transport.lcm.status_channel, broken));
  EXPECT_EQ(record.rows(), 0);
  EXPECT_TRUE(take(record, status_at(4)));
  EXPECT_EQ(record.rows(), 1);
  EXPECT_FALSE(std::filesystem::exists(folder_));
}

TEST_F(Record, AShadowCountsUntilTheDaemonThatMovesTheArmIsHeard) {
  StatusRecord record(experiment_, {});
  auto shadow = status_at(1);
  shadow.flags = controller_status_t::SHADOW;
  EXPECT_TRUE(take(record, shadow));
  EXPECT_TRUE(take(record, status_at(2)));
  shadow.tick = 3;
  EXPECT_FALSE(take(record, shadow));
  EXPECT_EQ(record.status().tick, 2);
  EXPECT_EQ(record.rows(), 2);
}

}  // namespace
}  // namespace softarm
