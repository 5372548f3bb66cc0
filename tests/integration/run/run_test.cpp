// `softarm run` as a user starts it: same seed, same bytes; what it leaves behind; its exit codes
// and those of the daemon and the plant.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "integration/processes/process.hpp"
#include "test_folder.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
using test::Process;

const std::string kPaperArm = SOFTARM_SOURCE_DIR "/config/paper_arm.yaml";

class Run : public ::testing::Test {
 protected:
  /// Exit code; what the program printed is in `printed`.
  int start(const std::string& program, const std::vector<std::string>& arguments) {
    Process process(program, arguments, (folder / "printed").string());
    const int code = process.wait(120s);
    printed = process.printed();
    return code;
  }
  int run_paper_arm(const std::string& out, const std::string& seed) {
    return start("softarm", {"run", kPaperArm, "--duration", "3", "--no-plots", "--seed", seed,
                             "--out", (folder / out).string()});
  }
  std::string write(const std::string& name, const std::string& text) const {
    return folder.write(name, text).string();
  }

  TestFolder folder;
  std::string printed;
};

TEST_F(Run, SameSeedSameBytes) {
  ASSERT_EQ(run_paper_arm("a", "7"), 0) << printed;
  ASSERT_EQ(run_paper_arm("b", "7"), 0) << printed;
  ASSERT_EQ(run_paper_arm("c", "8"), 0) << printed;
  for (const char* name : {"log.csv", "summary.json"}) {
    const std::string first = file_text(folder / "a" / name);
    EXPECT_GT(first.size(), 200u) << name;
    EXPECT_TRUE(first == file_text(folder / "b" / name)) << name << " differs from run to run";
    EXPECT_FALSE(first == file_text(folder / "c" / name)) << name << " does not depend on the seed";
  }
}

TEST_F(Run, LeavesWhatItPromises) {
  ASSERT_EQ(run_paper_arm("out", "1"), 0) << printed;
  const YAML::Node summary = YAML::Load(file_text(folder / "out" / "summary.json"));
  EXPECT_NEAR(summary["duration_s"].as<double>(), 3.0, 0.01);
  EXPECT_EQ(summary["ticks"].as<int>(), 1500);
  const YAML::Node tracking = summary["tracking"];
  for (const char* key : {"u_rms_rad", "u_max_rad", "tip_rms_m", "tip_rms_second_half_m"})
    EXPECT_GT(tracking[key].as<double>(-1.0), 0.0) << key;
  for (const char* key : {"theta_rms_rad", "phi_rms_rad"}) {
    ASSERT_EQ(tracking[key].size(), 3u) << key;
    for (const auto& segment : tracking[key]) EXPECT_GT(segment.as<double>(-1.0), 0.0) << key;
  }
  EXPECT_LT(tracking["u_rms_rad"].as<double>(), tracking["u_max_rad"].as<double>());
  EXPECT_GT(summary["pressure_bar"]["max"].as<double>(-1.0), 0.1);
  EXPECT_LE(summary["pressure_bar"]["max"].as<double>(), 2.0);
  EXPECT_GE(summary["saturated_fraction"].as<double>(-1.0), 0.0);
  double in_modes_s = 0.0;
  for (const auto& mode : summary["modes"]) in_modes_s += mode.second.as<double>();
  EXPECT_NEAR(in_modes_s, 3.0, 0.01);
  EXPECT_GT(summary["modes"]["ACTIVE"].as<double>(-1.0), 2.5);

  const YAML::Node timing = YAML::Load(file_text(folder / "out" / "timing.json"));
  EXPECT_GT(timing["real_time_factor"].as<double>(-1.0), 0.0);
  for (const char* key : {"p50", "p99", "max"})
    EXPECT_GT(timing["tick_us"][key].as<double>(-1.0), 0.0) << key;

  // Comment lines, a header, then a row a tick with as many cells as the header.
  std::istringstream log(file_text(folder / "out" / "log.csv"));
  std::string line;
  std::size_t comments = 0, rows = 0;
  std::ptrdiff_t commas = -1;
  while (std::getline(log, line)) {
    if (line.starts_with('#')) {
      ++comments;
    } else if (commas < 0) {
      commas = std::count(line.begin(), line.end(), ',');
      EXPECT_TRUE(line.starts_with("t_s,mode,reason,"));
    } else {
      ++rows;
      ASSERT_EQ(std::count(line.begin(), line.end(), ','), commas) << line;
    }
  }
  EXPECT_GE(comments, 1u);
  EXPECT_EQ(rows, 1500u);
}

