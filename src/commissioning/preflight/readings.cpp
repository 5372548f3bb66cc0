#include "commissioning/preflight/readings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace softarm {
namespace {

constexpr double kBentEnough_rad = 0.02;  ///< turn of a chord that orientations must show too

constexpr std::array kWrongHands{
    Reading{"orientations from world to body (conjugate quaternions)", true, -1},
    Reading{"positions with x reversed", false, 0}, Reading{"positions with y reversed", false, 1},
    Reading{"positions with z reversed", false, 2}};

BodyPose read(BodyPose pose, const Reading& reading) {
  if (reading.inverse) pose.orientation = pose.orientation.conjugate();
  if (reading.reversed_axis >= 0) pose.position_m[reading.reversed_axis] *= -1.0;
  return pose;
}

template <class Use>
void for_each_segment(const MeanPoses& poses, const Use& use) {
  for (std::size_t i = 0; i + 1 < poses.body.size(); ++i)
    if (poses.body[i].valid && poses.body[i + 1].valid) use(i);
}

double chord_turn_rad(const BentPair& pair, std::size_t i) {
  const auto chord = [i](const MeanPoses& poses) {
    return (poses.body[i + 1].position_m - poses.body[i].position_m).normalized();
  };
  return (chord(pair.bent) - chord(pair.before)).norm();
}

}  // namespace

std::span<const Reading> wrong_hands() { return kWrongHands; }

double SegmentBend::disagreement_rad() const {
  return std::atan2(by_position.cross(by_orientation).norm(), by_position.dot(by_orientation));
}

SegmentBend segment_bend(const BodyPose& upper_as_read, const BodyPose& lower_as_read,
                         const Reading& reading) {
  const BodyPose upper = read(upper_as_read, reading);
  const BodyPose lower = read(lower_as_read, reading);
  const Eigen::Quaterniond to_upper = upper.orientation.normalized().conjugate();
  Eigen::Quaterniond q = to_upper * lower.orientation.normalized();
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  const Eigen::Vector3d bend(q.y(), -q.x(), q.w());
  return {.by_position = (to_upper * (lower.position_m - upper.position_m)).normalized(),
          .by_orientation = bend.normalized(),
          .twist_rad = 2.0 * std::atan2(q.z(), bend.norm())};
}

ReadingFit fit_of(const Reading& reading, const MeanPoses& rest, std::span<const BentPair> bent) {
  ReadingFit fit;
  for_each_segment(rest, [&](std::size_t i) {
    const SegmentBend one = segment_bend(rest.body[i], rest.body[i + 1], reading);
    fit.at_rest_rad = std::max(fit.at_rest_rad, one.disagreement_rad());
    fit.twist_rad = std::max(fit.twist_rad, std::abs(one.twist_rad));
  });
  double apart = 0.0, together = 0.0;
  for (const BentPair& pair : bent) {
    if (pair.before.frames == 0 || pair.bent.frames == 0) continue;
    for_each_segment(pair.bent, [&](std::size_t i) {
      if (!pair.before.body[i].valid || !pair.before.body[i + 1].valid) return;
      fit.has_bent = fit.has_bent || chord_turn_rad(pair, i) > kBentEnough_rad;
      const SegmentBend a = segment_bend(pair.before.body[i], pair.before.body[i + 1], reading);
      const SegmentBend b = segment_bend(pair.bent.body[i], pair.bent.body[i + 1], reading);
      const Eigen::Vector2d by_position = (b.by_position - a.by_position).head<2>();
      const Eigen::Vector2d by_orientation = (b.by_orientation - a.by_orientation).head<2>();
      apart += (by_position - by_orientation).squaredNorm();
      together += by_position.squaredNorm() + by_orientation.squaredNorm();
    });
  }
  fit.bent = together > 0.0 ? std::sqrt(apart / together) : 0.0;
  return fit;
}

}  // namespace softarm
