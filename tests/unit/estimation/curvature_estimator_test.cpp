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
  if (noise.empty()) noise = body_noise(settings, arm.size(), true);
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

}  // namespace
}  // namespace softarm
