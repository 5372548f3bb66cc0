// Keys of the motion-capture source, and what its numbers mean.
#include <gtest/gtest.h>

#include "config_files.hpp"
#include "softarm/config/load.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

class MocapKeys : public ::testing::Test {
 protected:
  /// kGoodExperiment with `more` in its daemon section.
  Experiment load(const std::string& more) const {
    std::string text = kGoodExperiment;
    text.replace(text.find("  bodies:"), 0, more);
    return load_experiment(folder.write("e.yaml", text));
  }
  std::string complaint(const std::string& more) const {
    try {
      load(more);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }
  static std::string with_bodies(const std::string& bodies) {
    std::string text = kGoodExperiment;
    const std::string old = "    base_id: 0\n    segment_ids: [1, 2]\n";
    text.replace(text.find(old), old.size(), bodies);
    return text;
  }
  TestFolder folder;
};

TEST_F(MocapKeys, LeftOutMeanOurOwnFrames) {
  const TransportSettings transport = load("").transport;
  EXPECT_EQ(transport.mocap.source, softarm_mocap());
  EXPECT_EQ(transport.mocap.unit, LengthUnit::metre);
  EXPECT_EQ(transport.mocap.quaternion, QuaternionOrder::wxyz);
  EXPECT_EQ(transport.mocap.axes, Eigen::Matrix3d::Identity());
  EXPECT_EQ(transport.lcm.mocap_channel, "SOFTARM_MOCAP");
  ASSERT_EQ(transport.bodies.segment_marker_frames.size(), 2U);
  EXPECT_EQ(transport.bodies.segment_marker_frames[1], MarkerFrameSettings{});
}

TEST_F(MocapKeys, ASourceBringsItsDefaults) {
  TransportSettings transport = load("  mocap: {source: optitrack}\n").transport;
  EXPECT_EQ(transport.lcm.mocap_channel, "OPTITRACK_FRAMES");
  EXPECT_EQ(transport.mocap.quaternion, QuaternionOrder::xyzw);
  transport = load("  mocap: {source: rigid_transform}\n").transport;
  EXPECT_EQ(transport.mocap.quaternion, QuaternionOrder::wxyz);
  EXPECT_EQ(body_channel(transport.lcm, transport.bodies.base_marker_frame), "VICON_base");
  EXPECT_EQ(body_channel(transport.lcm, transport.bodies.segment_marker_frames[1]),
            "VICON_segment_2");
}

TEST_F(MocapKeys, EverythingCanBeSaidAndSurvivesPrinting) {
  std::string text = with_bodies(
      "    base_plate: {name: root, position_m: [0, 0.01, 0]}\n"
      "    segment_plates:\n"
      "      - {name: a, rotation_rad: [0, 0, pi]}\n"
      "      - {name: b, position_m: [1e-3, 2e-3, 3e-3]}\n");
  text.replace(text.find("  bodies:"), 0,
               "  mocap: {source: rigid_transform, unit: mm, quaternion: xyzw, axes: y_up}\n");
  const Experiment first = load_experiment(folder.write("e.yaml", text));
  const Experiment again = load_experiment(folder.write("f.yaml", resolved_text(first)));
  EXPECT_EQ(resolved_text(first), resolved_text(again));
  for (const Experiment& experiment : {first, again}) {
    const TransportSettings& transport = experiment.transport;
    EXPECT_EQ(transport.mocap.unit, LengthUnit::millimetre);
    EXPECT_EQ(transport.mocap.quaternion, QuaternionOrder::xyzw);
    // What is up there is up here.
    EXPECT_EQ(transport.mocap.axes * Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ());
    EXPECT_EQ(transport.mocap.axes * Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitX());
    EXPECT_EQ(transport.bodies.base_marker_frame.name, "root");
    EXPECT_EQ(transport.bodies.base_marker_frame.position_m, Eigen::Vector3d(0, 0.01, 0));
    EXPECT_EQ(transport.bodies.segment_marker_frames[0].rotation_rad.z(), 3.141592653589793);
    EXPECT_EQ(transport.bodies.segment_marker_frames[1].position_m,
              Eigen::Vector3d(1e-3, 2e-3, 3e-3));
  }
}

TEST_F(MocapKeys, MistakesAreReported) {
  EXPECT_NE(complaint("  mocap: {source: vicon}\n").find("softarm, optitrack, rigid_transform"),
            std::string::npos);
  EXPECT_NE(complaint("  mocap: {unit: cm}\n").find("one of m, mm"), std::string::npos);
  // A mirror: left-handed axes are no rotation of right-handed ones.
  const std::string mirror = complaint("  mocap: {axes: [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}\n");
  EXPECT_NE(mirror.find("daemon.mocap.axes"), std::string::npos) << mirror;
  EXPECT_NE(mirror.find("determinant -1"), std::string::npos) << mirror;
}

TEST_F(MocapKeys, EveryBodyHasItsOwnChannel) {
  std::string text = with_bodies("    segment_plates: [{name: a}, {name: a}]\n");
  text.replace(text.find("  bodies:"), 0, "  mocap: {source: rigid_transform}\n");
  try {
    load_experiment(folder.write("e.yaml", text));
    FAIL() << "two bodies of one name";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("VICON_a"), std::string::npos) << error.what();
  }
  text.replace(text.find("{name: a}, {name: a}"), 20, "{name: a}, {name: b c}");
  EXPECT_THROW(load_experiment(folder.write("e.yaml", text)), ConfigError);
}

TEST_F(MocapKeys, AServerHasAnAddressAndItsBodiesHaveNames) {
  const auto named = [&](const char* mocap, const char* bodies) {
    std::string text = with_bodies(bodies);
    text.replace(text.find("  bodies:"), 0, mocap);
    return load_experiment(folder.write("e.yaml", text)).transport;
  };
  TransportSettings transport =
      named("  mocap: {source: natnet, host: 10.0.0.7, multicast: 239.255.42.99}\n",
            "    base_plate: {name: base}\n    segment_plates: [{name: a}, {name: b}]\n");
  EXPECT_EQ(transport.mocap.network.host, "10.0.0.7");
  EXPECT_EQ(transport.mocap.network.port, 1510);
  EXPECT_EQ(transport.mocap.network.data_port, 1511);
  EXPECT_EQ(transport.mocap.unit, LengthUnit::metre);
  EXPECT_EQ(transport.mocap.quaternion, QuaternionOrder::xyzw);
  EXPECT_EQ(transport.bodies.segment_marker_frames[1].name, "b");
  transport = load("  mocap: {source: qtm, host: 10.0.0.7}\n").transport;
  EXPECT_EQ(transport.mocap.network.port, 22223);
  EXPECT_EQ(transport.mocap.unit, LengthUnit::millimetre);
  EXPECT_EQ(transport.bodies.segment_marker_frames[1].name, "") << "by its place in the list";

  EXPECT_NE(complaint("  mocap: {source: qtm, host: motive.lab}\n").find("an IPv4 address"),
            std::string::npos);
  EXPECT_NE(complaint("  mocap: {source: natnet, version: four}\n").find("two numbers"),
            std::string::npos);
  EXPECT_NE(complaint("  mocap: {source: qtm, multicast: 239.255.42.99}\n").find("multicast"),
            std::string::npos);
  EXPECT_THROW(named("  mocap: {source: natnet}\n", "    segment_plates: [{name: a}, {name: a}]\n"),
               ConfigError);
}

}  // namespace
}  // namespace softarm
