// Known marker frames, measured with noise, are recovered.
#include "softarm/commissioning/calibration/rest_calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "softarm/config/load.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/statics.hpp"
#include "softarm/transport/settings.hpp"
#include "test_folder.hpp"

namespace softarm {
namespace {

constexpr double kPositionNoise_m = 0.2e-3;
constexpr double kOrientationNoise_rad = 3.5e-3;

Eigen::Isometry3d pose_of(const MarkerFrameSettings& marker_frame) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  if (!marker_frame.rotation_rad.isZero(0.0))
    pose.linear() =
        Eigen::AngleAxisd(marker_frame.rotation_rad.norm(), marker_frame.rotation_rad.normalized())
            .matrix();
  pose.translation() = marker_frame.position_m;
  return pose;
}

MarkerFrameSettings marker_frame(const Eigen::Vector3d& position_m,
                                 const Eigen::Vector3d& rotation_rad) {
  MarkerFrameSettings out;
  out.position_m = position_m;
  out.rotation_rad = rotation_rad;
  return out;
}

class Calibration : public ::testing::Test {
 protected:
  Calibration() : experiment(load_experiment(SOFTARM_SOURCE_DIR "/config/paper_arm.yaml")) {
    truth = experiment.transport.bodies;
    truth.base_marker_frame = marker_frame({0.004, -0.002, 0.01}, {0.01, -0.02, 0.3});
    truth.segment_marker_frames = {marker_frame({0.01, 0, 0.002}, {0.03, 0.01, 0}),
                                   marker_frame({0, 0.02, 0}, {0, 0, 3.1}),
                                   marker_frame({-0.005, 0.003, -0.01}, {0.5, -0.4, 0.2})};
    experiment.transport.bodies.base_marker_frame = truth.base_marker_frame;
  }

  /// Bodies of an arm that rests with S_0 at `base` and bends by `sway_rad` at 1 Hz.
  std::vector<MocapFrame> look(int frames, double noise, double sway_rad = 0.0) {
    ArmParameters arm = experiment.arm;
    arm.base_rotation = base.linear();
    arm.base_position_m = base.translation();
    std::normal_distribution<double> normal;
    const auto vector = [&] {
      return Eigen::Vector3d(noise *
                             Eigen::Vector3d(normal(random), normal(random), normal(random)));
    };
    std::vector<MocapFrame> out;
    for (int k = 0; k < frames; ++k) {
      Eigen::VectorXd u = *rest_shape(experiment.arm, Eigen::VectorXd::Zero(6));
      u[0] += sway_rad * std::sin(2 * M_PI * 0.005 * k);
      std::vector<Eigen::Isometry3d> ends(3);
      forward_kinematics(arm, u, ends);
      ends.insert(ends.begin(), base);
      MocapFrame frame;
      frame.frame_number = k;
      frame.capture_ns = 5'000'000LL * k;
      frame.segments = 3;
      for (std::size_t i = 0; i < 4; ++i) {
        const MarkerFrameSettings& on =
            i == 0 ? truth.base_marker_frame : truth.segment_marker_frames[i - 1];
        Eigen::Isometry3d body = ends[i] * pose_of(on).inverse();
        if (noise > 0.0 && !(i == 0 && truth.base_id < 0)) {
          body.translation() += kPositionNoise_m * vector();
          const Eigen::Vector3d turn = kOrientationNoise_rad * vector();
          body.linear() =
              body.linear() * Eigen::AngleAxisd(turn.norm(), turn.normalized()).matrix();
        }
        Eigen::Quaterniond q(body.linear());
        if (k % 2 == 1) q.coeffs() *= -1.0;  // the same orientation
        frame.body[i] = {body.translation(), q, true};
      }
      out.push_back(frame);
    }
    return out;
  }

  /// Distance and angle between two marker frames.
  static std::pair<double, double> apart(const MarkerFrameSettings& a,
                                         const MarkerFrameSettings& b) {
    const Eigen::Isometry3d between = pose_of(a).inverse() * pose_of(b);
    return {(a.position_m - b.position_m).norm(), Eigen::AngleAxisd(between.linear()).angle()};
  }

