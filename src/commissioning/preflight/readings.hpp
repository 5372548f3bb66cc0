// Possible readings of the poses of the bodies, and which of them makes the segments arcs.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "softarm/commissioning/preflight/checks.hpp"

namespace softarm {

/// A reading of the poses other than the configured one; the order of the quaternion is read where
/// frames come in.
struct Reading {
  const char* name = "as configured";
  bool inverse = false;    ///< orientations are world to body
  int reversed_axis = -1;  ///< of the positions alone: 0 x, 1 y, 2 z
};

inline constexpr Reading kAsConfigured{};
/// Those of the wrong handedness or sense of rotation.
std::span<const Reading> wrong_hands();

/// One segment by its chord and by the rotation from end to end: both are (sin(theta/2) (cos phi,
/// sin phi), cos(theta/2)) for a PCC segment with theta <= pi, in S_{i-1}.
struct SegmentBend {
  Eigen::Vector3d by_position = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d by_orientation = Eigen::Vector3d::UnitZ();
  double twist_rad = 0.0;
  /// Angle between the two.
  double disagreement_rad() const;
};
SegmentBend segment_bend(const BodyPose& upper, const BodyPose& lower, const Reading& reading);

/// Mean poses before and during a pulse.
struct BentPair {
  MeanPoses before, bent;
};

/// How well a reading makes arcs.
struct ReadingFit {
  double at_rest_rad = 0.0;  ///< largest disagreement of a segment at rest
  double twist_rad = 0.0;    ///< largest at rest
  double bent = 0.0;      ///< of the changes by pulses: 0 they agree, 1 they have nothing in common
  bool has_bent = false;  ///< pulses bent the arm enough to decide
  /// The segments may be arcs in this reading. Half a radian is more than any marker frame is
  /// tilted.
  bool fits() const { return at_rest_rad < 0.5 && (!has_bent || bent < 0.5); }
  /// In addition, x axes are parallel: a reading other than the configured one must explain that
  /// too.
  bool convinces() const { return fits() && twist_rad < 0.5; }
};
ReadingFit fit_of(const Reading& reading, const MeanPoses& rest, std::span<const BentPair> bent);

}  // namespace softarm
