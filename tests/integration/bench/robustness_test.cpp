// softarm-dev bench robustness over LCM: one row with softarmd and softarm-plant, in real time.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <string>

#include "program_output.hpp"
#include "softarm/transport/lcm_node.hpp"

namespace softarm {
namespace {

TEST(BenchRobustnessSlow, ARowOverLcmHoldsItsBound) {
  try {
    LcmNode("udpm://239.255.76.67:20000?ttl=0").subscribe("ANY", 1, [](const auto&) {});
  } catch (const TransportError& error) {
    GTEST_SKIP() << error.what();
  }
  const test::Outcome outcome =
      test::run("bench robustness --processes --json --scene 'mixed 20 %'", "softarm-dev");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const std::size_t begin = outcome.text.find('{');
  ASSERT_NE(begin, std::string::npos) << outcome.text;
  const YAML::Node scenes = YAML::Load(outcome.text.substr(begin))["scenes"];
  ASSERT_EQ(scenes.size(), 1u);
  const YAML::Node law = scenes[0]["laws"][0];
  EXPECT_EQ(law["law"].as<std::string>(), "observer + parameters");
  EXPECT_TRUE(law["stayed_active"].as<bool>());
  EXPECT_LE(1e3 * law["u_rms_rad"].as<double>(), scenes[0]["bound_mrad"].as<double>());
  EXPECT_LT(std::abs(law["nis"].as<double>() - 1.0), 0.1);
}

}  // namespace
}  // namespace softarm
