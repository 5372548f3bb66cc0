// A short soak, as a user starts it; and one whose daemon ends by itself.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "integration/processes/process.hpp"
#include "softarm/transport/lcm_node.hpp"
#include "test_folder.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
using test::Process;

class Soak : public ::testing::Test {
 protected:
  void SetUp() override {
    try {
      LcmNode("udpm://239.255.76.67:20000?ttl=0").subscribe("ANY", 1, [](const auto&) {});
    } catch (const TransportError& error) {
      GTEST_SKIP() << error.what();
    }
  }

  std::unique_ptr<Process> start(std::vector<std::string> more) {
    more.insert(more.begin(), {"soak", SOFTARM_SOURCE_DIR "/config/paper_arm.yaml", "--json",
                               "--out", (folder / "out").string()});
    return std::make_unique<Process>("softarm-dev", more, (folder / "printed").string());
  }
  /// The JSON at the end of what it printed.
  static YAML::Node counters(const Process& process) {
    const std::string printed = process.printed();
    const std::size_t begin = printed.find('{');
    return begin == std::string::npos ? YAML::Node() : YAML::Load(printed.substr(begin));
  }

  TestFolder folder;
};

TEST_F(Soak, TenSecondsOfRandomFaultsAreAnsweredAndRecovered) {
  const auto soak = start({"--duration", "10", "--between", "0.1", "--seed", "3"});
  ASSERT_EQ(soak->wait(200s), 0) << soak->printed();
  const YAML::Node found = counters(*soak);
  ASSERT_TRUE(found["failures"] && found["failures"].size() == 0) << soak->printed();
  EXPECT_GT(found["ticks"].as<int>(), 0);
  EXPECT_GE(found["injected"].as<int>(), 3);
  EXPECT_EQ(found["recovered"].as<int>(), found["injected"].as<int>());
  EXPECT_EQ(found["commands_outside_limits"].as<int>(), 0);
  ASSERT_EQ(found["processes"].size(), 3u);
  for (const YAML::Node& process : found["processes"]) {
    EXPECT_GT(process["at_start"]["resident_kib"].as<int>(), 1000) << soak->printed();
    EXPECT_GT(process["at_end"]["descriptors"].as<int>(), 3) << soak->printed();
  }
}

TEST_F(Soak, ADaemonThatEndsByItselfIsAFailure) {
  const auto soak = start({"--duration", "60", "--between", "4"});
  const auto prints = [&](const char* what) {
    return file_text(folder / "out/softarmd_1.txt").find(what) != std::string::npos;
  };
  while (!prints("ACTIVE") && soak->wait(10ms) < 0) {
  }
  std::ifstream children("/proc/" + std::to_string(soak->pid()) + "/task/" +
                         std::to_string(soak->pid()) + "/children");
  int child = 0, newest = 0;
  while (children >> child) newest = std::max(newest, child);
  ASSERT_GT(newest, 1) << soak->printed();
  kill(newest, SIGKILL);  // the daemon is started last
  EXPECT_EQ(soak->wait(100s), 1) << soak->printed();
  EXPECT_NE(soak->printed().find("softarmd ended by itself"), std::string::npos) << soak->printed();
}

}  // namespace
}  // namespace softarm
