// softarm report on logs as lcm-logger writes them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "program_output.hpp"
#include "test_folder.hpp"
#include "unit/recording/recorded_log.hpp"

namespace softarm {
namespace {

namespace fs = std::filesystem;
using test::Outcome;

const std::string kConfig = SOFTARM_SOURCE_DIR "/config/paper_arm.yaml";

class Report : public ::testing::Test {
 protected:
  Outcome report(const std::string& bytes, const std::string& config = kConfig) {
    folder_.write("log", bytes);
    return test::run("report --no-plots --out '" + (folder_ / "out").string() + "' '" +
                     (folder_ / "log").string() + "' '" + config + "'");
  }
  /// Second column of log.csv.
  std::vector<std::string> logged_modes() const {
    std::ifstream file(folder_ / "out/log.csv");
    std::vector<std::string> modes;
    for (std::string line; std::getline(file, line);) {
      if (line.empty() || line[0] == '#' || line[0] == 't') continue;
      const auto comma = line.find(',') + 1;
      modes.push_back(line.substr(comma, line.find(',', comma) - comma));
    }
    return modes;
  }

  TestFolder folder_;
};

TEST_F(Report, HasARowForEveryStatusOfALogWithFaultsInIt) {
  test::LogBytes log;
  const test::RecordedRun run = test::record_run(load_experiment(kConfig), 4.0, false, log);
  const Outcome outcome = report(log.bytes);
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  const std::vector<std::string> modes = logged_modes();
  ASSERT_EQ(modes.size(), run.modes.size());
  for (std::size_t k = 0; k < modes.size(); ++k) ASSERT_EQ(modes[k], name(run.modes[k])) << k;
  for (const char* file : {"summary.json", "timing.json"}) {
    EXPECT_TRUE(fs::exists(folder_ / "out" / file)) << file;
  }
}

TEST_F(Report, StepsOverDamageAndSaysWhere) {
  test::LogBytes log;
  const test::RecordedRun run = test::record_run(load_experiment(kConfig), 1.0, false, log);
  std::string bytes = log.bytes;
  const std::size_t event = bytes.find("\xED\xA1\xDA\x01", bytes.size() / 2);
  bytes.replace(event, 100, std::string(100, 'x'));
  const Outcome outcome = report(bytes);
  EXPECT_EQ(outcome.code, 65);
  EXPECT_NE(outcome.text.find("damaged"), std::string::npos) << outcome.text;
  EXPECT_GE(logged_modes().size(), run.modes.size() - 2);
}

// A damaged time is left out: nothing overflows, and the run is not longer because of it.
TEST_F(Report, LeavesOutAStatusOfAnImpossibleTime) {
  test::LogBytes log;
  const test::RecordedRun run = test::record_run(load_experiment(kConfig), 1.0, false, log);
  std::string bytes = log.bytes;
  const std::string channel = "SOFTARM_STATUS";
  std::size_t at = bytes.size() / 2;
  for (const char* time : {"\x7f\xff\xff\xff\xff\xff\xff\xff", "\x80\0\0\0\0\0\0\0"}) {
    at = bytes.find(channel, at + 1);
    ASSERT_NE(at, std::string::npos);
    bytes.replace(at + channel.size() + 8, 8, time, 8);  // after the hash of the type
  }
  const Outcome outcome = report(bytes);
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_EQ(logged_modes().size(), run.modes.size() - 2);
}

TEST_F(Report, SaysWhatALogLacks) {
  const Outcome empty = report("");
  EXPECT_EQ(empty.code, 65);
  EXPECT_NE(empty.text.find("status_channel"), std::string::npos) << empty.text;
  // Of another arm nothing is reported.
  test::LogBytes log;
  test::record_run(load_experiment(kConfig), 0.5, false, log);
  EXPECT_EQ(report(log.bytes, SOFTARM_SOURCE_DIR "/config/one_segment.yaml").code, 65);
}

}  // namespace
}  // namespace softarm
