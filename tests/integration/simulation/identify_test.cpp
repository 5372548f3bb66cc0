// k, beta and gains from step responses of arms that are known.
#include "softarm/commissioning/identification/identify.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "integration/processes/process.hpp"
#include "softarm/commissioning/identification/coverage.hpp"
#include "softarm/commissioning/identification/linear_fit.hpp"
#include "softarm/commissioning/identification/misfit.hpp"
#include "softarm/config/load.hpp"
#include "test_folder.hpp"

namespace softarm {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

const fs::path kConfig = fs::path(SOFTARM_SOURCE_DIR) / "config";

/// The identified values of the simulated arm's steps by least squares alone, in units of the set.
struct Linear {
  ParameterSet set;
  LinearFit fit;
  double value(Eigen::Index i) const { return fit.x[i] * set[i].scale; }
};

Linear linear(const Experiment& experiment, bool per_segment) {
  FitChoice choice;
  choice.per_segment = per_segment;
  choice.lag = choice.delay = false;
  const ParameterSet set(configured(experiment), experiment.actuation.kind, choice);
  return {set, fit_linear(set, record_step_response(experiment, {}), set.configured(), 0.2)};
}

TEST(Identify, LeastSquaresFindThePccPlantsOwnParameters) {
  Experiment experiment = load_experiment(kConfig / "paper_simulation.yaml");
  experiment.plant.kind = PccSettings{};
  for (SegmentParameters& segment : experiment.plant.arm.segments) {
    segment.stiffness_nm_per_rad = 2.7;  // not what the controller is configured with
    segment.damping_nms_per_rad = 0.35;
  }
  const Linear found = linear(experiment, false);
  ASSERT_EQ(found.set.size(), 2);
  EXPECT_NEAR(found.value(0), 2.7, 0.005 * 2.7);
  EXPECT_NEAR(found.value(1), 0.35, 0.02 * 0.35);
  EXPECT_LT(found.fit.residual_rms_nm, 0.02 * found.fit.moment_rms_nm);
}

TEST(Identify, LeastSquaresTellSegmentsApart) {
  Experiment experiment = load_experiment(kConfig / "paper_simulation.yaml");
  experiment.plant.kind = PccSettings{};
  const double stiffness[] = {1.5, 2.0, 2.5, 3.0};
  for (std::size_t i = 0; i < 4; ++i)
    experiment.plant.arm.segments[i].stiffness_nm_per_rad = stiffness[i];
  const Linear found = linear(experiment, true);
  for (Eigen::Index i = 0; i < 4; ++i)
    EXPECT_NEAR(found.value(i), stiffness[i], 0.01 * stiffness[i]) << found.set[i].name;
}

TEST(Identify, ReadsSixLinksAsTheSegmentTheyAre) {
  const Experiment experiment = load_experiment(kConfig / "paper_simulation.yaml");
  const Linear found = linear(experiment, false);
  EXPECT_NEAR(found.value(0), 2.0, 0.06 * 2.0);
  EXPECT_NEAR(found.value(1), 0.5, 0.05 * 0.5);
}

TEST(Identify, RefusesUninformativeMotion) {
  const Experiment experiment = load_experiment(kConfig / "paper_simulation.yaml");
  FitChoice choice;
  choice.lag = choice.delay = false;
  const ParameterSet set(configured(experiment), experiment.actuation.kind, choice);
  MotionRecord still;
  still.time_s = Eigen::VectorXd::LinSpaced(5000, 0.0, 5.0);
  still.u_rad.setZero(5000, 8);
  still.input.time_s = still.time_s;
  still.input.value.setZero(5000, 8);
  EXPECT_THROW(fit_linear(set, still, set.configured(), 0.2), std::runtime_error);
  EXPECT_THROW(fit_linear(set, still.part(0.0, 0.02, 0.0), set.configured(), 0.2),
               std::runtime_error);
}

TEST(Identify, RecoversThePapersArmWithinTwoPercent) {
  // Noise, lag and latency as config/paper_arm.yaml has them; the truth within 10 % of it.
  const Experiment experiment = load_experiment(kConfig / "paper_arm.yaml");
  StepPlan plan;
  plan.hold_s = 1.0;
  CoverageStudy study;
  study.seeds = 3;
  study.threads = 2;
  const CoverageTable table = study_coverage(experiment, plan, {}, study, {}, {});
  EXPECT_EQ(table.seeds, 3);
  EXPECT_EQ(table.failed, 0);
  ASSERT_EQ(table.rows.size(), 2u + 12u + 2u);
  int covered = 0;
  for (const CoverageRow& row : table.rows) {
    covered += row.covered;
    if (row.name == "lag" || row.name == "delay") {
      EXPECT_LT(row.worst, row.name == "lag" ? 0.1 : 0.002) << row.name;
      continue;
    }
    EXPECT_LT(row.worst, 0.02) << row.name;
    EXPECT_LT(row.half_width, 0.02) << row.name;
  }
  EXPECT_GE(covered, 40);  // 45.6 of 48 expected
}

TEST(Identify, WritesAnExperimentWhosePlantIsUnchanged) {
  const TestFolder folder;
  const fs::path config = kConfig / "paper_arm_mismatch.yaml", output = folder / "identified.yaml";
  test::Process process(
      "softarm",
      {"identify", config.string(), "--per-segment", "--hold", "0.5", "--output", output.string()},
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
}

/// What identification finds from steps of the simulated arm, with intervals as it would print them.
struct Judged {
  ParameterSet set;
  Refinement fit;
  Misfit misfit;
  double half_width(const std::string& name) const { return fit.half_width(find(name)); }
  double value(const std::string& name) const { return fit.x[find(name)] * set[find(name)].scale; }
  Eigen::Index find(const std::string& name) const {
    for (Eigen::Index i = 0; i < set.size(); ++i)
      if (set[i].name == name) return i;
    throw std::out_of_range(name);
  }
};

Judged judged(const Experiment& experiment) {
  const FitChoice choice;
  StepPlan plan;
  plan.hold_s = 0.5;
  const MotionRecord record = record_step_response(experiment, plan);
  const ArmHypothesis start = configured(experiment);
  Judged out{ParameterSet(start, experiment.actuation.kind, choice), {}, {}};
  IdentifyOptions options;
  options.refinement.threads = 2;
  out.fit = identify(out.set, record, options);
  out.misfit = judge_misfit(start, experiment.actuation.kind, choice, std::span(&record, 1),
                            out.fit, options.refinement);
  widen(out.misfit, out.fit);
  return out;
}

TEST(SlowIdentify, APayloadThatIsNotInTheFileIsNamedAndIntervalsHoldTheTruth) {
  Experiment experiment = load_experiment(kConfig / "paper_arm.yaml");
  const Judged right = judged(experiment);
  EXPECT_FALSE(right.misfit.significant) << right.misfit.ratio << " " << right.misfit.slow_ratio;
  EXPECT_LT(right.half_width("stiffness k"), 0.03);

  experiment.plant.payload_kg = {0.0, 0.0, 0.05};
  const Judged loaded = judged(experiment);
  EXPECT_TRUE(loaded.misfit.significant);
  ASSERT_FALSE(loaded.misfit.causes.empty());
  EXPECT_EQ(loaded.misfit.causes.front().name, "load at the tip");
  EXPECT_NEAR(loaded.misfit.causes.front().value, 0.05, 0.005);
  const auto holds = [&](const std::string& name, double truth) {
    const double scale = loaded.set[loaded.find(name)].scale;
    EXPECT_LT(std::abs(loaded.value(name) - truth), loaded.half_width(name) * scale) << name;
  };
  holds("stiffness k", experiment.plant.arm.segments[0].stiffness_nm_per_rad);
  for (int i = 1; i <= 3; ++i)
    for (int j = 1; j <= 4; ++j) {
      const Chamber& chamber =
          experiment.plant.actuation
              .segments[static_cast<std::size_t>(i - 1)][static_cast<std::size_t>(j - 1)];
      holds("gain, segment " + std::to_string(i) + " chamber " + std::to_string(j),
            chamber.gain_nm_per_bar);
    }
}

}  // namespace
}  // namespace softarm
