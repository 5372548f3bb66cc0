// One motion as laboratories export it, in a dozen ways: every table is read, and the map that is
// proposed for it gives the motion back.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>

#include "import_fixture.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

constexpr int kRows = 300, kBodies = 3;
constexpr double kPeriod_s = 0.01;

ArmParameters hanging_arm() {
  ArmParameters arm;
  arm.segments.assign(2, {.length_m = 0.2});
  arm.base_position_m = {0.1, 0.2, 1.5};
  arm.base_rotation = Eigen::Vector3d(1, -1, -1).asDiagonal();
  return arm;
}

/// Base and both ends in a row: still for 1.5 s, then swaying.
std::array<Eigen::Isometry3d, kBodies> poses(int row) {
  const double t = std::max(0.0, kPeriod_s * row - 1.5);
  const Eigen::Vector4d u(0.5 * std::sin(3 * t), 0.3 * std::sin(2 * t), -0.4 * std::sin(4 * t),
                          0.2 * std::sin(3 * t));
  const ArmParameters arm = hanging_arm();
  std::vector<Eigen::Isometry3d> ends(2);
  forward_kinematics(arm, u, ends);
  std::array<Eigen::Isometry3d, kBodies> all;
  all[0] = Eigen::Translation3d(arm.base_position_m) * Eigen::Quaterniond(arm.base_rotation);
  all[1] = ends[0];
  all[2] = ends[1];
  return all;
}

/// A body as written: in the unit and the world of the export.
struct Written {
  Eigen::Vector3d p;
  Eigen::Quaterniond q;
};
using Cells = std::function<std::string(const Written&)>;

struct Style {
  double unit_m = 1.0;
  bool y_up = false;
  std::string separator = ",";
  bool decimal_comma = false;
  std::string line_end = "\n";
};

std::string number(double value) { return fmt::format("{:.9g}", value); }

/// The rows; bodies in the order tip, base, middle, as nobody sorts them.
std::string rows(const Style& style, const std::function<std::string(int)>& front,
                 const Cells& cells, const std::string& end = "") {
  std::string text;
  for (int row = 0; row < kRows; ++row) {
    std::string line = front(row);
    const auto all = poses(row);
    for (const std::size_t body : {2U, 0U, 1U}) {
      Eigen::Matrix3d world = Eigen::Matrix3d::Identity();
      if (style.y_up) world << 1, 0, 0, 0, 0, 1, 0, -1, 0;
      const Written written{world * all[body].translation() / style.unit_m,
                            Eigen::Quaterniond(world * all[body].linear())};
      line += (line.empty() ? "" : style.separator) + cells(written);
    }
    if (style.decimal_comma) std::replace(line.begin(), line.end(), '.', ',');
    text += line + end + style.line_end;
  }
  return text;
}

std::string joined(const std::string& separator, std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : separator) + number(value);
  return text;
}

Cells quaternion_then_position(const std::string& s, bool w_first = false) {
  return [s, w_first](const Written& it) {
    const auto& q = it.q;
    return (w_first ? joined(s, {q.w(), q.x(), q.y(), q.z()})
                    : joined(s, {q.x(), q.y(), q.z(), q.w()})) +
           s + joined(s, {it.p.x(), it.p.y(), it.p.z()});
  };
}
Cells position_then_quaternion(const std::string& s, bool w_first) {
  return [s, w_first](const Written& it) {
    const auto& q = it.q;
    return joined(s, {it.p.x(), it.p.y(), it.p.z()}) + s +
           (w_first ? joined(s, {q.w(), q.x(), q.y(), q.z()})
                    : joined(s, {q.x(), q.y(), q.z(), q.w()}));
  };
}
Cells rotation_vector_then_position(const std::string& s, double unit_rad) {
  return [s, unit_rad](const Written& it) {
    const Eigen::AngleAxisd turn(it.q);
    const Eigen::Vector3d v = turn.angle() / unit_rad * turn.axis();
    return joined(s, {v.x(), v.y(), v.z(), it.p.x(), it.p.y(), it.p.z()});
  };
}
/// X Y Z Roll Pitch Yaw Residual Rot[0..8], column by column.
Cells qualisys_cells() {
  return [](const Written& it) {
    const Eigen::Matrix3d R = it.q.toRotationMatrix();
    const double pitch = std::asin(R(0, 2)) * 180.0 / std::numbers::pi;
    std::string text = joined("\t", {it.p.x(), it.p.y(), it.p.z(), 0.0, pitch, 0.0, 0.1});
    for (int k = 0; k < 9; ++k) text += "\t" + number(R(k % 3, k / 3));
    return text;
  };
}

