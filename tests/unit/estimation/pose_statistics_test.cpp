// Mean poses against means that are known by symmetry.
#include "softarm/estimation/pose_statistics.hpp"

#include <gtest/gtest.h>

#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

TEST(MeanPose, DoesNotDependOnSignsAndIsInTheMiddle) {
  const Vector3d axis = Vector3d(1, 2, 3).normalized();
  MeanPose mean;
  for (const double angle : {3.0, 3.1, 3.2, 3.3}) {  // across half a turn, where signs change
    Quaterniond q(AngleAxisd(angle, axis));
    if (mean.count() % 2 == 1) q.coeffs() *= -1.0;
    mean.add(Vector3d(angle, -1.0, 2.0 * angle), q);
  }
  EXPECT_EQ(mean.count(), 4);
  EXPECT_LT(mean.orientation().angularDistance(Quaterniond(AngleAxisd(3.15, axis))), 1e-12);
  EXPECT_LT((mean.position_m() - Vector3d(3.15, -1.0, 6.3)).norm(), 1e-14);
  EXPECT_DOUBLE_EQ(mean.quaternion_length(), 1.0);
  EXPECT_LT((mean.pose().linear() - AngleAxisd(3.15, axis).toRotationMatrix()).norm(), 1e-12);
  EXPECT_EQ(mean.pose().translation(), mean.position_m());
}

/// What a sender gets wrong about the length must not weigh its rotation, and must be seen.
TEST(MeanPose, LengthsOfQuaternionsAreReportedAndDoNotWeigh) {
  MeanPose mean;
  Quaterniond small(AngleAxisd(0.2, Vector3d::UnitX())), large = small.conjugate();
  large.coeffs() *= 3.0;
  mean.add(Vector3d::Zero(), small);
  mean.add(Vector3d::Zero(), large);
  EXPECT_LT(mean.orientation().angularDistance(Quaterniond::Identity()), 1e-12);
  EXPECT_DOUBLE_EQ(mean.quaternion_length(), 2.0);
  MeanPose zeros;
  zeros.add(Vector3d::Ones(), Quaterniond(0, 0, 0, 0));
  EXPECT_EQ(zeros.quaternion_length(), 0.0);
  EXPECT_TRUE(zeros.orientation().coeffs().allFinite());
}

TEST(FramesOnBodies, LeadFromTheBodiesToTheFramesOfTheArm) {
  ArmParameters arm;
  arm.segments.resize(2);
  arm.base_position_m = {0.3, -0.2, 1.5};
  const Eigen::Vector4d u(0.3, -0.2, 0.1, 0.4);
  std::vector<Eigen::Isometry3d> ends(2);
  forward_kinematics(arm, u, ends);
  Eigen::Isometry3d base;
  base.linear() = arm.base_rotation;
  base.translation() = arm.base_position_m;
  std::vector<Eigen::Isometry3d> on_body, mean;
  for (const Eigen::Isometry3d& frame : {base, ends[0], ends[1]}) {
    const double k = static_cast<double>(mean.size());
    on_body.emplace_back(Eigen::Translation3d(0.01 * k, 0.02, -0.01) *
                         AngleAxisd(0.3 + k, Vector3d(1, k, -1).normalized()));
    mean.push_back(frame * on_body.back().inverse());
  }
  const auto found = frames_on_bodies(arm, u, mean);
  ASSERT_EQ(found.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_LT((found[i].matrix() - on_body[i].matrix()).norm(), 1e-14) << i;
}

}  // namespace
}  // namespace softarm
