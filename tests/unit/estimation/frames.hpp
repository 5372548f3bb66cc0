// Frames of PCC arms for the tests of this module, made by rotating about the bending axis: another
// route than the estimator's quaternion components.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "softarm/estimation/curvature_estimator.hpp"
#include "softarm/estimation/mocap_frame.hpp"

namespace softarm::test {

/// Noise of the bodies where the base is not one of them.
inline std::vector<BodyNoise> fixed_base_noise(EstimationSettings settings, int segments) {
  settings.base_is_fixed = true;
  return body_noise(settings, segments);
}

/// Pose of the end of a segment that bends by theta towards phi: an arc of radius L / theta.
inline Eigen::Isometry3d arc_end(double length, double phi, double theta) {
  const Eigen::Vector3d towards(std::cos(phi), std::sin(phi), 0.0);
  const Eigen::Vector3d axis(-std::sin(phi), std::cos(phi), 0.0);
  Eigen::Isometry3d end = Eigen::Isometry3d::Identity();
  end.linear() = Eigen::AngleAxisd(theta, axis).toRotationMatrix();
  if (theta == 0.0) {
    end.translation() = Eigen::Vector3d(0.0, 0.0, length);
  } else {
    // 1 - cos without cancellation.
    const double radius = length / theta;
    end.translation() = radius * (2.0 * std::pow(std::sin(theta / 2.0), 2) * towards +
                                  std::sin(theta) * Eigen::Vector3d::UnitZ());
  }
  return end;
}

inline BodyPose body_at(const Eigen::Isometry3d& pose) {
  BodyPose body;
  body.position_m = pose.translation();
  body.orientation = Eigen::Quaterniond(pose.linear());
  body.valid = true;
  return body;
}

inline ArmParameters arm_of(int segments, double length = 0.11) {
  ArmParameters arm;
  arm.segments.resize(static_cast<std::size_t>(segments));
  for (SegmentParameters& segment : arm.segments) segment.length_m = length;
  return arm;
}

/// Frame of an arm with the given u, or (u, e) where it stretches, and a base anywhere.
inline MocapFrame frame_of(const ArmParameters& arm, const Eigen::VectorXd& u,
                           const Eigen::Isometry3d& base = Eigen::Isometry3d::Identity()) {
  MocapFrame frame;
  frame.segments = arm.size();
  Eigen::Isometry3d pose = base;
  frame.body[0] = body_at(pose);
  for (int i = 0; i < arm.size(); ++i) {
    const int at = arm.segment_dof() * i;
    const Eigen::Vector2d bend = u.segment<2>(at);
    const double longer_m = arm.extensible ? u[at + 2] : 0.0;
    pose = pose * arc_end(arm.segments[static_cast<std::size_t>(i)].length_m + longer_m,
                          std::atan2(bend.y(), bend.x()), bend.norm());
    frame.body[static_cast<std::size_t>(i) + 1] = body_at(pose);
  }
  return frame;
}

/// Adds Gaussian noise an axis: position in the world, rotation vector in the body.
template <class Random>
BodyPose disturbed(BodyPose body, double position_m, double orientation_rad, Random& random) {
  std::normal_distribution<double> normal;
  const Eigen::Vector3d shift(normal(random), normal(random), normal(random));
  const Eigen::Vector3d turn =
      orientation_rad * Eigen::Vector3d(normal(random), normal(random), normal(random));
  body.position_m += position_m * shift;
  if (turn.norm() > 0.0) {
    body.orientation = body.orientation * Eigen::AngleAxisd(turn.norm(), turn.normalized());
  }
  return body;
}

inline Eigen::Isometry3d some_base() {
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity();
  base.linear() =
      Eigen::AngleAxisd(2.7, Eigen::Vector3d(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  base.translation() = Eigen::Vector3d(0.4, -1.2, 2.0);
  return base;
}

}  // namespace softarm::test
