// A corpus of bad files: each is the good one with a single line corrupted, and must be refused at
// that line and key.
#include <algorithm>
#include <vector>

#include "config_files.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct BadLine {
  const char* good;      ///< occurs once in the good file
  const char* bad;       ///< what stands there instead
  const char* key;       ///< that must be blamed
  const char* evidence;  ///< part of the message
  const char* at =
      nullptr;  ///< the text in whose line the fault lies; the replacement where not given
};

void PrintTo(const BadLine& line, std::ostream* out) { *out << line.bad; }

const BadLine kBadLines[] = {
    // unknown, with a hint where there is one
    {"seed: 7", "sead: 7", "sead", "did you mean seed"},
    {"  mass_kg: 0.15", "  mass_kgs: 0.15", "arm.mass_kgs", "did you mean mass_kg"},
    {"  length_m: [0.11, 0.12]", "  lenght_m: [0.11, 0.12]", "arm.lenght_m",
     "did you mean length_m"},
    {"    rotation: hanging", "    rotatoin: hanging", "arm.base.rotatoin",
     "did you mean rotation"},
    {"{coriolis: true}", "{coriolis: true, friction: true}", "control.terms.friction",
     "unknown key"},
    {"{time_s: 2, theta_rad", "{time_s: 2, speed: 1, theta_rad", "reference[1].points[1].speed",
     "unknown"},
    {"actuation:\n", "actuaton:\n", "actuaton", "actuation"},
    {"run:\n", "ran:\n", "ran", "did you mean run"},
    {"    status_channel: STATUS", "    status_chanel: STATUS", "daemon.lcm.status_chanel",
     "did you mean"},
    {"{lag_s: 0.02}", "{lag_s: 0.02, delay_s: 0}", "plant.valves.delay_s", "unknown key"},
    {"    theta_rad: 0.3", "    theta_deg: 17", "reference[0].theta_deg", "theta_rad"},
    // missing
    {"name: good\n", "", "name", "missing", "seed: 7"},
    {"  segments: 2\n", "", "arm.segments", "missing", "arm:"},
    {"  segments: 2\n", "  ses: 2\n", "arm.segments", "missing", "arm:"},
    {"  damping_nms_per_rad: 0.029\n", "", "arm.damping_nms_per_rad", "missing", "arm:"},
    {"    gain_nm_per_bar: 0.839\n", "", "actuation.chambers.gain_nm_per_bar", "missing",
     "chambers:"},
    {"  kp_nm_per_rad: [1, [1, 0.5]]\n", "", "control.kp_nm_per_rad", "missing", "control:"},
    {"    duration_s: 5\n", "", "reference[0].duration_s", "missing", "- kind: set_point"},
    {"    theta_rad: 0.3\n", "", "reference[0].theta_rad", "missing", "- kind: set_point"},
    // twice
    {"seed: 7", "seed: 7\nseed: 8", "seed", "a second one (the first is in line 2)", "seed: 8"},
    {"  mass_kg: 0.15", "  mass_kg: 0.15\n  mass_kg: 0.16", "arm.mass_kg", "second",
     "mass_kg: 0.16"},
    {"{coriolis: true}", "{coriolis: true, coriolis: true}", "control.terms.coriolis", "second"},
    {"run:\n", "arm: {}\nrun:\n", "arm", "second"},
    {"{time_s: 0, theta_rad: 0}", "{time_s: 0, time_s: 0, theta_rad: 0}",
     "reference[1].points[0].time_s", "second"},
    // wrong type
    {"seed: 7", "seed: seven", "seed", "\"seven\""},
    {"seed: 7", "seed: 7.5", "seed", "whole number"},
    {"  segments: 2", "  segments: two", "arm.segments", "whole number in [1, 128]"},
    {"  mass_kg: 0.15", "  mass_kg: \"0.15\"", "arm.mass_kg", "in quotes"},
    {"  mass_kg: 0.15", "  mass_kg: 0.15 kg", "arm.mass_kg", "\"0.15 kg\""},
    {"  mass_kg: 0.15", "  mass_kg: 0,15", "arm.mass_kg", "\"0,15\""},
    {"  mass_kg: 0.15", "  mass_kg:", "arm.mass_kg", "nothing"},
    {"  mass_kg: 0.15", "  mass_kg: {all: 0.15}", "arm.mass_kg", "a section"},
    {"  mass_model: distributed", "  mass_model: point\n  radius_m: 0.02", "arm.radius_m",
     "no cross-section", "radius_m: 0.02"},
    {"  mass_model: distributed", "  mass_model: Distributed", "arm.mass_model",
     "one of point, distributed"},
    {"  mass_model: distributed", "  mass_model: [point, point]", "arm.mass_model", "a list of 2"},
    {"    rotation: hanging", "    rotation: sideways", "arm.base.rotation", "hanging, standing"},
    {"{coriolis: true}", "{coriolis: yes}", "control.terms.coriolis", "true or false"},
    {"{coriolis: true}", "off", "control.terms", "a section"},
    {"  method: pose", "  method: best", "estimation.method", "pose, orientation, paper_eq20"},
    {"kind: set_point", "kind: setpoint", "reference[0].kind",
     "set_point, paper, way_points, live"},
    {"    base_id: 0", "    base_id: none", "daemon.bodies.base_id", "fixed or a whole number"},
    {"run:\n  duration_s: 20", "run: 20", "run", "a section"},
    {"3*pi/2]", "3pi/2]", "actuation.chambers.angle_rad[3]", "\"3pi/2\""},
    {"3*pi/2]", "pi/0]", "actuation.chambers.angle_rad[3]", "\"pi/0\""},
    {"  rate_hz: 500", "  rate_hz: 100*pi", "daemon.rate_hz", "\"100*pi\""},
    // wrong size
    {"[0.11, 0.12]", "[0.11, 0.12, 0.13]", "arm.length_m", "a list of 3"},
    {"position_m: [0, 0, 1]", "position_m: [0, 0]", "arm.base.position_m", "a list of 3 numbers"},
    {"position_m: [0, 0, 1]", "position_m: 1", "arm.base.position_m", "a list of 3 numbers"},
    {"[1, [1, 0.5]]", "[1, [1, 0.5, 0]]", "control.kp_nm_per_rad[1]", "a list of 3"},
    {"[1, [1, 0.5]]", "[1, 1, 1, 1]", "control.kp_nm_per_rad", "a list of 4"},
    {"phi_rad: [0, pi]", "phi_rad: [0]", "reference[0].phi_rad", "a list of 1"},
    {"segment_ids: [1, 2]", "segment_ids: [1]", "daemon.bodies.segment_ids",
     "a list of 2 whole numbers"},
    {"[0, pi/2, pi, 3*pi/2]", "[]", "actuation.chambers.angle_rad", "a list of 0"},
    // not a number that can be used
    {"  mass_kg: 0.15", "  mass_kg: .nan", "arm.mass_kg", "\".nan\""},
    {"  mass_kg: 0.15", "  mass_kg: nan", "arm.mass_kg", "\"nan\""},
    {"  mass_kg: 0.15", "  mass_kg: inf", "arm.mass_kg", "\"inf\""},
    {"  mass_kg: 0.15", "  mass_kg: 1e999", "arm.mass_kg", "\"1e999\""},
    {"  kd_nms_per_rad: 0.002", "  kd_nms_per_rad: .inf", "control.kd_nms_per_rad", "\".inf\""},
    {"[0, 0, -9.81]", "[0, .NaN, -9.81]", "arm.gravity_mps2[1]", "\".NaN\""},
    // out of range
    {"  segments: 2", "  segments: 0", "arm.segments", "[1, 128]"},
    {"  segments: 2", "  segments: 129", "arm.segments", "[1, 128]"},
    {"[0.11, 0.12]", "[0.11, 0]", "arm.length_m[1]", "(0, 10] m"},
    {"  mass_kg: 0.15", "  mass_kg: -0.15", "arm.mass_kg", "(0, 100] kg"},
    {"seed: 7", "seed: -1", "seed", "whole number in [0,"},
    {"seed: 7", "seed: 99999999999999999999", "seed", "whole number"},
    {"  rate_hz: 500", "  rate_hz: 0", "daemon.rate_hz", "[1, 20000] Hz"},
    {"  predicted_frames: 3", "  predicted_frames: -1", "estimation.predicted_frames", "[0, 1000]"},
    {"{stiffness_factor: 1.05}", "{stiffness_factor: 0}", "plant.mismatch.stiffness_factor",
     "(0, 100]"},
    {"status_channel: STATUS", "status_channel: \"\"", "daemon.lcm.status_channel", "printable"},
    {"status_channel: STATUS", "url: \"udpm://239.255.76.67?ttl=0\"", "daemon.lcm.url", "a port"},
    // inconsistent
    {"  max_pressure_bar: 2", "  max_pressure_bar: 2\n  bias_pressure_bar: 3",
     "actuation.bias_pressure_bar", "between min and max", "bias_pressure_bar: 3"},
    {"  min_pressure_bar: 0", "  min_pressure_bar: 2.5", "actuation.max_pressure_bar",
     "more than min", "max_pressure_bar: 2"},
    {"  vent_bar_per_s: 8", "  vent_bar_per_s: 1.9", "actuation.vent_bar_per_s", "less than 1 s"},
    {"segment_ids: [1, 2]", "segment_ids: [1, 1]", "daemon.bodies.segment_ids", "body 1 twice"},
    {"    base_id: 0", "    base_id: 2", "daemon.bodies.base_id", "no segment's end"},
    {"    vent_overruns: 10", "    vent_overruns: 2", "daemon.safety.vent_overruns",
     "hold_overruns"},
    {"status_channel: STATUS", "status_channel: SOFTARM_MOCAP", "daemon.lcm.status_channel",
     "a separate channel"},
    {"    status_channel: STATUS", "    status_channel: STATUS\n    deadman_channel: STATUS",
     "daemon.lcm.deadman_channel", "a separate channel", "deadman_channel: STATUS"},
    {"    vent_overruns: 10", "    vent_overruns: 10\n    valve_silence_s: 0.001",
     "daemon.safety.valve_silence_s", "two ticks", "valve_silence_s"},
    {"status_channel: STATUS", "status_channel: MY STATUS", "daemon.lcm.status_channel", "letters"},
    {"    rotation: hanging", "    rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 0.9]]",
     "arm.base.rotation", "orthonormal"},
    {"    rotation: hanging", "    rotation: [[1, 0, 0], [0, 1, 0], [0, 0, -1]]",
     "arm.base.rotation", "determinant -1"},
    {"theta_rad: 0.3", "theta_rad: 3", "reference[0]", "max_theta_rad", "- kind: set_point"},
    {"theta_rad: 0.3", "theta_rad: 0.3\n    u_rad: 0.1", "reference[0].u_rad", "either",
     "u_rad: 0.1"},
    {"{time_s: 2,", "{time_s: 0,", "reference[1].points[1].time_s", "later than the point before"},
    {"[0, pi/2, pi, 3*pi/2]", "[0, pi]", "actuation.chambers", "at least 3 chambers", "chambers:"},
    {"[0, pi/2, pi, 3*pi/2]", "[0, 0.5, 1]", "actuation.chambers", "every direction", "chambers:"},
    // not YAML as we take it
    {"  mass_kg: 0.15", "  mass_kg: [0.15", "arm.mass_kg", "a closing bracket"},
    {"  mass_kg: 0.15", "  mass_kg: !!float 0.15", "arm.mass_kg", "no tags"},
    {"  mass_kg: 0.15", "  ? [mass_kg]\n  : 0.15", "arm", "a word as key", "[mass_kg]"},
};

