// k, beta and gains from step responses of arms that are known.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "identification/parameter_fit.hpp"
#include "integration/processes/process.hpp"
#include "softarm/config/load.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

const fs::path kConfig = fs::path(SOFTARM_SOURCE_DIR) / "config";

/// Within `part` of the truth, and of what the standard errors promise not farther than they say.
void expect_near(const std::vector<Estimated>& found, double truth, double part) {
  for (const Estimated& each : found) {
    EXPECT_NEAR(each.value, truth, part * truth);
    EXPECT_GT(each.standard_error, 0.0);
    EXPECT_LT(each.standard_error, 0.1 * truth);
  }
}

TEST(Identify, FindsThePccPlantsOwnParameters) {
  Experiment experiment = load_experiment(kConfig / "paper_simulation.yaml");
  experiment.plant.kind = PlantKind::pcc;
  for (SegmentParameters& segment : experiment.plant.arm.segments) {
    segment.stiffness_nm_per_rad = 2.7;  // not what the controller believes
    segment.damping_nms_per_rad = 0.35;
  }
  const StepResponse response = record_step_response(experiment, {});
  for (const bool per_segment : {false, true}) {
    const ParameterFit fit = fit_parameters(experiment, response, per_segment);
    ASSERT_EQ(fit.stiffness_nm_per_rad.size(), per_segment ? 4u : 1u);
    expect_near(fit.stiffness_nm_per_rad, 2.7, 0.005);
    expect_near(fit.damping_nms_per_rad, 0.35, 0.02);
    EXPECT_TRUE(fit.gain_factor.empty());
    EXPECT_LT(fit.residual_rms_nm, 0.02 * fit.moment_rms_nm);
  }
}

TEST(Identify, TellsSegmentsApart) {
  Experiment experiment = load_experiment(kConfig / "paper_simulation.yaml");
  experiment.plant.kind = PlantKind::pcc;
  const double stiffness[] = {1.5, 2.0, 2.5, 3.0};
  for (std::size_t i = 0; i < 4; ++i)
    experiment.plant.arm.segments[i].stiffness_nm_per_rad = stiffness[i];
  const ParameterFit fit = fit_parameters(experiment, record_step_response(experiment, {}), true);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(fit.stiffness_nm_per_rad[i].value, stiffness[i], 0.01 * stiffness[i]);
}

TEST(Identify, FindsTheGainOfChambersBehindNoiseAndValves) {
  Experiment experiment = load_experiment(kConfig / "paper_arm.yaml");
  for (auto& chambers : experiment.plant.actuation.segments)
    for (Chamber& chamber : chambers) chamber.gain_nm_per_bar *= 0.8;
  const StepResponse response = record_step_response(experiment, {});
  const ParameterFit fit = fit_parameters(experiment, response, false);
  expect_near(fit.stiffness_nm_per_rad, 0.626, 0.05);
  expect_near(fit.damping_nms_per_rad, 0.029, 0.1);
  expect_near(fit.gain_factor, 0.8, 0.05);
}

TEST(Identify, ReadsSixLinksAsTheSegmentTheyAre) {
  const Experiment experiment = load_experiment(kConfig / "paper_simulation.yaml");
  const ParameterFit fit = fit_parameters(experiment, record_step_response(experiment, {}), false);
  expect_near(fit.stiffness_nm_per_rad, 2.0, 0.06);
  expect_near(fit.damping_nms_per_rad, 0.5, 0.05);
}

TEST(Identify, RefusesWhatTellsNothing) {
  const Experiment experiment = load_experiment(kConfig / "paper_simulation.yaml");
  StepResponse still;
  still.period_s = 0.001;
  still.u_rad.setZero(5000, 8);
  still.input.setZero(5000, 8);
  EXPECT_THROW(fit_parameters(experiment, still, false), std::runtime_error);
  still.u_rad.setZero(20, 8);
  still.input.setZero(20, 8);
  EXPECT_THROW(fit_parameters(experiment, still, false), std::runtime_error);
}

TEST(Identify, WritesAnExperimentWhosePlantIsUnchanged) {
  std::string pattern = (fs::temp_directory_path() / "softarm_identify_XXXXXX").string();
  const fs::path folder = mkdtemp(pattern.data());
  const fs::path config = kConfig / "paper_arm_mismatch.yaml", output = folder / "identified.yaml";
  test::Process process(
      "softarm",
      {"identify", config.string(), "--per-segment", "--hold", "0.7", "--output", output.string()},
      (folder / "printed").string());
  ASSERT_EQ(process.wait(120s), 0) << process.printed();
  EXPECT_NE(process.printed().find("stiffness k, segment 3"), std::string::npos);
  EXPECT_NE(process.printed().find("N m s/rad"), std::string::npos);
  const Experiment before = load_experiment(config), after = load_experiment(output);
  for (std::size_t i = 0; i < 3; ++i) {
    const SegmentParameters &a = before.plant.arm.segments[i], &b = after.plant.arm.segments[i];
    EXPECT_NEAR(a.stiffness_nm_per_rad, b.stiffness_nm_per_rad, 1e-5 * a.stiffness_nm_per_rad);
    EXPECT_NEAR(a.damping_nms_per_rad, b.damping_nms_per_rad, 1e-5 * a.damping_nms_per_rad);
    EXPECT_EQ(a.mass_kg, b.mass_kg);
    EXPECT_NE(before.arm.segments[i].stiffness_nm_per_rad,
              after.arm.segments[i].stiffness_nm_per_rad);
    for (std::size_t j = 0; j < 4; ++j)
      EXPECT_NEAR(before.plant.actuation.segments[i][j].gain_nm_per_bar,
                  after.plant.actuation.segments[i][j].gain_nm_per_bar, 1e-5);
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace softarm
