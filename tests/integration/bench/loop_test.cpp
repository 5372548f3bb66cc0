// softarm-dev bench loop runs, measures daemon and rivals, and reports them in JSON. How fast they
// are is not tested.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <string>

#include "program_output.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

TEST(BenchLoop, MeasuresTheDaemonBesideItsRivals) {
  try {
    LcmNode("udpm://239.255.76.67:20000?ttl=0").subscribe("ANY", 1, [](const auto&) {});
  } catch (const TransportError& error) {
    GTEST_SKIP() << error.what();
  }
  const test::Outcome outcome =
      test::run("bench loop --json --seconds 0.5 --rate 500 --busy 1", "softarm-dev");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const std::size_t begin = outcome.text.find('{');
  ASSERT_NE(begin, std::string::npos) << outcome.text;
  const YAML::Node report = YAML::Load(outcome.text.substr(begin));
  EXPECT_EQ(report["rate_hz"].as<double>(), 500.0);
  EXPECT_GT(report["frame_bytes"].as<int>(), report["command_bytes"].as<int>());
  EXPECT_GT(report["command_bytes"].as<int>(), 4 * 12);
  ASSERT_EQ(report["scenes"].size(), 3u);
  for (const YAML::Node& scene : report["scenes"]) {
    SCOPED_TRACE(scene["name"].as<std::string>());
    if (scene["skipped"]) {
      EXPECT_TRUE(scene["fifo"].as<bool>());
      continue;
    }
    for (const char* what : {"echo", "command", "wait", "whole", "bare_lateness", "lateness"}) {
      ASSERT_GT(scene[what]["count"].as<int>(), 0) << what;
      EXPECT_LE(scene[what]["p50_us"].as<double>(), scene[what]["p99_us"].as<double>()) << what;
      EXPECT_LE(scene[what]["p99_us"].as<double>(), scene[what]["largest_us"].as<double>()) << what;
    }
    // No command is there before its frame was sent, and the wait is no part of it.
    EXPECT_GT(scene["command"]["p50_us"].as<double>(), 0.0);
    EXPECT_LE(scene["command"]["p50_us"].as<double>(), scene["whole"]["p50_us"].as<double>());
    EXPECT_GT(scene["round_trip_p50_ratio"].as<double>(), 0.0);
    EXPECT_GT(scene["round_trip_p99_ratio"].as<double>(), 0.0);
    EXPECT_GT(scene["lateness_p99_ratio"].as<double>(), 0.0);
    EXPECT_GE(scene["missed"].as<int>(), 0);
    EXPECT_GE(scene["bare_missed"].as<int>(), 0);
    EXPECT_GE(scene["missed_asleep"].as<int>(), 0);
    EXPECT_LE(scene["missed_asleep"].as<int>(), scene["missed"].as<int>());
    EXPECT_FALSE(scene["stolen_s"].as<double>() < 0.0);
  }
}

}  // namespace
}  // namespace softarm