int line_of(const std::string& text, std::size_t offset) {
  return 1 + static_cast<int>(std::count(text.begin(),
                                         text.begin() + static_cast<std::ptrdiff_t>(offset), '\n'));
}

class BadFile : public testing::TestWithParam<BadLine> {};

TEST_P(BadFile, IsRefusedWithFileLineAndKey) {
  const BadLine& line = GetParam();
  std::string text = kGoodExperiment;
  const std::size_t offset = text.find(line.good);
  ASSERT_NE(offset, std::string::npos) << line.good;
  ASSERT_EQ(text.find(line.good, offset + 1), std::string::npos) << "twice: " << line.good;
  text.replace(offset, std::string(line.good).size(), line.bad);
  const std::size_t fault = line.at == nullptr ? offset : text.find(line.at);
  ASSERT_NE(fault, std::string::npos) << line.at;

  const TestFolder folder;
  const auto file = folder.write("bad.yaml", text);
  try {
    load_experiment(file);
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.file, file.string());
    EXPECT_EQ(error.line, line_of(text, fault)) << error.what();
    EXPECT_EQ(error.key, line.key) << error.what();
    EXPECT_NE(std::string(error.what()).find(line.evidence), std::string::npos) << error.what();
    EXPECT_EQ(
        std::string(error.what()).find(file.string() + ":" + std::to_string(error.line) + ": "), 0u)
        << error.what();
  }
}
INSTANTIATE_TEST_SUITE_P(Corpus, BadFile, testing::ValuesIn(kBadLines));

TEST(GoodFile, IsAccepted) {
  const TestFolder folder;
  EXPECT_NO_THROW(load_experiment(folder.write("good.yaml", kGoodExperiment)));
}

}  // namespace
}  // namespace softarm
