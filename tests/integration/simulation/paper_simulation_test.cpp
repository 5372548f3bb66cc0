// Section VI: an arm of links, a controller that models constant curvature, a path of the tip.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "softarm/config/load.hpp"
#include "softarm/recording/shape_log.hpp"
#include "softarm/simulation/lock_step.hpp"

namespace softarm {
namespace {

Experiment configured(const char* name) {
  return load_experiment(std::filesystem::path(SOFTARM_SOURCE_DIR) / "config" / name);
}

/// Of the tip, from 5 s after ACTIVE on; and when it was last a centimetre or more away.
struct TipTracking {
  double rms_m = 0.0;
  double last_far_s = 0.0;
  double active_s = 0.0;
};

template <class Look>
TipTracking track(const Experiment& experiment, double duration_s, Look&& look) {
  LockStep lock_step(experiment, experiment.plant);
  LogRow row;
  TipTracking result;
  double squared = 0.0;
  int counted = 0;
  const double period_s = 1.0 / experiment.rate_hz;
  for (double t_s = 0.0; t_s < duration_s; t_s += period_s) {
    lock_step.step(row);
    look(row, lock_step);
    if (row.mode != Mode::active) continue;
    result.active_s += period_s;
    EXPECT_TRUE(row.tip_is_asked);
    const double error_m = (*row.tip - *row.tip_reference).norm();
    if (error_m > 0.01) result.last_far_s = result.active_s;
    if (result.active_s < 5.0) continue;
    squared += error_m * error_m;
    ++counted;
  }
  result.rms_m = std::sqrt(squared / std::max(counted, 1));
  return result;
}

TipTracking track(const Experiment& experiment, double duration_s) {
  return track(experiment, duration_s, [](const LogRow&, const LockStep&) {});
}

TEST(PaperSimulation, IsThatOfSectionVI) {
  const Experiment e = configured("paper_simulation.yaml");
  ASSERT_EQ(e.arm.size(), 4);
  const auto* links = e.plant.kind.get_if<LinkSettings>();
  ASSERT_NE(links, nullptr);
  EXPECT_EQ(links->links_per_segment, 6);
  EXPECT_EQ(links->joint_stiffness_nm_per_rad, 12.0);
  EXPECT_EQ(links->joint_damping_nms_per_rad, 3.0);
  double length_m = 0.0, mass_kg = 0.0;
  for (const SegmentParameters& segment : e.plant.arm.segments) {
    length_m += segment.length_m;
    mass_kg += segment.mass_kg;
  }
  EXPECT_DOUBLE_EQ(length_m, 1.0);
  EXPECT_DOUBLE_EQ(mass_kg, 1.0);
  EXPECT_EQ(e.plant.initial_u_rad, SegmentVector::Zero(8));
  EXPECT_EQ(e.plant.valves.lag_s, 0.0);
  EXPECT_EQ(e.plant.mocap.position_noise_m, 0.0);
  EXPECT_EQ(e.plant.mocap.latency_s, 0.0);
}

TEST(PaperSimulation, TipFollowsTheLemniscateWithIdealSensing) {
  const TipTracking tracking = track(configured("paper_simulation.yaml"), 10.0);
  EXPECT_GT(tracking.active_s, 9.9);
  EXPECT_LE(tracking.rms_m, 1.2e-3);
  EXPECT_LE(tracking.last_far_s, 5.0);
}

TEST(PaperSimulation, TipFollowsTheLemniscateBehindValvesAndNoise) {
  for (const std::uint64_t seed : {1u, 2u}) {
    Experiment experiment = configured("paper_simulation_noisy.yaml");
    experiment.plant.seed = seed;
    const TipTracking tracking = track(experiment, 10.0);
    EXPECT_GT(tracking.active_s, 9.5) << seed;
    EXPECT_LE(tracking.rms_m, 3e-3) << seed;
    EXPECT_LE(tracking.last_far_s, 5.0) << seed;
  }
}

TEST(PaperSimulation, MatricesOfPlantAndControllerMayDiffer) {
  Experiment experiment = configured("paper_simulation_noisy.yaml");
  experiment.arm.actuation = ActuationModel::chamber;
  experiment.plant.arm.actuation = ActuationModel::couple;
  EXPECT_LE(track(experiment, 8.0).rms_m, 3e-3);
}

/// The paper's lemniscate with the simple plant: what differs from section VI is only the plant.
Experiment on_the_model(Experiment experiment) {
  experiment.plant.kind = PccSettings{};
  return experiment;
}

TEST(PaperSimulation, AHoldFreezesTheReferenceAndItStartsAgainWhereTheArmIs) {
  Experiment experiment = on_the_model(configured("paper_simulation_noisy.yaml"));
  experiment.plant.mocap.dropout_probability = 0.25;
  experiment.safety.good_frames = 5;
  Mode before = Mode::init;
  int returns = 0;
  PressureVector held;
  const TipTracking tracking = track(experiment, 15.0, [&](const LogRow& row, const LockStep&) {
    if (row.mode == Mode::active && before == Mode::hold) {
      ++returns;
      EXPECT_LT((row.reference - row.u).norm(), 1e-9);
    }
    if (row.mode == Mode::hold && before == Mode::hold) {
      EXPECT_EQ(row.commanded, held);
      EXPECT_FALSE(row.tip_reference);
    }
    held = row.commanded;
    before = row.mode;
  });
  EXPECT_GT(returns, 3);
  EXPECT_GT(tracking.active_s, 5.0);
}

TEST(PaperSimulation, OnTheModelItselfOnlyThePathsTimeLawIsLeft) {
  const Experiment experiment = on_the_model(configured("paper_simulation.yaml"));
  EXPECT_LE(track(experiment, 8.0).rms_m, 1e-4);
}

TEST(ShapeLog, PointsEndWhereThePlantEnds) {
  for (const PlantKind& kind : {PlantKind(PccSettings{}), PlantKind(RefinedSettings{.pieces = 3}),
                                PlantKind(LinkSettings{})}) {
    Experiment experiment = configured("paper_simulation.yaml");
    experiment.plant.kind = kind;
    experiment.plant.initial_u_rad << 0.3, -0.2, 0.9, 0.4, -0.5, 0.6, 1.2, 0.1;
    const ArmPlant plant(experiment.plant);
    std::vector<Eigen::Isometry3d> ends(4);
    plant.segment_ends(ends);
    const PlantShape shape = kind.make(experiment.plant)->shape(plant.coordinates());
    const auto& points = shape.points_m;
    const std::size_t per_segment = (points.size() - 1) / 4;
    ASSERT_EQ(points.size(), 4 * per_segment + 1);
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_LT((points[(i + 1) * per_segment] - ends[i].translation()).norm(), 1e-12);
    // Where every part bends alike, the parts' bends are shares of the segment's.
    const Eigen::VectorXd& bends = shape.bend_rad;
    const auto parts = bends.size() / 8;
    for (Eigen::Index k = 0; k < 8; k += 2) {
      const Eigen::Vector2d part = bends.segment<2>(parts * k);
      const Eigen::Vector2d whole = experiment.plant.initial_u_rad.segment<2>(k);
      EXPECT_LT((static_cast<double>(parts) * part - whole).norm(), 0.02 * whole.norm());
    }
  }
}

}  // namespace
}  // namespace softarm
