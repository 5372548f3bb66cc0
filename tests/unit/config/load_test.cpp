// What good files mean, and that what is printed loads again to the same.
#include "softarm/config/load.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <regex>
#include <vector>

#include "config_files.hpp"

namespace softarm {
namespace {

constexpr double kPi = std::numbers::pi;

Experiment shipped(const std::string& name) { return load_experiment(kConfigFolder / name); }

std::vector<std::string> shipped_files() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kConfigFolder)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().filename());
  }
  return names;
}

class ShippedFile : public testing::TestWithParam<std::string> {};

TEST_P(ShippedFile, LoadsAndItsResolvedTextLoadsToTheSame) {
  const Experiment first = shipped(GetParam());
  const TestFolder folder;
  const Experiment second = load_experiment(folder.write("again.yaml", resolved_text(first)));
  EXPECT_EQ(resolved_text(first), resolved_text(second));
  EXPECT_EQ(first.hash, second.hash);
  EXPECT_EQ(first.plant.seed, second.plant.seed);
}

TEST_P(ShippedFile, WarnsOfNothing) {
  const auto warnings = experiment_warnings(shipped(GetParam()));
  EXPECT_TRUE(warnings.empty()) << warnings.front();
}
INSTANTIATE_TEST_SUITE_P(Config, ShippedFile, testing::ValuesIn(shipped_files()),
                         [](const auto& file) {
                           return std::regex_replace(file.param, std::regex("[^a-z_]"), "_");
                         });

TEST(Template, IsUpToDate) {
  EXPECT_EQ(file_text(kConfigFolder / "template.yaml"), template_text())
      << "softarm check --template > config/template.yaml";
}

TEST(Schema, IsUpToDate) {
  EXPECT_EQ(file_text(kConfigFolder / "experiment.schema.json"), schema_text())
      << "softarm check --schema > config/experiment.schema.json";
}

/// The template documents what is derived where a key is left out or 0 (resolve_thresholds).
TEST(Template, NamesEveryTermOfDerivedThresholds) {
  const std::string text = std::regex_replace(template_text(), std::regex("\n *#"), "");
  EXPECT_NE(text.find("max(3 T, 3 frame_period_s + frame_latency_s), T = 1/rate_hz"),
            std::string::npos);
  EXPECT_NE(text.find("max(0.1 s, 10 frame_period_s, 3 T)"), std::string::npos);
}

/// Without its line a key that is marked as required is missed, and no other.
TEST(Template, MarksWhatIsRequired) {
  std::vector<std::string> lines;
  std::istringstream stream(template_text());
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  const auto is_comment = [](const std::string& line) {
    return line.find_first_not_of(' ') == line.find('#') && !line.empty();
  };
  const TestFolder folder;
  int required = 0;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const bool one_line =
        lines[i].find(": ") != std::string::npos && lines[i].find("- ") == std::string::npos;
    if (is_comment(lines[i]) || !one_line || !is_comment(lines[i - 1])) continue;
    std::string without;
    for (std::size_t j = 0; j < lines.size(); ++j) without += j == i ? "\n" : lines[j] + "\n";
    bool missed = false;
    try {
      load_experiment(folder.write("e.yaml", without));
    } catch (const ConfigError& error) {
      missed = std::string(error.what()).find("missing") != std::string::npos;
    }
    EXPECT_EQ(missed, lines[i - 1].ends_with("required)")) << lines[i];
    if (missed) ++required;
  }
  EXPECT_GE(required, 9);
}

/// Hints in the template are in force once their "# " is taken away.
TEST(Template, HintsLoadWhenUncommented) {
  const std::string text = std::regex_replace(
      template_text(), std::regex("\n  # (mismatch:|arm:|actuation:|registers:|  )"), "\n  $1");
  ASSERT_NE(text, template_text());
  const std::string planar =
      "  plane_rad: 0\n";  // the one hint that would change the chambers needed
  const TestFolder folder;
  const Experiment plain = load_experiment(folder.write("plain.yaml", template_text()));
  std::string with_hints = text;
  const auto at = with_hints.find("  " + planar);
  ASSERT_NE(at, std::string::npos);
  with_hints.erase(at, planar.size() + 2);
  const Experiment hinted = load_experiment(folder.write("hinted.yaml", with_hints));
  EXPECT_EQ(resolved_text(plain), resolved_text(hinted));
}

