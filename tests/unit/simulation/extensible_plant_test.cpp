// The simulated arm whose segments stretch: where it rests, what its chambers do to it, segments of it
// that do not stretch, and what it refuses. Its energies: numerics, HardCases.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "paper_arm.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/statics.hpp"
#include "softarm/simulation/arm_plant.hpp"

namespace softarm {
namespace {

std::vector<double> none(int segments) {
  return std::vector<double>(static_cast<std::size_t>(4 * segments), 0.0);
}

TEST(ExtensiblePlant, HangsAsLongAsItsWeightMakesIt) {
  for (const MassModel mass : {MassModel::point, MassModel::distributed}) {
    const PlantSettings settings = stretching(paper_arm(mass));
    ArmPlant plant(settings);
    plant.advance(2.0, none(3));
    const Eigen::VectorXd x = plant.coordinates();
    ASSERT_EQ(x.size(), 9);
    double beyond = 0.0;
    for (int i = 2; i >= 0; --i) {
      const SegmentParameters& segment = settings.arm.segments[static_cast<std::size_t>(i)];
      const double e = 9.81 * (0.5 * segment.mass_kg + beyond) / segment.axial_stiffness_n_per_m;
      EXPECT_NEAR(x[3 * i + 2], e, 1e-9) << "segment " << i + 1;
      EXPECT_NEAR(x.segment<2>(3 * i).norm(), 0.0, 1e-12);
      beyond += segment.mass_kg;
    }
    const auto rest = rest_shape(settings.arm, Eigen::VectorXd::Zero(9));
    ASSERT_TRUE(rest.has_value());
    EXPECT_LE((*rest - x).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(ExtensiblePlant, PartsHangAndStretchTogetherAsTheSegmentDoes) {
  // The sum of what the parts carry is what the segment carries, for any number of them.
  PlantSettings settings = stretching(paper_arm());
  settings.arm.segments[1].constant_length = true;
  ArmPlant pcc(settings);
  pcc.advance(1.0, none(3));
  for (const MakeKind make : {kRefined, kLinks}) {
    settings.kind = make(5);
    ArmPlant parts(settings);
    parts.advance(1.0, none(3));
    ASSERT_EQ(parts.dof(), 45);
    EXPECT_LE((parts.elongation_m() - pcc.elongation_m()).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_EQ(parts.elongation_m()[1], 0.0);
    EXPECT_NEAR((parts.tip_m() - pcc.tip_m()).norm(), 0.0, 1e-9);
  }
}

TEST(ExtensiblePlant, UniformForcesStretchPartsAlike) {
  // Without weight the model is exact: pieces are arcs of one circle, links chords near it.
  PlantSettings settings = stretching(paper_arm(MassModel::distributed, 1));
  settings.arm.gravity_mps2.setZero();
  const std::vector<double> pressures = {0.6, 0.0, 0.0, 0.4};
  const auto rest = [&](MakeKind make, int parts) {
    settings.kind = make(parts);
    ArmPlant plant(settings);
    plant.advance(5.0, pressures);
    return plant;
  };
  const ArmPlant pcc = rest(kPcc, 1), refined = rest(kRefined, 4);
  EXPECT_GT(pcc.elongation_m().minCoeff(), 1e-3);
  EXPECT_LE((refined.u_rad() - pcc.u_rad()).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LE((refined.elongation_m() - pcc.elongation_m()).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LE((refined.tip_m() - pcc.tip_m()).norm(), 1e-6);
  const ArmPlant six = rest(kLinks, 6), twelve = rest(kLinks, 12);
  EXPECT_LE((six.elongation_m() - pcc.elongation_m()).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_NEAR((six.tip_m() - pcc.tip_m()).norm() / (twelve.tip_m() - pcc.tip_m()).norm(), 2.0, 0.1);
}

TEST(ExtensiblePlant, LinksMoveMoreAndMoreAsPiecesDo) {
  const auto tip = [](MakeKind make, int parts) {
    PlantSettings settings = stretching(paper_arm(MassModel::distributed, 1));
    settings.kind = make(parts);
    settings.initial_u_rad = Eigen::Vector2d(0.6, 0.2);
    ArmPlant plant(settings);
    plant.advance(0.1, std::vector<double>{0.0, 0.8, 0.0, 0.0});
    return plant.tip_m();
  };
  const Eigen::Vector3d finest = tip(kRefined, 24);
  const double of_6 = (tip(kLinks, 6) - finest).norm(), of_12 = (tip(kLinks, 12) - finest).norm();
  EXPECT_NEAR(of_6 / of_12, 2.0, 0.15);
}

TEST(ExtensiblePlant, ChamberStretchesAsItBends) {
  // Without gravity k theta = g p and k_a e = g p / r.
  PlantSettings settings = stretching(paper_arm(MassModel::distributed, 1));
  settings.arm.gravity_mps2.setZero();
  for (Chamber& chamber : settings.actuation.segments[0]) chamber.offset_m = 0.01;
  ArmPlant plant(settings);
  plant.advance(3.0, std::vector<double>{0.5, 0.0, 0.0, 0.0});
  const double moment = 0.5 * Chamber{}.gain_nm_per_bar;
  const SegmentParameters& segment = settings.arm.segments[0];
  const Eigen::VectorXd x = plant.coordinates();
  EXPECT_NEAR(x[0], -moment / segment.stiffness_nm_per_rad, 1e-9);
  EXPECT_NEAR(x[1], 0.0, 1e-12);
  EXPECT_NEAR(x[2], moment / 0.01 / segment.axial_stiffness_n_per_m, 1e-9);

  // All four alike: straight, four times the force.
  plant.advance(6.0, std::vector<double>{0.5, 0.5, 0.5, 0.5});
  EXPECT_NEAR(plant.u_rad().norm(), 0.0, 1e-8);
  EXPECT_NEAR(plant.coordinates()[2], 4.0 * x[2], 1e-9);
  EXPECT_NEAR(-plant.tip_m().z(), segment.length_m + 4.0 * x[2], 1e-9);
}

TEST(ExtensiblePlant, FramesAreThoseOfTheLongerArm) {
  const PlantSettings settings = stretching(paper_arm());
  ArmPlant plant(settings);
  for (int k = 0; k < 200; ++k) plant.advance(1e-3 * (k + 1), drive_bar(0.5 + 1e-3 * k));
  const Eigen::VectorXd x = plant.coordinates();
  std::vector<Eigen::Isometry3d> ends(3), want(3);
  plant.segment_ends(ends);
  forward_kinematics(settings.arm, x, want);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(ends[i].isApprox(want[i], 1e-14));
  EXPECT_GT(x[2], 1e-3);
  EXPECT_EQ(plant.u_rad().size(), 6);
  EXPECT_EQ(plant.u_rad()[2], x[3]);
}

TEST(ExtensiblePlant, MethodsAgree) {
  const auto run = [](IntegratorMethod method) {
    PlantSettings settings = stretching(paper_arm());
    settings.method = method;
    settings.relative_tolerance = 1e-9;
    settings.absolute_tolerance = 1e-11;
    settings.valves.lag_s = 0.02;
    ArmPlant plant(settings);
    for (int k = 0; k < 30; ++k) plant.advance(0.01 * (k + 1), drive_bar(0.5 + 0.01 * k));
    return plant.coordinates();
  };
  const Eigen::VectorXd want = run(IntegratorMethod::erk);
  for (const IntegratorMethod method : {IntegratorMethod::sdirk2, IntegratorMethod::cash4,
                                        IntegratorMethod::sdirk4, IntegratorMethod::cvode_bdf}) {
    EXPECT_LE((run(method) - want).cwiseAbs().maxCoeff(), 1e-6) << static_cast<int>(method);
  }
}

TEST(ExtensiblePlant, SegmentsOfConstantLengthDoNotStretch) {
  PlantSettings all = stretching(paper_arm()), mixed = all, none_stretches = paper_arm();
  for (SegmentParameters& segment : all.arm.segments) segment.constant_length = true;
  mixed.arm.segments[1].constant_length = true;
  for (PlantSettings* settings : {&all, &mixed, &none_stretches}) {
    settings->payload_kg = {0.0, 0.05, 0.0};
  }
  ArmPlant held(all), some(mixed), constant(none_stretches);
  for (int k = 0; k < 300; ++k) {
    for (ArmPlant* plant : {&held, &some, &constant}) {
      plant->advance(1e-3 * (k + 1), drive_bar(0.5 + 1e-3 * k));
    }
  }
  EXPECT_LE((held.u_rad() - constant.u_rad()).cwiseAbs().maxCoeff(), 1e-6);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(held.coordinates()[3 * i + 2], 0.0);
  EXPECT_EQ(some.coordinates()[5], 0.0);
  EXPECT_GT(some.coordinates()[2], 1e-3);
  EXPECT_GT((some.u_rad() - constant.u_rad()).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(ExtensiblePlant, SegmentCrushedToNothingIsAnError) {
  for (const MakeKind make : {kPcc, kRefined, kLinks}) {
    PlantSettings settings = stretching(paper_arm(MassModel::distributed, 1));
    settings.kind = make(2);
    settings.arm.segments[0].axial_stiffness_n_per_m = 10.0;
    settings.tip_force_n = {0.0, 0.0, 100.0};  // upwards: towards the base
    ArmPlant plant(settings);
    EXPECT_THROW(plant.advance(5.0, none(1)), PlantError);
    EXPECT_TRUE(plant.coordinates().allFinite());
    EXPECT_GT(settings.arm.segments[0].length_m + plant.elongation_m()[0], 0.0);
  }
}

TEST(ExtensiblePlant, RefusesWhatItCannotDo) {
  PlantSettings too_many = stretching(paper_arm());
  too_many.kind = kRefined(29);
  EXPECT_THROW(ArmPlant{too_many}, std::invalid_argument);
  const auto refused = [](auto change) {
    PlantSettings settings = stretching(paper_arm());
    change(settings);
    EXPECT_THROW(ArmPlant{settings}, std::invalid_argument);
  };
  refused([](auto& s) { s.arm.actuation = ActuationModel::couple; });
  refused([](auto& s) { s.actuation.segments[1][2].offset_m = 0.0; });
  refused([](auto& s) { s.arm.segments[1].axial_stiffness_n_per_m = -1.0; });
  refused([](auto& s) { s.arm.segments[1].axial_damping_ns_per_m = NAN; });
}

}  // namespace
}  // namespace softarm
