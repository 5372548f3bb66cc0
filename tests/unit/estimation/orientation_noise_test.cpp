// The Jacobians against differences of the estimator itself.
#include "estimation/orientation_noise.hpp"

#include <gtest/gtest.h>

#include "frames.hpp"
#include "softarm/estimation/curvature_estimator.hpp"

namespace softarm {
namespace {

/// u of the segment whose two bodies are turned by these rotation vectors, in their own frames.
Eigen::Vector2d measured(const Eigen::Vector2d& u, const Eigen::Vector3d& upper,
                         const Eigen::Vector3d& lower) {
  const ArmParameters arm = test::arm_of(1);
  EstimationSettings settings;
  settings.method = CurvatureMethod::orientation;
  const CurvatureEstimator estimator(settings, arm, body_noise(settings, 1));
  MocapFrame frame = test::frame_of(arm, u);
  const auto turned = [](const Eigen::Vector3d& by) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(
        by.norm(), by.norm() > 0.0 ? Eigen::Vector3d(by.normalized()) : Eigen::Vector3d::UnitX()));
  };
  frame.body[0].orientation = frame.body[0].orientation * turned(upper);
  frame.body[1].orientation = frame.body[1].orientation * turned(lower);
  return estimator.segment(0, frame.body[0], frame.body[1]).u_rad;
}

TEST(OrientationNoise, JacobiansAreThoseOfTheEstimator) {
  constexpr double kStep = 1e-5;
  for (const double theta : {0.0, 1e-9, 0.4, 1.6, 3.0, 3.3, 4.5}) {
    for (const double phi : {0.0, 0.7, -2.0}) {
      const Eigen::Vector2d u = theta * Eigen::Vector2d(std::cos(phi), std::sin(phi));
      const BodyNoiseJacobians jacobians = body_noise_jacobians(u);
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d by = kStep * Eigen::Vector3d::Unit(axis);
        const Eigen::Vector3d none = Eigen::Vector3d::Zero();
        const Eigen::Vector2d lower =
            (measured(u, none, by) - measured(u, none, -by)) / (2.0 * kStep);
        const Eigen::Vector2d upper =
            (measured(u, by, none) - measured(u, -by, none)) / (2.0 * kStep);
        EXPECT_LT((jacobians.lower.col(axis) - lower).norm(), 1e-6) << theta << " " << axis;
        EXPECT_LT((-jacobians.upper.col(axis) - upper).norm(), 1e-6) << theta << " " << axis;
      }
    }
  }
}

TEST(OrientationNoise, StaysBoundedTowardsAFullTurn) {
  for (const double theta : {6.2, 6.2831853071795862, 6.5}) {
    const BodyNoiseJacobians jacobians = body_noise_jacobians({theta, 0.0});
    EXPECT_TRUE(jacobians.lower.allFinite());
    EXPECT_LT(jacobians.lower.norm(), 200.0) << theta;
  }
}

}  // namespace
}  // namespace softarm
