// The program itself: exit codes and what it prints.
#include <sys/wait.h>

#include <cstdlib>
#include <regex>

#include "config_files.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct Outcome {
  int code;
  std::string out;
  std::string err;
};

class CommandLine : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(std::filesystem::exists(program_)) << "build the target softarm first";
  }

  Outcome run(const std::string& arguments, const std::string& redirect = "") const {
    const std::string out = folder_.path() / "out", err = folder_.path() / "err";
    const std::string target = redirect.empty() ? out : redirect;
    const int status = std::system(
        ("'" + program_ + "' " + arguments + " >'" + target + "' 2>'" + err + "'").c_str());
    return {WEXITSTATUS(status), file_text(out), file_text(err)};
  }

  const std::string program_ = SOFTARM_BINARY_DIR "/bin/softarm";
  TestFolder folder_;
};

TEST_F(CommandLine, HelpAndVersion) {
  const Outcome help = run("--help");
  EXPECT_EQ(help.code, 0);
  EXPECT_NE(help.out.find("check"), std::string::npos);
  const Outcome version = run("--version");
  EXPECT_EQ(version.code, 0);
  EXPECT_TRUE(std::regex_match(
      version.out, std::regex("softarm [0-9.]+ \\(commit ([0-9a-f]+(-dirty)?|unknown)\\)\n")))
      << version.out;
  EXPECT_EQ(run("check --help").code, 0);
}

TEST_F(CommandLine, WrongUsageIs64) {
  const Outcome nothing = run("");
  EXPECT_EQ(nothing.code, 64);
  EXPECT_NE(nothing.err.find("Usage"), std::string::npos);
  EXPECT_EQ(run("--no-such-option").code, 64);
  EXPECT_EQ(run("no-such-command").code, 64);
  EXPECT_EQ(run("check").code, 64);
  EXPECT_EQ(run("check a.yaml b.yaml").code, 64);
  EXPECT_EQ(run("check a.yaml --no-such-option").code, 64);
  EXPECT_EQ(run("check a.yaml --template").code, 64);
  EXPECT_EQ(run("check a.yaml --schema").code, 64);
}

TEST_F(CommandLine, WrongConfigurationIs78) {
  const Outcome missing = run("check nowhere.yaml");
  EXPECT_EQ(missing.code, 78);
  EXPECT_NE(missing.err.find("nowhere.yaml"), std::string::npos);
  EXPECT_EQ(missing.out, "");
  const auto file = folder_.write("bad.yaml", "name: bad\narm: {segments: 0}\n");
  const Outcome bad = run("check '" + file.string() + "'");
  EXPECT_EQ(bad.code, 78);
  EXPECT_NE(bad.err.find(file.string() + ":2: arm.segments: expected a whole number in [1, 128]"),
            std::string::npos)
      << bad.err;
}

TEST_F(CommandLine, CheckPrintsWhatLoadsAgain) {
  const std::string paper = kConfigFolder / "paper_arm.yaml";
  const Outcome first = run("check '" + paper + "'");
  EXPECT_EQ(first.code, 0);
  EXPECT_NE(first.out.find(hash_text(load_experiment(paper).hash)), std::string::npos);
  const auto file = folder_.write("again.yaml", first.out);
  EXPECT_EQ(load_experiment(file).hash, load_experiment(paper).hash);
  EXPECT_EQ(run("check --template").out, file_text(kConfigFolder / "template.yaml"));
}

TEST_F(CommandLine, SchemaIsWhatIsShipped) {
  const Outcome schema = run("check --schema");
  EXPECT_EQ(schema.code, 0);
  EXPECT_EQ(schema.out, file_text(kConfigFolder / "experiment.schema.json"));
}

TEST_F(CommandLine, FullDiskIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_EQ(run("check --template", "/dev/full").code, 1);
  EXPECT_EQ(run("check --schema", "/dev/full").code, 1);
}

}  // namespace
}  // namespace softarm
