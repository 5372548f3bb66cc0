// A record of statuses may go on for any time: what it keeps is bounded, and no row is lost.
#include "softarm/recording/status_record.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "counted_malloc.hpp"
#include "softarm/config/load.hpp"
#include "softarm/recording/tracking_summary.hpp"
#include "test_folder.hpp"
#include "unit/transport/messages.hpp"

namespace softarm {
namespace {

namespace fs = std::filesystem;
using softarm_messages::controller_status_t;
using softarm_messages::plant_state_t;

LogRow row_of_simulated_arm(std::int64_t k) {
  LogRow row;
  row.t_s = 0.002 * static_cast<double>(k);
  row.mode = Mode::active;
  row.reference = SegmentVector::Constant(2, 0.1);
  row.truth = SegmentVector::Constant(2, 0.1 + 0.01 * std::sin(0.001 * static_cast<double>(k)));
  row.commanded = PressureVector::Constant(4, 0.2);
  // 1 mm off in the first 400 s, 3 mm from there on.
  row.tip_reference = Eigen::Vector3d(0.0, 0.0, -0.1);
  row.tip = *row.tip_reference + Eigen::Vector3d(row.t_s < 400.0 ? 0.001 : 0.003, 0.0, 0.0);
  return row;
}

double tracking(const std::string& key, const std::string& json) {
  return nlohmann::json::parse(json)["tracking"][key].get<double>();
}

TEST(TrackingSummary, KeepsNoMoreOfALongRunThanOfAShortOne) {
  if (SOFTARM_COUNTS_MALLOC == 0) GTEST_SKIP() << "a sanitizer has its own malloc";
  TrackingSummary summary(1, 0.0);
  std::int64_t k = 0;
  for (; k < 200'000; ++k) summary.add(row_of_simulated_arm(k), 0.002);
  const long before = test::thread_allocations;
  for (; k < 800'000; ++k) summary.add(row_of_simulated_arm(k), 0.002);
  EXPECT_EQ(test::thread_allocations, before) << "rows are not kept";
}

TEST(TrackingSummary, SeparatesTheHalvesOfALongRun) {
  TrackingSummary summary(1, 0.0);
  for (std::int64_t k = 0; k < 400'000; ++k) summary.add(row_of_simulated_arm(k), 0.002);
  // 800 s: the first half is 1 mm off, the second 3 mm.
  const std::string json = summary.json();
  EXPECT_NEAR(tracking("tip_rms_m", json), std::sqrt((1.0 + 9.0) / 2.0) * 1e-3, 1e-8);
  EXPECT_NEAR(tracking("tip_rms_second_half_m", json), 3e-3, 1e-6);
}

class StatusRecords : public ::testing::Test {
 protected:
  bool take(StatusRecord& record, std::int64_t time_us) {
    auto status = test::example<controller_status_t>(3, 4);
    status.time_us = time_us;
    status.flags = 0;
    return record.take(experiment_.transport.lcm.status_channel, test::encoded(status));
  }
  std::int64_t logged_rows() const {
    std::ifstream file(folder_ / "log.csv");
    std::int64_t rows = -2;  // provenance and names
    for (std::string line; std::getline(file, line);) ++rows;
    return rows;
  }

  /// A cell of the first row.
  double logged(const std::string& column) const {
    std::ifstream file(folder_ / "log.csv");
    std::string names, row;
    std::getline(file, names);  // provenance
    std::getline(file, names);
    std::getline(file, row);
    std::istringstream name_cells(names), row_cells(row);
    for (std::string name, cell; std::getline(name_cells, name, ',');) {
      std::getline(row_cells, cell, ',');
      if (name == column) return std::stod(cell);
    }
    return std::nan("");
  }

  Experiment experiment_ = load_experiment(SOFTARM_SOURCE_DIR "/config/paper_arm.yaml");
  TestFolder folder_;
};

// The daemon of another machine, after that was started again.
TEST_F(StatusRecords, LoseNoRowWhereTheDaemonsClockBeginsAgain) {
  StatusRecord record(experiment_, folder_.path());
  constexpr int kAfter = 6000;
  for (int k = 0; k < 10; ++k) ASSERT_TRUE(take(record, 5'000'000'000 + 2000 * k));
  for (int k = 0; k < kAfter; ++k) {
    ASSERT_TRUE(take(record, 1'000'000 + 2000 * k));
  }
  record.close();
  EXPECT_EQ(logged_rows(), 10 + kAfter);
}

TEST_F(StatusRecords, GiveARowTheTruthBetweenTwoReportsOfTheSimulatedArm) {
  StatusRecord record(experiment_, folder_.path());
  auto state = test::example<plant_state_t>(3, 4);
  const auto report = [&](std::int64_t time_us, double u_rad) {
    state.time_us = time_us;
    state.u_rad.assign(3, {u_rad, 0.0});
    state.velocity_radps.assign(3, {0.0, 0.0});
    EXPECT_FALSE(record.take(experiment_.transport.lcm.plant_channel, test::encoded(state)));
  };
  report(1'000'000, 0.0);
  // What a status of 500 Hz asks for holds 1 ms after its tick: a quarter of the way.
  ASSERT_TRUE(take(record, 1'001'500));
  report(1'010'000, 1.0);
  record.close();
  ASSERT_EQ(logged_rows(), 1);
  constexpr double s = 0.25;
  EXPECT_NEAR(logged("true1_x_rad"), s * s * (3 - 2 * s), 1e-9);
  EXPECT_NEAR(logged("u1_x_rad"), 1.0, 1e-9) << "of the status";
}

}  // namespace
}  // namespace softarm