std::string repeated(const std::string& s, const std::string& text, int times) {
  std::string out;
  for (int k = 0; k < times; ++k) out += s + text;
  return out;
}

std::string motive(const std::string& units, double unit_m,
                   const std::array<std::string, 3>& names) {
  std::string text =
      "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,100.000000,Export Frame "
      "Rate,100.000000,"
      "Total Frames in Take,300,Rotation Type,Quaternion,Length Units," +
      units + ",Coordinate Space,Global\n\n";
  text += ",Type" + repeated(",", "Rigid Body", 24) + "\n,Name";
  for (const std::string& name : names) text += repeated(",", "\"" + name + "\"", 8);
  text += "\n,ID" + repeated(",", "1A2B", 24) + "\n,";
  for (int k = 0; k < 3; ++k)
    text += repeated(",", "Rotation", 4) + repeated(",", "Position", 3) + ",Mean Marker Error";
  text += "\nFrame,Time (Seconds)";
  for (int k = 0; k < 3; ++k) text += ",X,Y,Z,W,X,Y,Z,";
  const Cells cells = [](const Written& it) {
    return quaternion_then_position(",")(it) + ",0.0001";
  };
  return text + "\n" +
         rows(
             {.unit_m = unit_m, .y_up = true},
             [](int row) { return fmt::format("{},{:.6f}", row, kPeriod_s * row); }, cells);
}

std::string vicon(const std::string& first, const std::string& s, const std::string& axes,
                  const std::string& unit, const Cells& cells) {
  const int wide = static_cast<int>(std::count(axes.begin(), axes.end(), ' ')) + 1;
  std::string names = s, titles = "Frame" + s + "Sub Frame", units = s;
  for (const char* name : {"tip:tip", "base:base", "middle:middle"})
    names += s + name + repeated(s, "", wide - 1);
  std::string each = axes;
  std::size_t at = 0;
  while ((at = each.find(' ')) != std::string::npos) each.replace(at, 1, s);
  titles += repeated(s, each, 3);
  for (int k = 0; k < 3; ++k) units += repeated(s, unit, wide - 3) + repeated(s, "mm", 3);
  return first + "\n100\n" + names + "\n" + titles + "\n" + units + "\n" +
         rows(
             {.unit_m = 1e-3, .separator = s},
             [&](int row) { return fmt::format("{}{}0", row + 1, s); }, cells);
}

std::string qualisys(bool with_time, bool named) {
  std::string text =
      "NO_OF_FRAMES\t300\nNO_OF_CAMERAS\t8\nNO_OF_BODIES\t3\nFREQUENCY\t100\nDESCRIPTION\t--\n"
      "TIME_STAMP\t2026-11-30, "
      "12:00:00.000\t100.1\nDATA_INCLUDED\t6D\nBODY_NAMES\ttip\tbase\tmiddle\n";
  text += with_time ? "Frame\tTime" : "Frame";
  for (const char* name : {"tip", "base", "middle"}) {
    text += std::string("\t") + (named ? std::string(name) + " X" : "X") +
            "\tY\tZ\tRoll\tPitch\tYaw\tResidual";
    for (int k = 0; k < 9; ++k) text += fmt::format("\tRot[{}]", k);
  }
  return text + "\n" +
         rows(
             {.unit_m = 1e-3, .separator = "\t"},
             [&](int row) {
               return with_time ? fmt::format("{}\t{:.5f}", row + 1, kPeriod_s * row)
                                : std::to_string(row + 1);
             },
             qualisys_cells(), "\t");
}

std::string seconds(int row) { return number(kPeriod_s * row); }

struct Export {
  const char* name;
  std::string text;
  const char* evidence;  ///< in the map that is proposed
};