  Experiment experiment;
  BodySettings truth;
  Eigen::Isometry3d base = [] {
    Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
    out.linear() = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    out.translation() = Eigen::Vector3d(0.3, -0.2, 1.5);
    return out;
  }();
  std::mt19937 random{11};
};

TEST_F(Calibration, WithoutNoiseTheMarkerFramesAreFoundExactly) {
  const RestCalibration found =
      calibrate_rest(experiment, look(100, 0.0), BaseSource::marker_frame);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto [metres, radians] =
        apart(found.bodies.segment_marker_frames[i], truth.segment_marker_frames[i]);
    EXPECT_LT(metres, 1e-12);
    EXPECT_LT(radians, 1e-7);  // where the arc cosine of AngleAxis stops
    ASSERT_TRUE(found.after[i].valid);
    EXPECT_LT(found.after[i].u_rad.norm(), 1e-9);
    EXPECT_LT(std::abs(found.after[i].length_error_m), 1e-12);
  }
  EXPECT_LT(found.base_tilt_rad, 1e-12);
}

/// 5 standard deviations of the mean of three axes of both bodies; the base's noise in orientation
/// moves the tip by the arm's length.
TEST_F(Calibration, WithNoiseTheyAreFoundWithinWhatItsMeanLeaves) {
  for (const int frames : {200, 1000, 5000}) {
    const RestCalibration found =
        calibrate_rest(experiment, look(frames, 1.0), BaseSource::marker_frame);
    const double root = std::sqrt(frames);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [metres, radians] =
          apart(found.bodies.segment_marker_frames[i], truth.segment_marker_frames[i]);
      const double lever_m = 0.11 * static_cast<double>(i + 1);
      EXPECT_LT(metres, 5 * std::sqrt(2) *
                            std::hypot(kPositionNoise_m, kOrientationNoise_rad * lever_m) / root);
      EXPECT_LT(radians, 5 * std::sqrt(2) * kOrientationNoise_rad / root);
    }
    for (const PoseStatistics& body : found.body) {
      EXPECT_NEAR(body.position_spread_m, kPositionNoise_m, 0.1 * kPositionNoise_m);
      EXPECT_NEAR(body.orientation_spread_rad, kOrientationNoise_rad, 0.1 * kOrientationNoise_rad);
      EXPECT_LT(body.position_error_m, 2 * kPositionNoise_m / root);
      EXPECT_GT(body.position_error_m, 0.4 * kPositionNoise_m / root);
    }
  }
}

TEST_F(Calibration, AMovingArmIsRefusedWithNumbersAndFix) {
  EXPECT_NO_THROW(calibrate_rest(experiment, look(1000, 1.0, 2e-4), BaseSource::marker_frame));
  for (const double noise : {0.0, 1.0}) {
    try {
      calibrate_rest(experiment, look(1000, noise, 0.02), BaseSource::marker_frame);
      FAIL() << "20 mrad at 1 Hz";
    } catch (const std::runtime_error& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find("segment 1 is out of tolerance"), std::string::npos) << text;
      EXPECT_NE(text.find("softarm disarm"), std::string::npos) << text;
      EXPECT_EQ(text.find("base is out of tolerance"), std::string::npos) << text;
    }
  }
}

TEST_F(Calibration, FramesWithoutABodyDoNotCountAndTooFewAreRefused) {
  auto frames = look(200, 0.0);
  for (std::size_t k = 0; k < frames.size(); k += 2) {
    frames[k].body[2].valid = false;
    frames[k].body[1].position_m.x() = std::nan("");
  }
  EXPECT_EQ(calibrate_rest(experiment, frames, BaseSource::marker_frame).body[0].frames, 100);
  for (std::size_t k = 41; k < frames.size(); ++k) frames[k].body[3].valid = false;
  try {
    calibrate_rest(experiment, frames, BaseSource::marker_frame);
    FAIL() << "20 frames";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("got 20 of 200"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("segment 3 was not seen"), std::string::npos);
  }
  EXPECT_THROW(calibrate_rest(experiment, {}, BaseSource::marker_frame), std::runtime_error);
}

