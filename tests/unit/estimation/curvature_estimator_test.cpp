#include "softarm/estimation/curvature_estimator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "frames.hpp"

namespace softarm {
namespace {

using std::numbers::pi;
using test::arc_end;
using test::arm_of;
using test::body_at;
using test::frame_of;

CurvatureEstimator estimator_of(CurvatureMethod method, const ArmParameters& arm,
                                std::vector<BodyNoise> noise = {}) {
  EstimationSettings settings;
  settings.method = method;
  if (noise.empty()) noise = test::fixed_base_noise(settings, arm.size());
  return CurvatureEstimator(settings, arm, noise);
}

Eigen::Vector2d bend(double phi, double theta) {
  return theta * Eigen::Vector2d(std::cos(phi), std::sin(phi));
}

TEST(CurvatureEstimator, FindsAnyBendUpToAFullTurn) {
  const ArmParameters arm = arm_of(1);
  for (const CurvatureMethod method : {CurvatureMethod::pose, CurvatureMethod::orientation}) {
    const CurvatureEstimator estimator = estimator_of(method, arm);
    for (const double theta : {0.0, 1e-300, 1e-160, 1e-12, 1e-8, 9.9e-4, 1.1e-3, 0.1, 0.4, 1.5, 3.0,
                               3.14159, 3.15, 4.0, 5.0, 6.0, 6.2}) {
      for (int k = -12; k <= 12; ++k) {
        const double phi = k * pi / 12.0;
        CurvatureEstimate estimate;
        estimator.estimate(frame_of(arm, bend(phi, theta), test::some_base()), estimate);
        ASSERT_TRUE(estimate.valid[0]);
        // Near 2 pi a rounding error of the pose turns phi by as much over sin(theta / 2).
        const double tolerance = 2e-15 * (1.0 + 1.0 / std::max(0.01, std::cos(theta / 4.0)));
        EXPECT_NEAR((estimate.u_rad - bend(phi, theta)).norm(), 0.0, 10.0 * tolerance)
            << "theta " << theta << " phi " << phi;
        EXPECT_NEAR(estimate.twist_rad[0], 0.0, 1e-14);
        EXPECT_NEAR(estimate.length_error_m[0], 0.0, 1e-14);
      }
    }
  }
}

// With the lower frame given exactly, u keeps its relative accuracy however small it is.
TEST(CurvatureEstimator, IsSmoothAndRelativelyExactAtZero) {
  const ArmParameters arm = arm_of(1);
  const CurvatureEstimator estimator = estimator_of(CurvatureMethod::pose, arm);
  for (double theta = 1e-3; theta > 1e-290; theta *= 0.37) {
    BodyPose lower = body_at(arc_end(0.11, 0.7, theta));
    lower.orientation =
        Eigen::Quaterniond(std::cos(theta / 2), -std::sin(theta / 2) * std::sin(0.7),
                           std::sin(theta / 2) * std::cos(0.7), 0.0);
    const SegmentCurvature one =
        estimator.segment(0, body_at(Eigen::Isometry3d::Identity()), lower);
    EXPECT_NEAR((one.u_rad - bend(0.7, theta)).norm() / theta, 0.0, 3e-15) << theta;
  }
}

TEST(CurvatureEstimator, EverySegmentHasItsOwnFrame) {
  const ArmParameters arm = arm_of(5);
  Eigen::VectorXd u(10);
  u << 0.4, -0.1, -2.0, 1.0, 0.0, 0.0, 0.3, 3.0, -1e-9, 4.5;
  MocapFrame frame = frame_of(arm, u, test::some_base());
  // q and -q are the same orientation, and a norm within tolerance is the validator's business.
  frame.body[2].orientation.coeffs() *= -1.0;
  frame.body[4].orientation.coeffs() *= 1.01;
  CurvatureEstimate estimate;
  estimator_of(CurvatureMethod::pose, arm).estimate(frame, estimate);
  EXPECT_EQ(estimate.segments, 5);
  EXPECT_LT((estimate.u_rad - u).norm(), 1e-13);
}

TEST(CurvatureEstimator, AnUnseenBodyHidesTheSegmentsItBounds) {
  const ArmParameters arm = arm_of(3);
  MocapFrame frame = frame_of(arm, Eigen::VectorXd::Constant(6, 0.3));
  frame.body[1].valid = false;
  frame.body[1].position_m.setConstant(std::numeric_limits<double>::quiet_NaN());
  CurvatureEstimate estimate;
  const CurvatureEstimator estimator = estimator_of(CurvatureMethod::pose, arm);
  estimator.estimate(frame, estimate);
  EXPECT_FALSE(estimate.valid[0]);
  EXPECT_FALSE(estimate.valid[1]);
  EXPECT_TRUE(estimate.valid[2]);
  EXPECT_TRUE(estimate.u_rad.head<4>().isZero(0.0));
  EXPECT_NEAR(estimate.u_rad[4], 0.3, 1e-14);

  frame.segments = 2;
  estimator.estimate(frame, estimate);
  EXPECT_FALSE(estimate.valid[2]);
}

TEST(CurvatureEstimator, WithoutPositionsOrientationReachesHalfATurn) {
  const ArmParameters arm = arm_of(1);
  const CurvatureEstimator estimator = estimator_of(CurvatureMethod::orientation, arm);
  MocapFrame frame = frame_of(arm, bend(2.0, 3.1));
  for (BodyPose& body : frame.body) body.position_m.setZero();
  CurvatureEstimate estimate;
  estimator.estimate(frame, estimate);
  EXPECT_LT((estimate.u_rad - bend(2.0, 3.1)).norm(), 1e-14);
}

// Golden by hand: what (20) makes of poses inside and outside its domain.
TEST(CurvatureEstimator, PrintedIsRightOnlyInItsDomain) {
  const ArmParameters arm = arm_of(1);
  const CurvatureEstimator estimator = estimator_of(CurvatureMethod::printed, arm);
  const auto u = [&](double phi, double theta) {
    CurvatureEstimate estimate;
    estimator.estimate(frame_of(arm, bend(phi, theta)), estimate);
    return Eigen::Vector2d(estimate.u_rad);
  };
  for (const double phi : {-1.5, -0.3, 0.0, 1.0, 1.5}) {
    EXPECT_LT((u(phi, 0.4) - bend(phi, 0.4)).norm(), 1e-14) << phi;
    // Beyond a quarter turn arcsin folds.
    EXPECT_LT((u(phi, 2.0) - bend(phi, pi - 2.0)).norm(), 1e-14) << phi;
  }
  // arctan loses the other half of the plane.
  EXPECT_LT((u(3.0, 0.4) - bend(3.0 - pi, 0.4)).norm(), 1e-14);
  EXPECT_TRUE(u(0.0, 0.0).isZero(0.0));
}

TEST(CurvatureEstimator, ResidualsTellTwistAndLength) {
  const ArmParameters arm = arm_of(1);
  const CurvatureEstimator estimator = estimator_of(CurvatureMethod::pose, arm);
  const Eigen::Isometry3d end = arc_end(0.11, 0.9, 0.0);
  for (const double twist : {-1.0, 0.02, 2.5}) {
    Eigen::Isometry3d twisted = end;
    twisted.rotate(Eigen::AngleAxisd(twist, Eigen::Vector3d::UnitZ()));
    BodyPose body = body_at(twisted);
    for (const double sign : {1.0, -1.0}) {
      body.orientation.coeffs() *= sign;
      EXPECT_NEAR(estimator.segment(0, body_at(Eigen::Isometry3d::Identity()), body).twist_rad,
                  twist, 1e-14);
    }
  }
  MocapFrame frame = frame_of(arm_of(1, 0.115), bend(1.0, 1.3));
  CurvatureEstimate estimate;
  estimator.estimate(frame, estimate);
  EXPECT_NEAR(estimate.length_error_m[0], 0.005 * std::sin(0.65) / 0.65, 1e-15);
}

TEST(CurvatureEstimator, LengthIsMeasuredByTheChord) {
  const ArmParameters configured = arm_of(2);
  ArmParameters stretched = configured;
  stretched.segments[0].length_m = 0.137;
  stretched.segments[1].length_m = 0.081;
  for (const CurvatureMethod method : {CurvatureMethod::pose, CurvatureMethod::orientation}) {
    const CurvatureEstimator estimator = estimator_of(method, configured);
    for (const double theta : {0.0, 1e-9, 1e-3, 0.4, 1.5, 3.0, 3.15, 4.7, 6.0, 6.2}) {
      Eigen::VectorXd u(4);
      u << bend(0.7, theta), bend(-2.0, 0.5 * theta);
      CurvatureEstimate estimate;
      estimator.estimate(frame_of(stretched, u, test::some_base()), estimate);
      ASSERT_TRUE(estimate.valid[0] && estimate.valid[1]);
      // Near 2 pi the chord vanishes, and with it what it knows of the length.
      const double c1 = theta > 0.0 ? std::sin(theta / 2) / (theta / 2) : 1.0;
      EXPECT_NEAR(estimate.length_m[0], 0.137, 4e-15 / (c1 * c1)) << theta;
      EXPECT_NEAR(estimate.length_m[1], 0.081, 4e-15) << theta;
      EXPECT_NEAR((estimate.u_rad.head<2>() - bend(0.7, theta)).norm(), 0.0, 1e-13);
      EXPECT_TRUE(std::isfinite(estimate.length_variance_m2[0]));
    }
  }
  // Inertial sensors see no length.
  MocapFrame frame = frame_of(stretched, Eigen::VectorXd::Constant(4, 0.3));
  for (BodyPose& body : frame.body) body.position_m.setZero();
  CurvatureEstimate estimate;
  estimator_of(CurvatureMethod::orientation, configured).estimate(frame, estimate);
  ASSERT_TRUE(estimate.valid[0]);
  EXPECT_EQ(estimate.length_m[0], 0.0);
  EXPECT_TRUE(std::isinf(estimate.length_variance_m2[0]));
}

TEST(CurvatureEstimator, LengthIsAsNoisyAsReported) {
  // Below a fixed base; the sizes to expect from the closed form, with theta weighted.
  constexpr double kSigma_m = 0.2e-3, kSigma_rad = 3.5e-3;
  constexpr double kLength_m = 0.12;
  const CurvatureEstimator estimator = estimator_of(CurvatureMethod::pose, arm_of(1, kLength_m),
                                                    {BodyNoise{}, {kSigma_m, kSigma_rad}});
  const BodyPose upper = body_at(Eigen::Isometry3d::Identity());
  std::mt19937 random(1);
  for (const auto& [theta, expected_mm] :
       {std::pair{0.0, 0.200}, std::pair{0.4, 0.202}, std::pair{pi / 2, 0.226},
        std::pair{pi, 0.333}, std::pair{4.7, 0.719}}) {
    constexpr int kDraws = 20000;
    const Eigen::Isometry3d end = arc_end(kLength_m, 0.3, theta);
    double sum = 0.0, squares = 0.0, mixed = 0.0, variance = 0.0, covariance = 0.0;
    for (int k = 0; k < kDraws; ++k) {
      const auto lower = test::disturbed(body_at(end), kSigma_m, kSigma_rad, random);
      const SegmentCurvature one = estimator.segment(0, upper, lower);
      ASSERT_TRUE(one.valid);
      const double error = one.length_m - kLength_m;
      sum += error;
      squares += error * error;
      mixed += error * (one.u_rad.dot(bend(0.3, 1.0)) - theta);
      variance += one.length_variance_m2 / kDraws;
      covariance += one.length_covariance_m_rad / kDraws;
    }
    const double sigma = std::sqrt(squares / kDraws);
    EXPECT_NEAR(std::sqrt(variance) / sigma, 1.0, 0.02) << theta;  // 0.5 % by chance
    EXPECT_NEAR(1e3 * std::sqrt(variance), expected_mm, 0.002 + 0.01 * expected_mm) << theta;
    EXPECT_LT(std::abs(sum / kDraws), 0.1 * sigma) << theta;
    if (theta > 0.3) {
      EXPECT_NEAR(mixed / kDraws, covariance, 0.05 * std::abs(covariance) + 2e-8) << theta;
    }
  }
}

TEST(CurvatureEstimator, WhatHasNoBendIsNotValid) {
  const CurvatureEstimator estimator = estimator_of(CurvatureMethod::pose, arm_of(1));
  const BodyPose base = body_at(Eigen::Isometry3d::Identity());
  // Half a turn about the segment's own axis.
  BodyPose turned = body_at(Eigen::Isometry3d(Eigen::Translation3d(0, 0, 0.11)));
  turned.orientation = Eigen::Quaterniond(0, 0, 0, 1);
  EXPECT_FALSE(estimator.segment(0, base, turned).valid);
  // A full circle: its direction is not observable. Swapped ends look the same.
  EXPECT_FALSE(estimator.segment(0, turned, base).valid);
  BodyPose below = base;
  below.position_m.z() = -0.11;
  EXPECT_FALSE(estimator.segment(0, base, below).valid);
}

TEST(CurvatureEstimator, RefusesWrongSettings) {
  EstimationSettings settings;
  const ArmParameters arm = arm_of(2);
  EXPECT_THROW(CurvatureEstimator(settings, arm, test::fixed_base_noise(settings, 3)),
               std::invalid_argument);
  EXPECT_THROW(CurvatureEstimator(settings, arm_of(0), test::fixed_base_noise(settings, 0)),
               std::invalid_argument);
  settings.position_noise_m = -1.0;
  EXPECT_THROW(CurvatureEstimator(settings, arm, test::fixed_base_noise(settings, 2)),
               std::invalid_argument);
}

// Monte Carlo: the estimator against every other fixed pair of weights, along and across the
// bending plane.
struct NoiseCase {
  const char* name;
  BodyNoise upper, lower;
};

class CurvatureNoise : public testing::TestWithParam<NoiseCase> {};

TEST_P(CurvatureNoise, IsTheLeastAndAsReported) {
  const NoiseCase& noise = GetParam();
  const ArmParameters arm = arm_of(1);
  const CurvatureEstimator estimator =
      estimator_of(CurvatureMethod::pose, arm, {noise.upper, noise.lower});
  constexpr int kSamples = 20000;
  constexpr int kWeights = 11;
  std::mt19937_64 random(7);
  for (const double theta : {0.05, 0.4, 1.5, 3.0, 4.5}) {
    const double phi = 2.2;
    const BodyPose upper = body_at(test::some_base());
    const BodyPose lower = body_at(test::some_base() * arc_end(0.11, phi, theta));
    const Eigen::Rotation2Dd to_plane(-phi);
    Eigen::Array2d measured = Eigen::Array2d::Zero();
    std::array<Eigen::Array2d, kWeights> other;
    other.fill(Eigen::Array2d::Zero());
    double reported = 0.0;
    for (int k = 0; k < kSamples; ++k) {
      const BodyPose a =
          test::disturbed(upper, noise.upper.position_m, noise.upper.orientation_rad, random);
      const BodyPose b =
          test::disturbed(lower, noise.lower.position_m, noise.lower.orientation_rad, random);
      const SegmentCurvature one = estimator.segment(0, a, b);
      measured += (to_plane * (one.u_rad - bend(phi, theta))).array().square();
      reported += one.variance_rad2 / kSamples;
      // Both directions by rotation matrices: the bend vector is the mean of the two z axes, up to
      // its length.
      const Eigen::Matrix3d Ra = a.orientation.toRotationMatrix();
      const Eigen::Matrix3d R = Ra.transpose() * b.orientation.toRotationMatrix();
      const Eigen::Vector3d d = (Ra.transpose() * (b.position_m - a.position_m)).normalized();
      const Eigen::Quaterniond q(R);
      Eigen::Vector3d m = Eigen::Vector3d(q.y(), -q.x(), q.w()).normalized();
      if (m.dot(d) < 0.0) m = -m;
      for (int w = 0; w < kWeights; ++w) {
        const Eigen::Vector3d v = w / (kWeights - 1.0) * d + (1.0 - w / (kWeights - 1.0)) * m;
        const double angle = 2.0 * std::acos(v.z() / v.norm());
        const Eigen::Vector2d u = angle * v.head<2>().normalized();
        other[static_cast<std::size_t>(w)] += (to_plane * (u - bend(phi, theta))).array().square();
      }
    }
    measured /= kSamples;
    Eigen::Array2d least = other[0];
    for (const Eigen::Array2d& each : other) least = least.min(each);
    least /= kSamples;
    EXPECT_LT(measured[0], 1.03 * least[0]) << "along, theta " << theta;
    EXPECT_LT(measured[1], 1.03 * least[1]) << "across, theta " << theta;
    EXPECT_NEAR(measured[0] / reported, 1.0, 0.05) << "along, theta " << theta;
    const double across = std::pow(std::sin(theta / 2) / (theta / 2), -2);
    EXPECT_NEAR(measured[1] / (across * reported), 1.0, 0.05) << "across, theta " << theta;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Bodies, CurvatureNoise,
    testing::Values(NoiseCase{"fixed_base", {0.0, 0.0}, {0.2e-3, 3.5e-3}},
                    NoiseCase{"equal", {0.2e-3, 3.5e-3}, {0.2e-3, 3.5e-3}},
                    NoiseCase{"better_base", {0.1e-3, 1.5e-3}, {0.2e-3, 3.5e-3}},
                    NoiseCase{"good_positions", {0.05e-3, 1e-3}, {0.05e-3, 6e-3}},
                    NoiseCase{"bad_positions", {2e-3, 1e-3}, {2e-3, 2e-3}}),
    [](const auto& each) { return std::string(each.param.name); });

// A noisier upper frame: the optimum would extrapolate away from the position. The estimator does
// not, and so is no better, and no worse, than orientation alone.
TEST(CurvatureEstimator, ANoisierUpperFrameLeavesThePositionOut) {
  const ArmParameters arm = arm_of(1);
  const std::vector<BodyNoise> noise{{0.2e-3, 5e-3}, {0.2e-3, 1e-3}};
  const CurvatureEstimator pose = estimator_of(CurvatureMethod::pose, arm, noise);
  const CurvatureEstimator orientation = estimator_of(CurvatureMethod::orientation, arm, noise);
  const BodyPose upper = body_at(test::some_base());
  BodyPose lower = body_at(test::some_base() * arc_end(0.11, 1.0, 0.4));
  lower.position_m.x() += 0.003;
  EXPECT_LT(
      (pose.segment(0, upper, lower).u_rad - orientation.segment(0, upper, lower).u_rad).norm(),
      1e-14);
}

}  // namespace
}  // namespace softarm
