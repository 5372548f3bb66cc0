// `softarm import` on small tables whose log can be computed by hand.
#include <cmath>

#include "import_fixture.hpp"

namespace {

using softarm::test::Outcome;
using softarm::test::read_log;
using softarm_messages::mocap_frame_t;
using softarm_messages::pressure_command_t;
using softarm_messages::pressure_measurement_t;

// Milliseconds, millimetres, w first, z up, two segments. A repeated row, a body of zeros, one of
// blanks, a long gap.
constexpr const char* kTable =
    "ms;set;bx;by;bz;bw;b1;b2;b3;mx;my;mz;mw;m1;m2;m3;tx;ty;tz;tw;t1;t2;t3;got\n"
    "0;1;100;200;300;1;0;0;0;100;200;200;1;0;0;0;100;200;100;1;0;0;0;0.5\n"
    "10;1;100;200;300;1;0;0;0;100;200;200;1;0;0;0;100;200;100;1;0;0;0;0.6\n"
    "20;2;100;200;300;1;0;0;0;0;0;0;0;0;0;0;100;210;100;0;0;0;1;0.7\n"
    "30;2;100;200;300;1;0;0;0;100;200;200;1;0;0;0;;;;;;;;0.8\n"
    "75;3;100;200;300;1;0;0;0;100;200;200;1;0;0;0;100;200;100;-1;0;0;0;0.9\n";

constexpr const char* kMap =
    "separator: ;\n"
    "time: ms\n"
    "time_unit_s: 0.001\n"
    "position_unit_m: 0.001\n"
    "quaternion_order: wxyz\n"
    "frame_period_s: 0.01\n"
    "base: {id: 7, position: bx by bz, orientation: bw b1 b2 b3}\n"
    "segments:\n"
    "  - {id: 8, position: mx my mz, orientation: mw m1 m2 m3, length_m: 0.1}\n"
    "  - {id: 9, position: tx ty tz, orientation: tw t1 t2 t3, length_m: 0.1}\n"
    "pressures: {unit_bar: 0.1, commanded: set, measured: got}\n"
    "channels: {mocap: M, command: C, measurement: P}\n";

class Import : public softarm::test::ImportTest {
 protected:
  Outcome import_text(const std::string& table, const std::string& map) const {
    return import(write("table.csv", table), write("map.yaml", map));
  }
  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
};

TEST_F(Import, TurnsRowsIntoFrames) {
  const Outcome outcome = import_text(kTable, kMap);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_NE(outcome.text.find("4 frames, 1 repeated, 4 missing, 2 with a body not seen"),
            std::string::npos)
      << outcome.text;

  const auto frames = read_log<mocap_frame_t>(path("log"), "M");
  ASSERT_EQ(frames.size(), 5u);
  const std::int64_t times[] = {0, 10'000, 20'000, 30'000, 75'000};
  const std::int64_t numbers[] = {1, 1, 3, 4, 8};
  const std::int64_t captures[] = {0, 0, 20'000, 30'000, 75'000};
  for (std::size_t k = 0; k < 5; ++k) {
    EXPECT_EQ(frames[k].time_us, times[k]);
    EXPECT_EQ(frames[k].message.frame_number, numbers[k]);
    EXPECT_EQ(frames[k].message.capture_time_us, captures[k]);
    ASSERT_EQ(frames[k].message.num_bodies, 3);
    for (int i = 0; i < 3; ++i)
      EXPECT_EQ(frames[k].message.bodies[static_cast<std::size_t>(i)].id, 7 + i);
  }
  // No window of rest: poses as they are, in metres, w first.
  const auto& third = frames[2].message.bodies;
  EXPECT_TRUE(third[0].valid);
  EXPECT_FALSE(third[1].valid) << "all zero";
  EXPECT_TRUE(third[2].valid);
  EXPECT_DOUBLE_EQ(third[2].position_m[1], 0.21);
  EXPECT_DOUBLE_EQ(third[2].orientation[0], 0.0);
  EXPECT_DOUBLE_EQ(third[2].orientation[3], 1.0);
  EXPECT_FALSE(frames[3].message.bodies[2].valid) << "blank";
}

TEST_F(Import, TurnsColumnsIntoPressures) {
  ASSERT_EQ(import_text(kTable, kMap).code, 0);
  const auto commands = read_log<pressure_command_t>(path("log"), "C");
  const auto measurements = read_log<pressure_measurement_t>(path("log"), "P");
  ASSERT_EQ(commands.size(), 5u);
  ASSERT_EQ(measurements.size(), 5u);
  EXPECT_EQ(commands[4].time_us, 75'000);
  EXPECT_FLOAT_EQ(commands[4].message.pressure_bar.at(0), 0.3f);
  EXPECT_FLOAT_EQ(measurements[4].message.pressure_bar.at(0), 0.09f);
  EXPECT_EQ(commands[4].message.sequence, 5);
  EXPECT_EQ(measurements[4].message.sequence, 5);
  for (const auto& each : commands)
    EXPECT_TRUE(each.message.shadow) << "played back it moves no valve";
}

// With a window of rest the arm hangs straight there, however the marker frames are turned.
TEST_F(Import, TheRestPoseReadsStraight) {
  const std::string turned =
      replaced(kTable, "100;200;100;1;0;0;0;0.5", "120;190;105;0.5;0.5;-0.5;0.5;0.5");
  const std::string map = std::string(kMap) + "rest: {from_s: 0, to_s: 0.001}\n";
  ASSERT_EQ(import_text(turned, map).code, 0);
  const auto frames = read_log<mocap_frame_t>(path("log"), "M");
  for (int i = 0; i < 3; ++i) {
    const auto& body = frames.at(0).message.bodies[static_cast<std::size_t>(i)];
    EXPECT_NEAR(body.position_m[0], 0.1, 1e-12);
    EXPECT_NEAR(body.position_m[1], 0.2, 1e-12);
    EXPECT_NEAR(body.position_m[2], 0.3 - 0.1 * i, 1e-12);
    // Hanging: half a turn about x.
    EXPECT_NEAR(std::abs(body.orientation[1]), 1.0, 1e-12);
  }
}

TEST_F(Import, BringsTheUpAxisToZ) {
  // One body a row: at x, y, z one metre; turned by 90 degrees about its world's x, y, z.
  const std::string table =
      "time,x,y,z,a,b,c,w,X,Y,Z,A,B,C,W\n"
      "0,1,2,3,0.7071067811865476,0,0,0.7071067811865476,0,0,0,0,0,0,1\n";
  const std::string map =
      "base: {id: 0, position: X Y Z, orientation: A B C W}\n"
      "segments: [{id: 1, position: x y z, orientation: a b c w, length_m: 1}]\n";
  struct Case {
    const char* up;
    std::array<double, 3> position;
  };
  for (const Case& each : {Case{"z", {1, 2, 3}}, Case{"y", {1, -3, 2}}, Case{"x", {-3, 2, 1}}}) {
    ASSERT_EQ(import_text(table, map + "up: " + each.up + "\n").code, 0);
    const auto frames = read_log<mocap_frame_t>(path("log"), "SOFTARM_MOCAP");
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(frames.at(0).message.bodies[1].position_m[axis],
                  each.position[static_cast<std::size_t>(axis)], 1e-12)
          << "up " << each.up;
    }
  }
}

TEST_F(Import, ReportsWhatIsWrongWithTheMap) {
  struct Case {
    const char *from, *to, *complaint;
  };
  for (const Case& each : {
           Case{"time: ms", "time: seconds", "map.yaml:2: time: expected a column of"},
           Case{"bx by bz", "bx by",
                "map.yaml:7: base.position: expected 3 names of columns, got 2"},
           Case{"mx my mz", "mx my nz", "map.yaml:9: segments[0].position: expected a column of"},
           Case{"id: 9", "id: 7",
                "map.yaml:10: segments[1].id: expected a distinct id, got 7 again"},
           Case{"wxyz", "zyxw", "map.yaml:5: quaternion_order: expected one of xyzw, wxyz"},
           Case{"commanded: set", "commanded: setpoint",
                "map.yaml:11: pressures.commanded: expected"},
           Case{"frame_period_s: 0.01", "frame_period_s: 0",
                "map.yaml:6: frame_period_s: expected"},
           Case{"separator: ;", "seperator: ;", "map.yaml:1: seperator: expected"},
           Case{"id: 8, ", "", "segments[0].id: expected"},
           Case{"channels:", "rest: {from_s: 1}\nchannels:", "map.yaml:12: rest: expected both"},
           Case{"channels:", "rest: {from_s: 1, to_s: 1}\nchannels:",
                "map.yaml:12: rest.to_s: expected"},
       }) {
    const Outcome outcome = import_text(kTable, replaced(kMap, each.from, each.to));
    EXPECT_EQ(outcome.code, 78) << each.to;
    EXPECT_NE(outcome.text.find(each.complaint), std::string::npos)
        << "expected: " << each.complaint << "\ngot: " << outcome.text;
    EXPECT_FALSE(std::filesystem::exists(path("log")));
  }
}

TEST_F(Import, ReportsWhatIsWrongWithTheTable) {
  struct Case {
    const char *from, *to, *complaint;
  };
  for (const Case& each : {
           Case{"\n10;1;", "\n0;1;", "table.csv:3: ms: expected a time"},
           Case{"\n10;1;", "\nx;1;", "table.csv:3: ms: expected a number, got \"x\""},
           Case{"\n10;1;", "\n;1;", "table.csv:3: ms: expected a time"},
           Case{"\n10;1;", "\n10;", "table.csv:3: expected 24 cells, got 23"},
           Case{"ms;set", "ms;ms", "table.csv:1: expected distinct column names, got ms twice"},
       }) {
    const Outcome outcome = import_text(replaced(kTable, each.from, each.to), kMap);
    EXPECT_EQ(outcome.code, 1) << each.to;
    EXPECT_NE(outcome.text.find(each.complaint), std::string::npos)
        << "expected: " << each.complaint << "\ngot: " << outcome.text;
  }
  const std::string map = std::string(kMap) + "rest: {from_s: 5, to_s: 6}\n";
  const Outcome outcome = import_text(kTable, map);
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.text.find("window of rest"), std::string::npos) << outcome.text;
  EXPECT_EQ(import(path("absent.csv"), write("map.yaml", kMap)).code, 1);
  EXPECT_EQ(import(write("table.csv", kTable), path("absent.yaml")).code, 78);
}

}  // namespace
