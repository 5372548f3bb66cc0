// A hundred mistakes that people make in such files: each message names the key that was written,
// says what was expected, and how to put it right.
#include <vector>

#include "config_files.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

struct Mistake {
  const char* good;  ///< occurs once in the good file
  const char* bad;   ///< what people write
  const char* key;   ///< that they wrote
  const char* fix;   ///< part of the message
};

void PrintTo(const Mistake& mistake, std::ostream* out) { *out << mistake.bad; }

const Mistake kMistakes[] = {
    // Names of keys: letters, units, words, places.
    {"max_pressure_bar: 2", "max_presure_bar: 2", "actuation.max_presure_bar",
     "did you mean max_pressure_bar?"},
    {"max_pressure_bar: 2", "pressure_max_bar: 2", "actuation.pressure_max_bar",
     "max_pressure_bar"},
    {"max_pressure_bar: 2", "max_pressure_kpa: 200", "actuation.max_pressure_kpa",
     "did you mean max_pressure_bar?"},
    {"kp_nm_per_rad:", "kp_nm_per_rd:", "control.kp_nm_per_rd", "did you mean kp_nm_per_rad?"},
    {"kp_nm_per_rad:", "kp:", "control.kp", "did you mean kp_nm_per_rad?"},
    {"kp_nm_per_rad:", "Kp:", "control.Kp", "did you mean kp_nm_per_rad?"},
    {"kd_nms_per_rad:", "kd:", "control.kd", "did you mean kd_nms_per_rad?"},
    {"kd_nms_per_rad:", "kd_nm_per_rad:", "control.kd_nm_per_rad", "did you mean kd_nms_per_rad?"},
    {"stiffness_nm_per_rad:", "stiffness:", "arm.stiffness", "did you mean stiffness_nm_per_rad?"},
    {"stiffness_nm_per_rad:", "stifness_nm_per_rad:", "arm.stifness_nm_per_rad",
     "did you mean stiffness_nm_per_rad?"},
    {"damping_nms_per_rad:", "damping:", "arm.damping", "did you mean damping_nms_per_rad?"},
    {"damping_nms_per_rad:", "damping_nm_per_rad:", "arm.damping_nm_per_rad",
     "did you mean damping_nms_per_rad?"},
    {"mass_kg:", "mass:", "arm.mass", "did you mean mass_kg?"},
    {"mass_kg:", "Mass_kg:", "arm.Mass_kg", "did you mean mass_kg?"},
    {"mass_kg:", "mass-kg:", "arm.mass-kg", "did you mean mass_kg?"},
    {"mass_kg:", "massKg:", "arm.massKg", "did you mean mass_kg?"},
    {"mass_kg:", "mass_g:", "arm.mass_g", "did you mean mass_kg?"},
    {"mass_kg:", "segment_mass_kg:", "arm.segment_mass_kg", "did you mean mass_kg?"},
    {"length_m:", "length:", "arm.length", "did you mean length_m?"},
    {"length_m:", "length_mm:", "arm.length_mm", "did you mean length_m?"},
    {"length_m:", "lenght_m:", "arm.lenght_m", "did you mean length_m?"},
    {"length_m:", "lengths_m:", "arm.lengths_m", "did you mean length_m?"},
    {"segments: 2", "num_segments: 2", "arm.num_segments", "did you mean segments?"},
    {"segments: 2", "segment: 2", "arm.segment", "did you mean segments?"},
    {"gravity_mps2:", "gravity:", "arm.gravity", "did you mean gravity_mps2?"},
    {"theta_rad: 0.3", "theta: 0.3", "reference[0].theta", "did you mean theta_rad?"},
    {"theta_rad: 0.3", "theta_deg: 17", "reference[0].theta_deg", "did you mean theta_rad?"},
    {"phi_rad: [0, pi]", "phi_deg: [0, 180]", "reference[0].phi_deg", "did you mean phi_rad?"},
    {"rate_hz: 500", "rate: 500", "daemon.rate", "did you mean rate_hz?"},
    {"segment_ids: [1, 2]", "segments_ids: [1, 2]", "daemon.bodies.segments_ids",
     "did you mean segment_ids?"},
    {"base_id: 0", "baseId: 0", "daemon.bodies.baseId", "did you mean base_id?"},
    {"status_channel: STATUS", "statuschannel: STATUS", "daemon.lcm.statuschannel",
     "did you mean status_channel?"},
    {"vent_bar_per_s: 8", "vent_rate_bar_per_s: 8", "actuation.vent_rate_bar_per_s",
     "did you mean vent_bar_per_s?"},
    {"hold_overruns: 3", "hold_overrun: 3", "daemon.safety.hold_overrun",
     "did you mean hold_overruns?"},
    {"predicted_frames: 3", "predict_frames: 3", "estimation.predict_frames",
     "did you mean predicted_frames?"},
    {"reference:\n", "references:\n", "references", "did you mean reference?"},
    {"control:\n", "controller:\n", "controller", "did you mean control?"},
    {"gravity_mps2:", "kp_nm_per_rad: 1\n  gravity_mps2:", "arm.kp_nm_per_rad",
     "did you mean control.kp_nm_per_rad?"},
    {"  mass_model: distributed", "  rotation: hanging", "arm.rotation",
     "did you mean arm.base.rotation?"},
    {"  damping_nms_per_rad: 0.029\n", "", "arm.damping_nms_per_rad", "missing"},
    {"seed: 7", "seed: 7\nrate_hz: 500", "rate_hz", "did you mean daemon.rate_hz?"},
    {"seed: 7", "seed: 7\nhold_after_s: 0.1", "hold_after_s",
     "did you mean daemon.safety.hold_after_s?"},
    // Numbers: commas, units, quotes, other bases, what is no number.
    {"mass_kg: 0.15", "mass_kg: 0,15", "arm.mass_kg", "with a decimal point: 0.15"},
    {"rate_hz: 500", "rate_hz: 1,000.5", "daemon.rate_hz", "without separators: 1000.5"},
    {"{coriolis: true}", "{coriolis: true}\n  valve_lag_s: 0,5", "control.valve_lag_s",
     "with a decimal point: 0.5"},
    {"{lag_s: 0.02}", "{lag_s: 0,02}", "plant.valves.lag_s", "a decimal point (0.02)"},
    {"[0.11, 0.12]", "[0,11, 0,12]", "arm.length_m", "decimal commas?"},
    {"mass_kg: 0.15", "mass_kg: \"0.15\"", "arm.mass_kg", "write it without quotes"},
    {"mass_kg: 0.15", "mass_kg: 0.15 kg", "arm.mass_kg", "write the number alone: 0.15"},
    {"mass_kg: 0.15", "mass_kg: 0.15kg", "arm.mass_kg", "write the number alone: 0.15"},
    {"mass_kg: 0.15", "mass_kg: 150 g", "arm.mass_kg", "write it in kg: 0.15"},
    {"mass_kg: 0.15", "mass_kg: 150", "arm.mass_kg", "in g? then it is 0.15 kg"},
    {"mass_kg: 0.15", "mass_kg: -0.15", "arm.mass_kg", "a number or a list of 2 in (0, 100] kg"},
    {"[0.11, 0.12]", "[110, 120]", "arm.length_m[0]", "in mm? then it is 0.11 m"},
    {"[0.11, 0.12]", "110 mm", "arm.length_m", "write it in m: 0.11"},
    {"[0.11, 0.12]", "11cm", "arm.length_m", "write it in m: 0.11"},
    {"[0.11, 0.12]", "0.11 0.12", "arm.length_m", "a list of 2"},
    {"[0.11, 0.12]", "0.11, 0.12", "arm.length_m", "in brackets: [0.11, 0.12]"},
    {"[0.11, 0.12]", "(0.11, 0.12)", "arm.length_m", "in brackets: [0.11, 0.12]"},
    {"max_pressure_bar: 2", "max_pressure_bar: 200 kPa", "actuation.max_pressure_bar",
     "write it in bar: 2"},
    {"max_pressure_bar: 2", "max_pressure_bar: 200000", "actuation.max_pressure_bar",
     "in Pa? then it is 2 bar"},
    {"max_pressure_bar: 2", "max_pressure_bar: 2bar", "actuation.max_pressure_bar",
     "write the number alone: 2"},
    {"rate_hz: 500", "rate_hz: 500Hz", "daemon.rate_hz", "write the number alone: 500"},
    {"rate_hz: 500", "rate_hz: 1_000", "daemon.rate_hz", "without separators: 1000"},
    {"rate_hz: 500", "rate_hz: 1 000", "daemon.rate_hz", "without separators: 1000"},
    {"rate_hz: 500", "rate_hz: 10^3", "daemon.rate_hz", "write the result"},
    {"rate_hz: 500", "rate_hz: 5*100", "daemon.rate_hz", "write the result"},
    {"predicted_frames: 3", "predicted_frames: 3.0", "estimation.predicted_frames", "write 3"},
    {"predicted_frames: 3", "predicted_frames: 010", "estimation.predicted_frames",
     "octal to some programs: write 10"},
    {"mass_kg: 0.15", "mass_kg: 00.15", "arm.mass_kg", "write 0.15"},
    {"predicted_frames: 3", "predicted_frames: 0x10", "estimation.predicted_frames",
     "decimal digits"},
    {"predicted_frames: 3", "predicted_frames: three", "estimation.predicted_frames",
     "whole number"},
    {"mass_kg: 0.15", "mass_kg: ~", "arm.mass_kg", "got nothing"},
    {"mass_kg: 0.15", "mass_kg:", "arm.mass_kg", "got nothing"},
    {"mass_kg: 0.15", "mass_kg: 1/0", "arm.mass_kg", "\"1/0\""},
    {"3*pi/2]", "3pi/2]", "actuation.chambers.angle_rad[3]", "write 3*pi/2"},
    {"3*pi/2]", "270 deg]", "actuation.chambers.angle_rad[3]", "write it in rad: 270*pi/180"},
    {"3*pi/2]", "270]", "actuation.chambers.angle_rad[3]", "degrees? write 270*pi/180"},
    {"3*pi/2]", "270\xc2\xb0]", "actuation.chambers.angle_rad[3]", "270*pi/180"},
    {"theta_rad: 0.3", "theta_rad: 17 degrees", "reference[0].theta_rad", "17*pi/180"},
    // Words.
    {"rotation: hanging", "rotation: Hanging", "arm.base.rotation", "did you mean hanging?"},
    {"rotation: hanging", "rotation: hangin", "arm.base.rotation", "did you mean hanging?"},
    {"coriolis: true", "coriolis: yes", "control.terms.coriolis", "write true"},
    {"coriolis: true", "coriolis: True", "control.terms.coriolis", "write true"},
    {"coriolis: true", "coriolis: off", "control.terms.coriolis", "write false"},
    {"coriolis: true", "coriolis: 1", "control.terms.coriolis", "write true"},
    {"mass_model: distributed", "mass_model: Distributed", "arm.mass_model",
     "did you mean distributed?"},
    {"kind: set_point", "kind: setpoint", "reference[0].kind", "did you mean set_point?"},
    {"kind: set_point", "kind: set-point", "reference[0].kind", "did you mean set_point?"},
    {"kind: way_points", "kind: waypoints", "reference[1].kind", "did you mean way_points?"},
    {"method: pose", "method: poses", "estimation.method", "did you mean pose?"},
    {"method: pose", "method: orientaion", "estimation.method", "did you mean orientation?"},
    // The text: colons, spaces, brackets, quotes, columns.
    {"mass_kg: 0.15", "mass_kg 0.15", "arm.mass_kg", "a colon behind the key (mass_kg: ...)"},
    {"mass_kg: 0.15", "mass_kg:0.15", "arm.mass_kg", "a space behind the colon"},
    {"mass_kg: 0.15", "mass_kg = 0.15", "arm.mass_kg", "got an equals sign"},
    {"estimation:\n", "estimation\n", "estimation", "a colon behind the key"},
    {"  mass_kg: 0.15", "\tmass_kg: 0.15", "", "YAML takes no tabs"},
    {"[0.11, 0.12]", "[0.11, 0.12", "arm.length_m", "a closing bracket"},
    {"name: good", "name: \"good", "name", "a closing quote"},
    {"  mass_kg: 0.15", "   mass_kg: 0.15", "arm", "the same column"},
    {"mass_kg: 0.15", "mass_kg: 0.15\n  mass_kg: 0.2", "arm.mass_kg", "the first is in line"},
    {"run:\n  duration_s: 20", "run: 20", "run", "a section"},
    {"    points:", "    duration_s: 5\n    points:", "reference[1].duration_s",
     "nothing: the last phase does not end"},
    {"name: good", "name: Gr\xf6\x62li", "name", "save the file as UTF-8"},
    {"seed: 7", "include: not_there.yaml", "include", "an existing file, relative to this one"},
    {"seed: 7", "include: wrong.yaml", "include", "a file that does not include this one again"},
    // What was identified and does not belong together.
    {"reference:", "identification: {stiffening_by_length: 3}\nreference:",
     "identification.stiffening_by_length", "identification.stretch_m_per_bar"},
};