/// A tilted base: gravity bends the arm, and calibration must not make that straight.
TEST_F(Calibration, AnArmThatGravityBendsReadsBent) {
  const Eigen::Matrix3d tilted = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()) * base.linear();
  experiment.arm.base_rotation = tilted;
  base.linear() = tilted;
  const Eigen::VectorXd rest = *rest_shape(experiment.arm, Eigen::VectorXd::Zero(6));
  EXPECT_GT(rest.segment<2>(0).norm(), 0.05);
  // At rest the potential of gravity and springs is stationary.
  const auto potential = [&](const Eigen::VectorXd& u) {
    double energy = gravity_potential(experiment.arm, u);
    for (Eigen::Index i = 0; i < 3; ++i)
      energy +=
          0.5 * experiment.arm.segments[0].stiffness_nm_per_rad * u.segment<2>(2 * i).squaredNorm();
    return energy;
  };
  for (Eigen::Index j = 0; j < 6; ++j) {
    const Eigen::VectorXd step = 1e-4 * Eigen::VectorXd::Unit(6, j);
    EXPECT_NEAR((potential(rest + step) - potential(rest - step)) / 2e-4, 0.0, 1e-8);
  }
  const RestCalibration found =
      calibrate_rest(experiment, look(100, 0.0), BaseSource::marker_frame);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT(apart(found.bodies.segment_marker_frames[i], truth.segment_marker_frames[i]).first,
              1e-9);
    EXPECT_LT((found.after[i].u_rad - rest.segment<2>(2 * static_cast<Eigen::Index>(i))).norm(),
              1e-9);
  }
}

TEST_F(Calibration, TheBaseMarkerFramesTiltCanBeTakenFromTheArmsConfiguration) {
  experiment.transport.bodies.base_marker_frame.rotation_rad += Eigen::Vector3d(0.05, 0.0, 0.0);
  const auto frames = look(100, 0.0);
  const RestCalibration trusting = calibrate_rest(experiment, frames, BaseSource::marker_frame);
  EXPECT_NEAR(trusting.base_tilt_rad, 0.05, 0.002);
  EXPECT_EQ(trusting.bodies.base_marker_frame, experiment.transport.bodies.base_marker_frame);
  const RestCalibration levelled = calibrate_rest(experiment, frames, BaseSource::arm);
  const Eigen::Isometry3d read = base * pose_of(truth.base_marker_frame).inverse() *
                                 pose_of(levelled.bodies.base_marker_frame);
  EXPECT_LT((read.linear().col(2) - experiment.arm.base_rotation.col(2)).norm(), 1e-9);
  EXPECT_LT((read.translation() - base.translation()).norm(), 1e-9);
}

TEST_F(Calibration, AFixedBaseHasNoMarkerFrame) {
  experiment.transport.bodies.base_id = truth.base_id = -1;
  experiment.estimation.base_is_fixed = true;
  truth.base_marker_frame = {};
  base.translation().setZero();  // as in arm.base
  const RestCalibration found =
      calibrate_rest(experiment, look(100, 1.0), BaseSource::marker_frame);
  EXPECT_EQ(found.body[0].frames, 0);
  EXPECT_LT(apart(found.bodies.segment_marker_frames[0], truth.segment_marker_frames[0]).first,
            1e-3);
}

TEST_F(Calibration, WhatIsWrittenLoads) {
  const RestCalibration found =
      calibrate_rest(experiment, look(100, 0.0), BaseSource::marker_frame);
  const TestFolder folder;
  const auto file =
      folder.write("calibrated.yaml",
                   calibrated_yaml(found, "a note", SOFTARM_SOURCE_DIR "/config/paper_arm.yaml"));
  const BodySettings loaded = load_experiment(file).transport.bodies;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto [metres, radians] =
        apart(loaded.segment_marker_frames[i], truth.segment_marker_frames[i]);
    EXPECT_LT(metres, 2e-9);
    EXPECT_LT(radians, 1e-7);
  }
  EXPECT_LT(apart(loaded.base_marker_frame, truth.base_marker_frame).first, 2e-9);
  EXPECT_NE(calibration_text(experiment, found).find("not determined by an arm at rest"),
            std::string::npos);
}

}  // namespace
}  // namespace softarm