// As softarmd with an operator beside it, and not for 20 s of WAIT_FRAMES and exit code 0.
TEST_F(Run, WithExplicitArmingTheArmIsArmed) {
  const std::string config =
      write("explicit.yaml", "include: " + kPaperArm +
                                 "\nname: explicit\ndaemon:\n  lcm: {deadman_channel: GO}\n"
                                 "  safety: {arming: explicit, valve_readback: true}\n");
  const std::string out = (folder / "out").string();
  ASSERT_EQ(start("softarm", {"run", config, "--duration", "3", "--no-plots", "--out", out}), 0)
      << printed;
  EXPECT_GT(
      YAML::Load(file_text(folder / "out" / "summary.json"))["modes"]["ACTIVE"].as<double>(-1.0),
      2.5);
}

TEST_F(Run, AnArmThatWasNeverActiveIsAFailureWithItsReason) {
  const std::string out = (folder / "out").string();
  EXPECT_EQ(start("softarm", {"run", kPaperArm, "--duration", "0.1", "--no-plots", "--out", out}),
            1)
      << printed;
  for (const char* part :
       {"never ACTIVE", "WAIT_FRAMES", "waiting_for_frames", "safety.good_frames"})
    EXPECT_NE(printed.find(part), std::string::npos) << part << " in\n" << printed;
  EXPECT_TRUE(std::filesystem::exists(folder / "out" / "summary.json"));
}

TEST_F(Run, AnArmThatAFaultHasStoppedIsNamed) {
  const std::string wild = write(
      "wild.yaml", "include: " + kPaperArm + "\nname: wild\ncontrol: {kp_nm_per_rad: 10000}\n");
  const std::string out = (folder / "out").string();
  EXPECT_EQ(start("softarm", {"run", wild, "--duration", "3", "--no-plots", "--out", out}), 0);
  EXPECT_NE(printed.find("; it left ACTIVE for soft_limit"), std::string::npos) << printed;
  EXPECT_EQ(start("softarm", {"run", kPaperArm, "--duration", "1", "--no-plots", "--out", out}), 0);
  EXPECT_EQ(printed.find("warning"), std::string::npos) << printed;
}

TEST_F(Run, WrongCommandLinesExitWith64) {
  const std::vector<std::vector<std::string>> wrong{
      {},
      {"sprint"},
      {"run"},
      {"run", kPaperArm, "--no-such-option"},
      {"run", kPaperArm, "--duration", "-1"},
      {"run", kPaperArm, "--duration", "soon"},
      {"run", kPaperArm, "--seed", "x"},
      {"run", kPaperArm, "--seed", "-1"},
      {"run", kPaperArm, "--law", "a_file.py"},
      {"identify", kPaperArm, "--seeds", "2", "--log", "x.lcm"},
      {"identify", kPaperArm, "--log", "x.lcm", "--from", "nan"},
      {"identify", kPaperArm, "--log", "x.lcm", "--to", "-5"},
      {"identify", kPaperArm, "--log", "x.lcm", "--skip", "nan"},
      {"jog", kPaperArm, "1", "1", "nan"},
      {"check", kPaperArm, "--live", "--pulse", "--hold", "nan"}};
  for (const auto& arguments : wrong) EXPECT_EQ(start("softarm", arguments), 64) << printed;
  for (const char* program : {"softarmd", "softarm-plant"}) {
    EXPECT_EQ(start(program, {}), 64) << printed;
    EXPECT_EQ(start(program, {"--no-such-option"}), 64) << printed;
    EXPECT_NE(printed.find("--no-such-option"), std::string::npos) << printed;
    EXPECT_EQ(start(program, {kPaperArm, "--no-such-option"}), 64) << printed;
  }
}

/// Every command of a program that has sub-commands, as its help lists them.
std::vector<std::string> subcommands(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream lines(help.substr(help.find("Subcommands:")));
  for (std::string line, name; std::getline(lines, line);)
    if (line.starts_with("  ") && !line.starts_with("   ") && std::istringstream(line) >> name)
      names.push_back(name);
  return names;
}