std::vector<Export> exports() {
  constexpr double kDegree = std::numbers::pi / 180.0;
  std::vector<Export> all;
  all.push_back({"motive", motive("Meters", 1.0, {"tip", "base", "middle"}),
                 "up: y  # at rest the arm hangs down along y"});
  all.push_back({"motive_mm",
                 motive("Millimeters", 1e-3, {"Rigid Body 3", "the base, fixed", "Body 2"}),
                 "body: \"the base, fixed\""});
  all.push_back(
      {"vicon_rad",
       vicon("Objects", ",", "RX RY RZ TX TY TZ", "rad", rotation_vector_then_position(",", 1.0)),
       "position_unit_m: 0.001"});
  all.push_back({"vicon_quaternion",
                 vicon("Objects", ",", "RX RY RZ RW TX TY TZ", "", quaternion_then_position(",")),
                 "frame_period_s: 0.01"});
  all.push_back({"vicon_tabs",
                 vicon("Segments", "\t", "RX RY RZ TX TY TZ", "deg",
                       rotation_vector_then_position("\t", kDegree)),
                 "an export of Vicon"});
  all.push_back({"qualisys", qualisys(true, true), "6DOF export of Qualisys"});
  all.push_back({"qualisys_frames", qualisys(false, false), "frame_period_s: 0.01"});
  const std::string header =
      "tip.x;tip.y;tip.z;tip.qw;tip.qx;tip.qy;tip.qz;base.x;base.y;base.z;base.qw;base.qx;base.qy;"
      "base.qz;mid.x;mid.y;mid.z;mid.qw;mid.qx;mid.qy;mid.qz";
  all.push_back(
      {"decimal_commas",
       "t_ms;" + header + "\r\n" +
           rows(
               {.unit_m = 1e-3, .separator = ";", .decimal_comma = true, .line_end = "\r\n"},
               [](int row) { return std::to_string(10 * row); },
               position_then_quaternion(";", true)),
       "quaternion_order: wxyz  # by the names"});
  std::string quotes = "# made by a script, by hand\r\"time [s]\"";
  for (const char* body : {"tip", "base", "middle"})
    for (const char* axis : {"x", "y", "z", "q1", "q2", "q3", "q4"})
      quotes += fmt::format(",\"{} {}\"", body, axis);
  all.push_back(
      {"quotes_and_mac",
       quotes + "\r" + rows({.line_end = "\r"}, seconds, position_then_quaternion(",", false)),
       "quaternion_order: xyzw  # orientations then follow"});
  all.push_back({"unlabelled_wxyz",
                 [&] {
                   std::string text = quotes;
                   return text + "\r" +
                          rows({.line_end = "\r"}, seconds, position_then_quaternion(",", true));
                 }(),
                 "quaternion_order: wxyz  # orientations then follow"});
  all.push_back({"microseconds",
                 [&] {
                   std::string text = "stamp\t" + header;
                   std::replace(text.begin(), text.end(), ';', '\t');
                   return text + "\n" +
                          rows(
                              {.separator = "\t"},
                              [](int row) { return std::to_string(10'000 * row); },
                              position_then_quaternion("\t", true));
                 }(),
                 "microseconds"});
  return all;
}

class Exported : public test::ImportTest {
 protected:
  /// Largest deviations of the frames in the log from the motion.
  void expect_motion() const {
    const auto frames =
        test::read_log<softarm_messages::mocap_frame_t>(path("log"), "SOFTARM_MOCAP");
    ASSERT_EQ(frames.size(), static_cast<std::size_t>(kRows));
    for (int row = 0; row < kRows; ++row) {
      const auto& frame = frames[static_cast<std::size_t>(row)];
      ASSERT_NEAR(1e-6 * static_cast<double>(frame.time_us), kPeriod_s * row, 2e-6);
      const auto truth = poses(row);
      for (std::size_t body = 0; body < kBodies; ++body) {
        const auto& seen = frame.message.bodies.at(body);
        ASSERT_TRUE(seen.valid);
        const Eigen::Vector3d p(seen.position_m);
        const Eigen::Quaterniond q(seen.orientation[0], seen.orientation[1], seen.orientation[2],
                                   seen.orientation[3]);
        const auto offset = poses(0)[0].translation();
        ASSERT_LT((p - truth[body].translation()).norm(), 1e-5)
            << row << ", " << body << " " << offset;
        ASSERT_LT(q.angularDistance(Eigen::Quaterniond(truth[body].linear())), 1e-5)
            << row << ", " << body;
      }
    }
  }
};

TEST_F(Exported, EveryKindIsReadAndItsMapProposed) {
  const auto all = exports();
  EXPECT_GE(all.size(), 10u);
  for (const Export& each : all) {
    SCOPED_TRACE(each.name);
    const std::string table = write(each.name, each.text);
    const test::Outcome proposed = test::run("import '" + table + "'");
    ASSERT_EQ(proposed.code, 0) << proposed.text;
    EXPECT_NE(proposed.text.find(each.evidence), std::string::npos) << proposed.text;
    const std::string map = write(std::string(each.name) + ".yaml", proposed.text);
    const test::Outcome imported = import(table, map);
    ASSERT_EQ(imported.code, 0) << imported.text << proposed.text;
    expect_motion();
  }
}

TEST_F(Exported, ColumnsMayBeGivenByNumber) {
  const std::string table = write("table", rows({}, seconds, position_then_quaternion(",", false)));
  const std::string map = write(
      "map.yaml",
      "time: \"#1\"\nrest: {from_s: 0, to_s: 1}\n"
      "base: {id: 0, position: \"#9 #10 #11\", orientation: \"#12 #13 #14 #15\"}\n"
      "segments:\n"
      "  - {id: 1, position: \"#16 #17 #18\", orientation: \"#19 #20 #21 #22\", length_m: 0.2}\n"
      "  - {id: 2, position: \"#2 #3 #4\", orientation: \"#5 #6 #7 #8\", length_m: 0.2}\n");
  const test::Outcome imported = import(table, map);
  ASSERT_EQ(imported.code, 0) << imported.text;
  expect_motion();
}

TEST_F(Exported, EqualTimesAreWhatTheMapSays) {
  const std::string table =
      "time,x,y,z,a,b,c,w,X,Y,Z,A,B,C,W\n0,0,0,1,0,0,0,1,0,0,0,0,0,0,1\n"
      "0,0,0,2,0,0,0,1,0,0,0,0,0,0,1\n1,0,0,3,0,0,0,1,0,0,0,0,0,0,1\n";
  const std::string map =
      "base: {id: 0, position: X Y Z, orientation: A B C W}\n"
      "segments: [{id: 1, position: x y z, orientation: a b c w, length_m: 1}]\n";
  const std::string file = write("table", table);
  EXPECT_EQ(import(file, write("map.yaml", map)).code, 1);
  for (const auto& [policy, height_m] : {std::pair("first", 1.0), std::pair("last", 2.0)}) {
    ASSERT_EQ(import(file, write("map.yaml", map + "equal_times: " + policy + "\n")).code, 0);
    const auto frames =
        test::read_log<softarm_messages::mocap_frame_t>(path("log"), "SOFTARM_MOCAP");
    ASSERT_EQ(frames.size(), 2u);
    EXPECT_EQ(frames[0].message.bodies[1].position_m[2], height_m);
  }
}

TEST_F(Exported, APressureThatIsNoNumberIsRefusedOrHeld) {
  const std::string map =
      "base: {id: 0, position: X Y Z, orientation: A B C W}\n"
      "segments: [{id: 1, position: x y z, orientation: a b c w, length_m: 1}]\n"
      "pressures: {commanded: p";
  for (const char* bad : {"nan", "inf", ""}) {
    const std::string file = write(
        "table",
        std::string("time,p,x,y,z,a,b,c,w,X,Y,Z,A,B,C,W\n0,0.5,0,0,1,0,0,0,1,0,0,0,0,0,0,1\n1,") +
            bad + ",0,0,2,0,0,0,1,0,0,0,0,0,0,1\n");
    const test::Outcome refused = import(file, write("map.yaml", map + "}\n"));
    EXPECT_EQ(refused.code, 1);
    EXPECT_NE(refused.text.find("table:3: p: expected a finite pressure"), std::string::npos)
        << refused.text;
    ASSERT_EQ(import(file, write("map.yaml", map + ", missing: hold}\n")).code, 0);
    const auto commands = test::read_log<softarm_messages::pressure_command_t>(
        path("log"), "SOFTARM_PRESSURE_COMMAND");
    ASSERT_EQ(commands.size(), 2u);
    EXPECT_EQ(commands[1].message.pressure_bar.at(0), 0.5F);
  }
}

}  // namespace
}  // namespace softarm