TEST(PaperArm, IsThatOfSectionVII) {
  const Experiment e = shipped("paper_arm.yaml");
  ASSERT_EQ(e.arm.size(), 3);
  for (const auto& segment : e.arm.segments) {
    EXPECT_EQ(segment.length_m, 0.11);
    EXPECT_EQ(segment.mass_kg, 0.15);
    EXPECT_EQ(segment.stiffness_nm_per_rad, 0.626);
    EXPECT_EQ(segment.damping_nms_per_rad, 0.029);
  }
  ASSERT_EQ(e.actuation.segments.size(), 3u);
  ASSERT_EQ(e.actuation.segments[2].size(), 4u);
  EXPECT_EQ(e.actuation.segments[2][3].angle_rad, 1.5 * kPi);
  EXPECT_EQ(e.actuation.segments[2][3].gain_nm_per_bar, 0.839);
  EXPECT_EQ(e.control.kp, std::vector<double>(6, 1.0));
  EXPECT_EQ(e.control.kd, std::vector<double>(6, 0.002));
  EXPECT_EQ(e.rate_hz, 500.0);
  EXPECT_NEAR(e.plant.mocap.orientation_noise_rad, 0.2 * kPi / 180.0, 1e-18);
  EXPECT_EQ(e.plant.arm.mass, MassModel::distributed);
  ASSERT_EQ(e.reference.phases.size(), 1u);
  const auto& paper = *e.reference.phases[0].kind.get_if<PaperReference>();
  EXPECT_EQ(paper.theta_rad, 0.4);
  EXPECT_EQ(paper.phase_step_rad, kPi / 3.0);
}

TEST(PaperArm, VariantsDifferWhereTheySay) {
  const Experiment base = shipped("paper_arm.yaml");
  const Experiment off = shipped("paper_arm_mismatch.yaml");
  EXPECT_EQ(off.arm.segments[1].stiffness_nm_per_rad, 0.626);
  EXPECT_DOUBLE_EQ(off.plant.arm.segments[1].stiffness_nm_per_rad, 1.05 * 0.626);
  EXPECT_DOUBLE_EQ(off.plant.arm.segments[2].mass_kg, 1.05 * 0.15);
  EXPECT_DOUBLE_EQ(off.plant.arm.segments[0].damping_nms_per_rad, 0.95 * 0.029);
  EXPECT_DOUBLE_EQ(off.plant.actuation.segments[0][1].gain_nm_per_bar, 0.95 * 0.839);
  EXPECT_EQ(off.plant.mocap.rate_hz, base.plant.mocap.rate_hz);
  EXPECT_NE(off.hash, base.hash);

  const Experiment polar = shipped("paper_arm_polar.yaml");
  EXPECT_EQ(polar.control.coordinates, ControlCoordinates::polar);
  EXPECT_EQ(polar.control.kp, (std::vector<double>{1.2, 0.0, 1.1, 0.0, 1.0, 0.0}));
  EXPECT_EQ(polar.rate_hz, 1000.0);
  EXPECT_EQ(polar.plant.valves.lag_s, 0.0);
}

Experiment load_text(const std::string& text) {
  const TestFolder folder;
  return load_experiment(folder.write("experiment.yaml", text));
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Load, FormsOfValues) {
  const Experiment e = load_text(kGoodExperiment);
  EXPECT_EQ(e.name, "good");
  EXPECT_EQ(e.seed, 7u);
  EXPECT_EQ(e.plant.seed, 7u);
  EXPECT_EQ(e.arm.segments[1].length_m, 0.12);
  EXPECT_EQ(e.control.kp, (std::vector<double>{1.0, 1.0, 1.0, 0.5}));
  EXPECT_EQ(e.arm.base_position_m, Eigen::Vector3d(0.0, 0.0, 1.0));
  const auto& u = e.reference.phases[0].kind.get_if<SetPointReference>()->u_rad;
  EXPECT_DOUBLE_EQ(u[0], 0.3);
  EXPECT_DOUBLE_EQ(u[2], -0.3);
  EXPECT_NEAR(u[3], 0.0, 1e-16);
}

TEST(Load, PlantFollowsTheControllerAndItsOwnKeysWin) {
  const Experiment e =
      load_text(replaced(kGoodExperiment, "  mismatch: {stiffness_factor: 1.05}",
                         "  mismatch: {mass_factor: [2, 3], gain_factor: 0.5}\n  arm: {mass_model: "
                         "point, mass_kg: [0.2, 0.4]}\n"
                         "  actuation: {chambers: {gain_nm_per_bar: [1, 2, 3, 4]}}"));
  EXPECT_EQ(e.arm.mass, MassModel::distributed);
  EXPECT_EQ(e.plant.arm.mass, MassModel::point);
  EXPECT_EQ(e.plant.arm.segments[1].mass_kg, 0.4);
  EXPECT_EQ(e.plant.arm.segments[1].length_m, 0.12);
  EXPECT_EQ(e.plant.arm.base_position_m, e.arm.base_position_m);
  EXPECT_EQ(e.plant.actuation.segments[1][2].gain_nm_per_bar, 3.0);
  EXPECT_EQ(e.plant.actuation.segments[1][2].angle_rad, kPi);
  EXPECT_EQ(e.actuation.segments[1][2].gain_nm_per_bar, 0.839);
}

TEST(Load, SupplyFollowsTheHighestPressure) {
  const Experiment e =
      load_text(replaced(kGoodExperiment, "max_pressure_bar: 2", "max_pressure_bar: 3"));
  EXPECT_EQ(e.plant.valves.supply_pressure_bar, 3.0);
}