// A word that is misspelt is the likelier reason why something seems to be missing.
TEST_F(Run, AnUnknownOptionIsNamedWhateverElseIsMissing) {
  std::vector<std::vector<std::string>> commands{
      {"softarmd"}, {"softarm-plant"}, {"softarm-valves"}, {"example_serial_pressure_board"}};
  for (const char* program : {"softarm", "softarm-dev"}) {
    commands.push_back({program});
    ASSERT_EQ(start(program, {"--help"}), 0);
    for (const std::string& name : subcommands(printed)) commands.push_back({program, name});
  }
  ASSERT_EQ(start("softarm-dev", {"bench", "--help"}), 0);
  for (const std::string& name : subcommands(printed))
    commands.push_back({"softarm-dev", "bench", name});
  EXPECT_GT(commands.size(), 25u);
  commands.push_back({"softarm", "check", "--pulse"});  // it requires --live
  for (const std::vector<std::string>& command : commands) {
    std::vector<std::string> arguments(command.begin() + 1, command.end());
    arguments.emplace_back("--nope");
    EXPECT_EQ(start(command.front(), arguments), 64) << command.back();
    EXPECT_NE(printed.find("not expected: --nope"), std::string::npos)
        << command.back() << ": " << printed;
  }
}

TEST_F(Run, WhatAnOptionMayBeIsNamed) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong{
      {{"run", kPaperArm, "--seed", "-1"},
       "--seed: expected a whole number in [0, 9007199254740992]"},
      {{"run", kPaperArm, "--law", "a_file.py"}, "--law: expected MODULE:CLASS or FILE.py:CLASS"},
      {{"identify", kPaperArm, "--gains", "side by side"},
       "--gains: expected one of arm, chamber, segment, side"},
      {{"jog", kPaperArm, "0", "1", "0.1"}, "1 to 128"}};
  for (const auto& [arguments, text] : wrong) {
    EXPECT_EQ(start("softarm", arguments), 64);
    EXPECT_NE(printed.find(text), std::string::npos) << printed;
  }
}

TEST_F(Run, WrongConfigurationsExitWith78AndSayWhere) {
  const std::string missing = (folder / "missing.yaml").string();
  const std::string unknown =
      write("unknown.yaml", "include: " + kPaperArm + "\nname: test\ndaemon:\n  rate_hertz: 500\n");
  const std::string broken = write("broken.yaml", "name: test\narm: [1, 2\ncontrol: }\n");
  for (const char* program : {"softarm", "softarmd", "softarm-plant"}) {
    const auto with = [&](const std::string& config) {
      std::vector<std::string> arguments{config};
      if (std::string(program) == "softarm")
        arguments = {"run", config, "--no-plots", "--out", (folder / "out").string()};
      return start(program, arguments);
    };
    EXPECT_EQ(with(missing), 78) << printed;
    EXPECT_NE(printed.find(missing), std::string::npos) << printed;
    EXPECT_EQ(with(unknown), 78) << printed;
    EXPECT_NE(printed.find(unknown + ":4"), std::string::npos) << printed;
    EXPECT_NE(printed.find("rate_hertz"), std::string::npos) << printed;
    EXPECT_EQ(with(broken), 78) << printed;
    EXPECT_NE(printed.find(broken + ":"), std::string::npos) << printed;
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "out")) << "nothing is begun";
  EXPECT_EQ(start("softarm", {"eval", folder.path().string()}), 78);
  EXPECT_NE(printed.find("expected a file, got a folder"), std::string::npos) << printed;
}

TEST_F(Run, WithoutAKnownRecordingNothingWasMeasured) {
  EXPECT_EQ(start("softarm-dev", {"bench", "recordings", folder.path().string()}), 1);
  EXPECT_NE(printed.find("expected a recording that is known"), std::string::npos) << printed;
}

TEST_F(Run, AFolderThatCannotBeMadeIsAnError) {
  const std::string file = write("file", "in the way");
  EXPECT_EQ(start("softarm",
                  {"run", kPaperArm, "--no-plots", "--duration", "0.1", "--out", file + "/out"}),
            1)
      << printed;
  EXPECT_NE(printed.find(file), std::string::npos) << printed;
}

TEST_F(Run, HelpAndVersionExitWithZero) {
  for (const char* program : {"softarm", "softarmd", "softarm-plant"}) {
    EXPECT_EQ(start(program, {"--help"}), 0) << printed;
    EXPECT_NE(printed.find("Usage: " + std::string(program)), std::string::npos) << printed;
    EXPECT_EQ(start(program, {"--version"}), 0) << printed;
    EXPECT_TRUE(printed.starts_with(program)) << printed;
    EXPECT_NE(printed.find("commit"), std::string::npos) << printed;
  }
  EXPECT_EQ(start("softarm", {"run", "--help"}), 0) << printed;
}

}  // namespace
}  // namespace softarm
