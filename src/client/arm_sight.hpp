// The arm as motion capture shows it: from frames to curvature, bend and speed.
#pragma once

#include <cstdint>
#include <deque>

#include "softarm/client/arm_client.hpp"
#include "softarm/estimation/curvature_estimator.hpp"

namespace softarm {

/// Keeps the newest frame that showed every segment as a SeenArm.
class ArmSight {
 public:
  explicit ArmSight(const Experiment& experiment);

  /// Takes a frame; one that repeats the last, or is older, is ignored.
  void take(const MocapFrame& frame, std::int64_t arrival_ns);
  const SeenArm& seen() const { return seen_; }

 private:
  struct Bent {
    std::int64_t arrival_ns;
    SegmentVector u_rad;
  };
  double speed_radps() const;

  int segments_;
  CurvatureEstimator estimator_;
  CurvatureEstimate estimate_;
  SeenArm seen_;
  std::int64_t last_number_ = kNever;
  std::deque<Bent> recent_;
};

}  // namespace softarm
