#include <algorithm>

#include "commissioning/preflight/geometry.hpp"
#include "softarm/estimation/curvature_estimator.hpp"

namespace softarm {

MeanPoses mean_poses(const Observation& seen, std::int64_t from_ns, std::int64_t to_ns, int bodies,
                     std::vector<BodyPose> SeenFrame::*poses) {
  const auto count = static_cast<std::size_t>(std::max(0, bodies));
  MeanPoses out;
  out.body.assign(count, BodyPose{});
  out.seen.assign(count, 0.0);
  std::vector<Eigen::Vector4d> turn(count, Eigen::Vector4d::Zero());
  for (const SeenFrame& frame : seen.frames) {
    if (frame.arrival_ns < from_ns || frame.arrival_ns >= to_ns) continue;
    ++out.frames;
    for (std::size_t i = 0; i < std::min(count, (frame.*poses).size()); ++i) {
      const BodyPose& pose = (frame.*poses)[i];
      if (!pose.valid || !pose.position_m.allFinite() || !pose.orientation.coeffs().allFinite())
        continue;
      out.seen[i] += 1.0;
      out.body[i].position_m += pose.position_m;
      const Eigen::Vector4d q = pose.orientation.coeffs();
      turn[i] += turn[i].dot(q) < 0.0 ? Eigen::Vector4d(-q) : q;
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (out.seen[i] == 0.0) continue;
    out.body[i].valid = turn[i].norm() > 0.0;
    out.body[i].position_m /= out.seen[i];
    // Not normalized: the mean norm is that of the quaternions, which should be one.
    out.body[i].orientation.coeffs() = turn[i] / out.seen[i];
    out.seen[i] /= out.frames;
  }
  return out;
}

bool curvature_of(const Experiment& experiment, const MeanPoses& poses, Eigen::VectorXd& u_rad) {
  const int n = experiment.arm.size();
  const CurvatureEstimator estimator(experiment.estimation, experiment.arm,
                                     body_noise(experiment.estimation, n));
  u_rad.setZero(2 * n);
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!poses.body[k].valid || !poses.body[k + 1].valid) return false;
    const SegmentCurvature one = estimator.segment(i, poses.body[k], poses.body[k + 1]);
    if (!one.valid) return false;
    u_rad.segment<2>(2 * i) = one.u_rad;
  }
  return true;
}

}  // namespace softarm
