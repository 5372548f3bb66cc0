// The parts of numbers in the order of an arm's coordinates: [u_x, u_y] a segment, or [u_x, u_y, e]
// where segments stretch (moments and axial forces alike).
#pragma once

#include "softarm/model/arm.hpp"

namespace softarm {

/// How many segments that stretch fit into a SegmentVector: they have three numbers each.
inline constexpr int kMaxStretchingSegments = 2 * kMaxSegments / 3;

/// One number a segment. Storage in place: never allocates.
using SegmentScalars = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxSegments, 1>;

/// The arm with every segment at its length at rest, for what looks at bends alone.
inline ArmParameters at_rest_length(ArmParameters arm) {
  arm.extensible = false;
  return arm;
}

/// Of every segment, m; at rest where it stretches.
inline SegmentScalars lengths(const ArmParameters& arm) noexcept {
  SegmentScalars out(arm.size());
  for (Eigen::Index i = 0; i < arm.size(); ++i)
    out[i] = arm.segments[static_cast<std::size_t>(i)].length_m;
  return out;
}
inline void set_lengths(ArmParameters& arm, ConstVectorRef length_m) noexcept {
  for (Eigen::Index i = 0; i < arm.size(); ++i)
    arm.segments[static_cast<std::size_t>(i)].length_m = length_m[i];
}

/// The first two of every segment, 2n; nothing of nothing.
inline SegmentVector bend_part(const ArmParameters& arm, ConstVectorRef q) noexcept {
  if (!arm.extensible || q.size() != arm.dof()) return q;
  SegmentVector out(2 * arm.size());
  for (Eigen::Index i = 0; i < arm.size(); ++i) out.segment<2>(2 * i) = q.segment<2>(3 * i);
  return out;
}

/// The third of every segment that may stretch, n; empty where segments do not.
inline SegmentScalars stretch_part(const ArmParameters& arm, ConstVectorRef q) noexcept {
  SegmentScalars out;
  if (!arm.extensible || q.size() != arm.dof()) return out;
  out.resize(arm.size());
  for (Eigen::Index i = 0; i < arm.size(); ++i) out[i] = q[3 * i + 2];
  return out;
}

/// The two parts together; the bends alone where segments do not stretch.
inline SegmentVector coordinates(const ArmParameters& arm, const SegmentVector& bends,
                                 const SegmentScalars& elongations) noexcept {
  if (!arm.extensible || elongations.size() != arm.size()) return bends;
  SegmentVector out(arm.dof());
  for (Eigen::Index i = 0; i < arm.size(); ++i)
    out.segment<3>(3 * i) << bends.segment<2>(2 * i), elongations[i];
  return out;
}

}  // namespace softarm