class TypicalMistake : public testing::TestWithParam<Mistake> {};

TEST_P(TypicalMistake, IsAnsweredWithItsKeyAndTheFix) {
  const Mistake& mistake = GetParam();
  std::string text = kGoodExperiment;
  const std::size_t offset = text.find(mistake.good);
  ASSERT_NE(offset, std::string::npos) << mistake.good;
  text.replace(offset, std::string(mistake.good).size(), mistake.bad);
  const TestFolder folder;
  const auto file = folder.write("wrong.yaml", text);
  try {
    load_experiment(file);
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    const std::string all = error.what();
    const std::string place = *mistake.key != 0 ? std::string(" ") + mistake.key : "";
    EXPECT_NE(all.find(place), std::string::npos) << all;
    EXPECT_NE(all.find(mistake.fix), std::string::npos) << all;
    EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 0) << "one mistake, one message:\n" << all;
  }
}
INSTANTIATE_TEST_SUITE_P(Hundred, TypicalMistake, testing::ValuesIn(kMistakes));

TEST(TypicalMistakes, AreAHundred) { EXPECT_GE(std::size(kMistakes), 100u); }

std::string message_of(const std::filesystem::path& file) {
  try {
    load_experiment(file);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string with(std::initializer_list<std::pair<const char*, const char*>> changes) {
  std::string text = kGoodExperiment;
  for (const auto& [good, bad] : changes)
    text.replace(text.find(good), std::string(good).size(), bad);
  return text;
}

TEST(ErrorsOfAFile, AreAllReportedInTheOrderOfItsLines) {
  const TestFolder folder;
  const std::string all =
      message_of(folder.write("wrong.yaml", with({{"seed: 7", "sead: 7"},
                                                  {"mass_kg: 0.15", "mass_kg: 0,15"},
                                                  {"rotation: hanging", "rotation: hangin"},
                                                  {"  damping_nms_per_rad: 0.029\n", ""},
                                                  {"max_pressure_bar: 2", "max_presure_bar: 2"},
                                                  {"kind: set_point", "kind: setpoint"},
                                                  {"rate_hz: 500", "rate_hz: fast"},
                                                  {"duration_s: 20", "duration_s: -1"}})));
  EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 7) << all;
  std::size_t at = 0;
  for (const char* key :
       {"sead", "arm.damping_nms_per_rad", "arm.mass_kg", "arm.base.rotation",
        "actuation.max_presure_bar", "reference[0].kind", "daemon.rate_hz", "run.duration_s"}) {
    at = all.find(std::string(": ") + key + ": ", at);
    ASSERT_NE(at, std::string::npos) << key << "\n" << all;
  }
}

TEST(ErrorsOfAFile, AnIncludedKeyMayBeTheOneThatWasMeant) {
  const TestFolder folder;
  folder.write("base.yaml", kGoodExperiment);
  const std::string all = message_of(folder.write(
      "wrong.yaml", "include: base.yaml\narm: {mass_kgs: 0.1}\ncontrol: {kp_nm_per_rd: 1}\n"));
  EXPECT_NE(all.find("did you mean mass_kg?"), std::string::npos) << all;
  EXPECT_NE(all.find("did you mean kp_nm_per_rad?"), std::string::npos) << all;
}

TEST(ErrorsOfAFile, AreTwentyAtMost) {
  const TestFolder folder;
  std::string more;
  for (int i = 0; i < 30; ++i) more += "nonsense_" + std::to_string(i) + ": 1\n";
  const std::string all = message_of(folder.write("wrong.yaml", kGoodExperiment + more));
  EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 20) << all;
  EXPECT_NE(all.find("and 10 more"), std::string::npos) << all;
}

