// One zero for two recordings of an arm: an arm that hangs bent in the second keeps that bend.
#include <Eigen/Geometry>
#include <cmath>

#include "integration/import/import_fixture.hpp"

namespace {

using softarm::test::run;
using softarm_messages::mocap_frame_t;

class FramesFrom : public softarm::test::ImportTest {
 protected:
  /// Two bodies that keep still, the tip's turned by `bend_rad` about y.
  std::string table(const std::string& name, double bend_rad) const {
    std::string text = "t,bx,by,bz,bqx,bqy,bqz,bqw,x,y,z,qx,qy,qz,qw\n";
    for (int k = 0; k < 5; ++k)
      text += std::to_string(0.1 * k) + ",0,0,1,0,0,0,1,0,0," + std::to_string(0.7 + 1e-6 * k) +
              ",0," + std::to_string(std::sin(0.5 * bend_rad)) + ",0," +
              std::to_string(std::cos(0.5 * bend_rad)) + "\n";
    return write(name, text);
  }
  std::string map() const {
    return write("map.yaml", R"(
time: t
base: {id: 1, position: bx by bz, orientation: bqx bqy bqz bqw}
segments: [{id: 2, position: x y z, orientation: qx qy qz qw, length_m: 0.3}]
rest: {from_s: 0, to_s: 1}
)");
  }
  /// The angle between both bodies of the first frame, rad.
  double bend_rad() const {
    const auto frames = softarm::test::read_log<mocap_frame_t>(path("log"), "SOFTARM_MOCAP");
    EXPECT_FALSE(frames.empty());
    if (frames.empty()) return -1.0;
    Eigen::Quaterniond q[2];
    for (std::size_t i = 0; i < 2; ++i) {
      const auto& it = frames.front().message.bodies.at(i).orientation;
      q[i] = Eigen::Quaterniond(it[0], it[1], it[2], it[3]);
    }
    return q[0].angularDistance(q[1]);
  }
};

TEST_F(FramesFrom, KeepTheBendOfARecordingThatStartsBent) {
  const std::string straight = table("straight.csv", 0.0), bent = table("bent.csv", 0.1);
  EXPECT_EQ(import(bent, map()).code, 0);
  EXPECT_NEAR(bend_rad(), 0.0, 1e-5) << "its own rest is its zero";
  const auto outcome = run("import '" + bent + "' '" + map() + "' --frames-from '" + straight +
                           "' --out '" + path("log") + "'");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_NE(outcome.text.find("straight.csv"), std::string::npos) << outcome.text;
  EXPECT_NEAR(bend_rad(), 0.1, 1e-5);
}

TEST_F(FramesFrom, NeedATableWithARestWindow) {
  const std::string one = table("one.csv", 0.0);
  const std::string without = write("without.yaml", R"(
time: t
base: {id: 1, position: bx by bz, orientation: bqx bqy bqz bqw}
segments: [{id: 2, position: x y z, orientation: qx qy qz qw, length_m: 0.3}]
)");
  const auto outcome = run("import '" + one + "' '" + map() + "' --frames-from '" + one +
                           "' --frames-map '" + without + "' --out '" + path("log") + "'");
  EXPECT_NE(outcome.code, 0);
  EXPECT_NE(outcome.text.find("rest window"), std::string::npos) << outcome.text;
}

}  // namespace
