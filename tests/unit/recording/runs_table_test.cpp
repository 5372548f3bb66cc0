#include "softarm/recording/runs_table.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "test_folder.hpp"

namespace softarm {
namespace {

class RunsTable : public ::testing::Test {
 protected:
  /// With one blank between them.
  static std::string words(const std::string& line) {
    std::istringstream stream(line);
    std::string text, word;
    while (stream >> word) text += (text.empty() ? "" : " ") + word;
    return text;
  }
  void write(const std::string& run, const std::string& summary) {
    std::filesystem::create_directories(folder_.path() / run);
    std::ofstream(folder_.path() / run / "summary.json") << summary;
  }
  TestFolder folder_;
};

TEST_F(RunsTable, HasALineForEveryRun) {
  write("b/second",
        R"({"duration_s":6.0,"tracking":{"u_rms_rad":0.0123,"tip_rms_m":0.0004},
            "pressure_bar":{"max":0.5},"saturated_fraction":0.25,"modes":{"ACTIVE":5.7},
            "transitions":[{"t_s":0.1,"mode":"ACTIVE","reason":"none"},
                           {"t_s":5.8,"mode":"VENT","reason":"disarmed"}]})");
  write("a", R"({"duration_s":2.0,"tracking":{"u_rms_rad":null},"torque_nm":{"max":1.5}})");
  write("c", "not JSON");
  const auto table = runs_table(folder_.path());
  EXPECT_EQ(table.unreadable, Files{folder_.path() / "c" / "summary.json"});
  std::istringstream lines(table.text);
  std::string head, a, b, c;
  ASSERT_TRUE(std::getline(lines, head) && std::getline(lines, a) && std::getline(lines, b) &&
              std::getline(lines, c));
  EXPECT_EQ(words(head).substr(0, 27), "run duration [s] ACTIVE [s]");
  EXPECT_EQ(words(a), "a 2.0 - - - - 1.500 N m -");
  EXPECT_EQ(words(b), "b/second 6.0 5.7 VENT 12.30 0.40 0.500 bar 25.00");
  EXPECT_EQ(words(c), "c unreadable summary.json");
  EXPECT_EQ(head.size(), a.size()) << "columns are aligned";
}

TEST_F(RunsTable, NeedsARun) {
  EXPECT_THROW(runs_table(folder_.path()), std::runtime_error);
  EXPECT_THROW(runs_table(folder_.path() / "nowhere"), std::runtime_error);
}

}  // namespace
}  // namespace softarm