TEST(Include, MergesKeyByKeyAndErrorsNameTheRightFile) {
  const TestFolder folder;
  const auto base = folder.write("base.yaml", kGoodExperiment);
  const Experiment e = load_experiment(folder.write(
      "over.yaml", "include: base.yaml\narm: {mass_kg: 0.3}\nreference:\n  - {kind: live}\n"));
  EXPECT_EQ(e.name, "good");
  EXPECT_EQ(e.arm.segments[0].mass_kg, 0.3);
  EXPECT_EQ(e.arm.segments[0].length_m, 0.11);
  EXPECT_EQ(e.reference.phases.size(), 1u);  // lists are replaced

  folder.write("base.yaml", replaced(kGoodExperiment, "mass_kg: 0.15", "mass_kg: -1"));
  try {
    load_experiment(folder.write("other.yaml", "include: base.yaml\nname: other\n"));
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.file, base.string());
    EXPECT_EQ(error.line, 6);
    EXPECT_EQ(error.key, "arm.mass_kg");
  }
}

TEST(Hash, IgnoresTheFileButNotAValue) {
  const Experiment a = load_text(kGoodExperiment);
  const Experiment b = load_text(std::string("# the same, said otherwise\n") + kGoodExperiment);
  EXPECT_EQ(a.hash, b.hash);
  EXPECT_EQ(hash_text(a.hash).size(), 16u);
  EXPECT_NE(
      a.hash,
      load_text(replaced(kGoodExperiment, "mass_kg: 0.15", "mass_kg: 0.15000000000000002")).hash);
}

/// Numbers with all their digits survive printing and reading.
TEST(RoundTrip, RandomExperiments) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0.05, 0.95);
  for (int round = 0; round < 20; ++round) {
    Experiment e = load_text(kGoodExperiment);
    e.name = "a \"quoted\" \\ name: # yes";
    for (auto& segment : e.arm.segments)
      segment = {unit(random), unit(random), unit(random), unit(random)};
    e.arm.base_rotation =
        Eigen::AngleAxisd(unit(random), Eigen::Vector3d::Random().normalized()).matrix();
    for (double& gain : e.control.kp) gain = unit(random);
    e.actuation.segments[1][0].gain_nm_per_bar = unit(random);
    e.plant.actuation = e.actuation;
    e.plant.arm.base_rotation = e.arm.base_rotation;
    e.plant.arm.segments[0].mass_kg = 1e-9 * unit(random);
    SetPointReference hold = *e.reference.phases[0].kind.get_if<SetPointReference>();
    for (double& u : hold.u_rad) u = -unit(random);
    e.reference.phases[0].kind = hold;
    e.plant.initial_u_rad.setConstant(unit(random));
    e.transport.bodies.base_id = -1;
    e.realtime.cpu = 1;
    const Experiment again = load_text(resolved_text(e));
    EXPECT_EQ(resolved_text(e), resolved_text(again));
    EXPECT_EQ(e.name, again.name);
    EXPECT_EQ(e.arm.base_rotation, again.arm.base_rotation);
    EXPECT_EQ(e.control.kp, again.control.kp);
    EXPECT_EQ(e.arm.segments[1].damping_nms_per_rad, again.arm.segments[1].damping_nms_per_rad);
    EXPECT_EQ(e.reference.phases[0].kind.get_if<SetPointReference>()->u_rad,
              again.reference.phases[0].kind.get_if<SetPointReference>()->u_rad);
    EXPECT_EQ(again.transport.bodies.base_id, -1);
    EXPECT_EQ(again.realtime.cpu, 1);
  }
}

TEST(Warnings, TellOfGainsThatTheDelayDoesNotAllowAndOfSlowFrames) {
  std::string text = replaced(kGoodExperiment, "kp_nm_per_rad: [1, [1, 0.5]]",
                              "kp_nm_per_rad: 50\n  delay_s: 0.05\n  valve_lag_s: 0.05");
  EXPECT_FALSE(experiment_warnings(load_text(text)).empty());
  text = replaced(kGoodExperiment, "valves:", "mocap: {rate_hz: 20}\n  valves:");
  const auto warnings = experiment_warnings(load_text(text));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings.back().find("plant.mocap"), std::string::npos);
}

/// One segment without gravity: 0.3 rad against 0.626 N m/rad is 0.1878 N m; a chamber of 0.839 N
/// m/bar in line with the bend gives that at 0.2238 bar.
TEST(Warnings, TellOfPosesOutOfReach) {
  const std::string one = R"(name: one
arm: {segments: 1, length_m: 0.11, mass_kg: 0.15, stiffness_nm_per_rad: 0.626, damping_nms_per_rad: 0.029,
      gravity_mps2: [0, 0, 0]}
actuation: {chambers: {angle_rad: [0, pi/2, pi, 3*pi/2], gain_nm_per_bar: 0.839}, max_pressure_bar: 0.2239}
control: {kp_nm_per_rad: 0.1}
reference: [{kind: set_point, theta_rad: 0.3}]
)";
  EXPECT_TRUE(experiment_warnings(load_text(one)).empty());
  const auto warnings = experiment_warnings(load_text(replaced(one, "0.2239", "0.1119")));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("reference[0]: the chambers give only 49 %"), std::string::npos)
      << warnings[0];
}

}  // namespace
}  // namespace softarm