TEST(Fractions, AreNumbers) {
  const TestFolder folder;
  const auto file =
      folder.write("good.yaml", with({{"  safety:\n", "  safety:\n    frame_period_s: 1/120\n"},
                                      {"mass_kg: 0.15", "mass_kg: 3/20"}}));
  const Experiment experiment = load_experiment(file);
  EXPECT_EQ(experiment.safety.frame_period_s, 1.0 / 120.0);
  EXPECT_EQ(experiment.arm.segments[0].mass_kg, 3.0 / 20.0);
}

// As PyYAML writes a structure that holds an object twice.
TEST(Aliases, AreResolved) {
  const TestFolder folder;
  const Experiment plain = load_experiment(folder.write("plain.yaml", kGoodExperiment));
  const Experiment aliased = load_experiment(
      folder.write("aliased.yaml",
                   with({{"mass_kg: 0.15", "mass_kg: &id001 0.15"},
                         {"length_m: [0.11, 0.12]", "length_m: &id002 [0.11, 0.12]"},
                         {"segment_ids: [1, 2]", "segment_ids: &id003 [1, 2]"},
                         {"plant:\n", "plant:\n  arm: {length_m: *id002, mass_kg: *id001}\n"}})));
  EXPECT_EQ(resolved_text(plain), resolved_text(aliased));
  const std::string all =
      message_of(folder.write("wrong.yaml", with({{"mass_kg: 0.15", "mass_kg: &a [*a]"}})));
  EXPECT_NE(all, "");
}

TEST(Includes, AreFoundBesideALinkAndBesideTheFile) {
  const TestFolder folder;
  std::filesystem::create_directories(folder.path() / "real");
  folder.write("real/base.yaml", kGoodExperiment);
  folder.write("real/arm.yaml", "include: base.yaml\n");
  std::filesystem::create_symlink("real/arm.yaml", folder.path() / "link.yaml");
  EXPECT_EQ(message_of(folder.path() / "link.yaml"), "");
  std::filesystem::remove(folder.path() / "real/base.yaml");
  const std::string all = message_of(folder.path() / "link.yaml");
  EXPECT_NE(all.find((folder.path() / "base.yaml").string()), std::string::npos) << all;
  EXPECT_NE(all.find("real/base.yaml"), std::string::npos) << all;
  folder.write("base.yaml", kGoodExperiment);
  EXPECT_EQ(message_of(folder.path() / "link.yaml"), "");
}

}  // namespace
}  // namespace softarm
