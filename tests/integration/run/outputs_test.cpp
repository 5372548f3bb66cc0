// No command writes over what it reads, whatever the name, and a full disk takes neither the exit
// code nor what was recorded.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "program_output.hpp"

namespace softarm {
namespace {

namespace fs = std::filesystem;

class Outputs : public ::testing::Test {
 protected:
  Outputs() {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "out");
    put("base.yaml", "include: " SOFTARM_SOURCE_DIR "/config/one_segment.yaml\n");
    put("arm.yaml", "include: base.yaml\nname: under test\n");
    put("log", "");
  }
  ~Outputs() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void put(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  /// Every file with what is in it.
  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> all;
    for (const auto& each : fs::recursive_directory_iterator(folder_)) {
      if (!each.is_regular_file()) continue;
      std::ostringstream text;
      text << std::ifstream(each.path()).rdbuf();
      all[each.path().string()] = text.str();
    }
    return all;
  }

  const fs::path folder_ =
      fs::temp_directory_path() / ("softarm_outputs_" + std::to_string(getpid()));
};

struct Case {
  std::string arguments;  ///< A: the experiment, O: the output
  std::string input;      ///< that the output is
};

// Refused before anything runs: identify would take seconds, calibrate would wait for frames.
TEST_F(Outputs, NoCommandWritesOverItsInput) {
  const Case cases[] = {
      {"identify A --output O", "arm.yaml"},    {"identify A --output O", "base.yaml"},
      {"identify A --log L --output O", "log"}, {"identify A --live --output O", "arm.yaml"},
      {"calibrate A -o O", "arm.yaml"},         {"calibrate A -o O", "base.yaml"},
  };
  const auto before = files();
  for (const Case& each : cases)
    for (const char* kind : {"itself", "symbolic", "hard"}) {
      const std::string link = path("link");
      if (kind == std::string("symbolic")) fs::create_symlink(each.input, link);
      if (kind == std::string("hard")) fs::create_hard_link(path(each.input), link);
      std::string arguments = each.arguments;
      for (const auto& [letter, name] :
           {std::pair{" A", path("arm.yaml")},
            {" L", path("log")},
            {" O", kind == std::string("itself") ? path(each.input) : link}})
        if (const auto at = arguments.find(letter); at != std::string::npos)
          arguments.replace(at + 1, 1, name);
      const test::Outcome outcome = test::run(arguments);
      fs::remove(link);
      EXPECT_EQ(outcome.code, 64) << arguments << "\n" << outcome.text;
      EXPECT_NE(outcome.text.find("input"), std::string::npos) << outcome.text;
      EXPECT_TRUE(files() == before) << arguments << ", " << kind;
    }
}

TEST_F(Outputs, NoFolderTakesAnInputUnderTheNameOfAnOutput) {
  for (const char* command : {"run", "watch", "report", "identify"})
    for (const char* name :
         {"log.csv", "shape.csv", "summary.json", "timing.json", "identification.csv"}) {
      const bool identify = command == std::string("identify");
      const bool shape = name == std::string("shape.csv");
      if (identify != (name == std::string("identification.csv"))) continue;
      if (shape && command != std::string("run")) continue;
      fs::create_hard_link(path("base.yaml"), path("out/") + name);
      const auto before = files();
      std::string arguments = std::string(command) + " ";
      if (command == std::string("report")) arguments += path("log") + " ";
      arguments += path("arm.yaml") + " --out " + path("out");
      if (command == std::string("run")) arguments += " --no-plots";
      const test::Outcome outcome = test::run(arguments);
      EXPECT_EQ(outcome.code, 64) << arguments << ", " << name << "\n" << outcome.text;
      for (const auto& [file, text] : before)
        EXPECT_TRUE(files()[file] == text) << command << " changed " << file;
      fs::remove_all(folder_ / "out");
      fs::create_directories(folder_ / "out");
    }
}

TEST_F(Outputs, EveryCommandReportsThatItsOutputIsLost) {
  for (const std::string& arguments :
       {std::string("check --template"), std::string("check --schema"), "check " + path("arm.yaml"),
        std::string("eval " SOFTARM_SOURCE_DIR "/tests/golden/golden.json"), std::string("--help"),
        std::string("--version"),
        "run --no-plots --duration 0.1 " + path("arm.yaml") + " --out " + path("out")}) {
    const test::Outcome outcome = test::run(arguments + " > /dev/full");
    EXPECT_NE(outcome.code, 0) << arguments;
  }
}

TEST_F(Outputs, ATableOfRunsReportsASummaryThatCannotBeRead) {
  fs::create_directories(folder_ / "runs/damaged");
  std::ofstream(path("runs/damaged/summary.json")) << "not JSON";
  const test::Outcome outcome = test::run("report " + path("runs"));
  EXPECT_EQ(outcome.code, 1) << outcome.text;
  EXPECT_NE(outcome.text.find("damaged/summary.json: expected the summary of a run"),
            std::string::npos)
      << outcome.text;
}

TEST_F(Outputs, AFullDiskKeepsWhatWasRecordedAndItsSummary) {
  const std::string command =
      "bash -c 'ulimit -f 200; exec " SOFTARM_BINARY_DIR "/bin/softarm run " + path("arm.yaml") +
      " --no-plots --out " + path("out") + "' > " + path("printed") + " 2>&1";
  const int status = std::system(command.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 1);
  auto all = files();
  EXPECT_NE(all[path("printed")].find("could not write all of"), std::string::npos);
  const std::string& log = all[path("out/log.csv")];
  EXPECT_GT(log.size(), 150'000u);
  EXPECT_EQ(log.back(), '\n') << "a row is whole or not there";
  EXPECT_NE(all[path("out/summary.json")].find("duration_s"), std::string::npos);
  EXPECT_FALSE(fs::exists(path("out/log.csv.partial")));
}

}  // namespace
}  // namespace softarm
