// log.csv and timing.json as a reader of the files sees them.
#include "softarm/recording/experiment_log.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "softarm/config/load.hpp"
#include "test_folder.hpp"

namespace softarm {
namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line + ",");
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

class WrittenLog : public ::testing::Test {
 protected:
  /// Lines of log.csv with these rows in it.
  std::vector<std::string> lines(const std::vector<LogRow>& rows) {
    ExperimentLog log(folder_, experiment_);
    for (const LogRow& row : rows) log.add(row);
    log.close();
    std::ifstream file(folder_ / "log.csv");
    std::vector<std::string> found;
    for (std::string line; std::getline(file, line);) found.push_back(line);
    return found;
  }
  std::string cell(const std::vector<std::string>& lines, std::size_t row,
                   const std::string& column) {
    const std::vector<std::string> names = split(lines.at(1)), cells = split(lines.at(2 + row));
    const auto at = std::find(names.begin(), names.end(), column) - names.begin();
    return at < static_cast<std::ptrdiff_t>(cells.size()) ? cells[static_cast<std::size_t>(at)]
                                                          : "no column " + column;
  }

  Experiment experiment_ =
      load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / "paper_arm.yaml");
  TestFolder parent_;
  std::filesystem::path folder_ = parent_ / "record";  // not there yet
};

TEST_F(WrittenLog, EveryNumberStandsUnderItsName) {
  LogRow row;
  row.t_s = 1.25;
  row.mode = Mode::hold;
  row.reason = Reason::frames_late;
  row.saturated = true;
  row.frame_age_s = 0.012;
  row.u = Eigen::VectorXd::LinSpaced(6, 0.1, 0.6);
  row.truth = -row.u;
  row.residual_torsion = Eigen::Vector3d(0.01, 0.02, 0.03);
  row.commanded = Eigen::VectorXd::LinSpaced(12, 1.0, 12.0);
  row.tip = Eigen::Vector3d(-0.1, 0.2, -0.3);
  const auto found = lines({row});
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0], provenance_line(experiment_));
  EXPECT_EQ(split(found[1]).size(), split(found[2]).size());
  EXPECT_EQ(cell(found, 0, "t_s"), "1.25");
  EXPECT_EQ(cell(found, 0, "mode"), "HOLD");
  EXPECT_EQ(cell(found, 0, "reason"), "frames_late");
  EXPECT_EQ(cell(found, 0, "saturated"), "1");
  EXPECT_EQ(cell(found, 0, "u2_y_rad"), "0.4");
  EXPECT_EQ(cell(found, 0, "true3_x_rad"), "-0.5");
  EXPECT_EQ(cell(found, 0, "twist2_rad"), "0.02");
  EXPECT_EQ(cell(found, 0, "p2_3_bar"), "7");
  EXPECT_EQ(cell(found, 0, "tip_z_m"), "-0.3");
}

TEST_F(WrittenLog, WhatIsNotKnownIsAnEmptyCell) {
  const auto found = lines({LogRow{}, LogRow{}});
  ASSERT_EQ(found.size(), 4U);
  EXPECT_EQ(split(found[1]).size(), split(found[2]).size());
  for (const char* column : {"frame_age_s", "u1_x_rad", "true1_x_rad", "p1_1_bar", "tipref_x_m"})
    EXPECT_EQ(cell(found, 1, column), "") << column;
}

TEST_F(WrittenLog, AFolderThatCannotBeMadeIsAnError) {
  std::ofstream(folder_.string()) << "a file of that name";
  EXPECT_THROW(ExperimentLog(folder_ / "out", experiment_), std::runtime_error);
}

TEST_F(WrittenLog, AFullDiskIsAnError) {
  std::filesystem::create_directories(folder_);
  std::filesystem::create_symlink("/dev/full", folder_ / "log.csv");
  ExperimentLog log(folder_, experiment_);
  log.add(LogRow{});
  EXPECT_THROW(log.close(), std::runtime_error);
  EXPECT_THROW(write_text("/dev/full", "text", {}), std::runtime_error);
}

TEST(TimingReport, HasQuantilesAndCounts) {
  DurationHistogram tick;
  for (int k = 0; k < 99; ++k) tick.add_ns(9'000);
  tick.add_ns(700'000);
  const TimingReport report{.real_time_factor = 42.5,
                            .histograms = {{"tick_us", tick.counts(), tick.max_us()}}};
  const auto json = nlohmann::json::parse(timing_json(report));
  EXPECT_EQ(json["real_time_factor"], 42.5);
  EXPECT_NEAR(json["tick_us"]["p50"], 11.3, 0.1);  // the bucket from 8 us on ends at 8 sqrt 2
  EXPECT_EQ(json["tick_us"]["max"], 700.0);
  const auto& counts = json["histograms"]["tick_us"]["counts"];
  const auto& edges = json["histograms"]["tick_us"]["edges_us"];
  ASSERT_EQ(counts.size(), edges.size());
  int total = 0;
  for (const int count : counts) total += count;
  EXPECT_EQ(total, 100);
  EXPECT_EQ(edges[6], 8.0);
  EXPECT_EQ(counts[6], 99);
}

}  // namespace
}  // namespace softarm
