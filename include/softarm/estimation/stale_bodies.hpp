// Which bodies of a frame were measured, and which only repeat an older pose.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "softarm/base/time.hpp"
#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/estimation/settings.hpp"

namespace softarm {

/// What the commands demand of the arm, as far as it must show in the poses.
struct CommandedMotion {
  /// For every segment the start of the newest noticeable movement of the commands to it or to one
  /// above it, on the clock of the captures; kNever where there was none. Empty: not known.
  std::span<const std::int64_t> began_ns = {};
  int frozen_frames = 0;  ///< frames in which they must show; 0: not judged
};

/// A sender that has lost a body may send its last pose again and mark it valid. A sensor with noise
/// does not measure a pose twice to the last bit, and a segment end that is carried by one that moves
/// does not stay where it is. So a segment end is stale where its pose repeats bit for bit
///  - in stale_frames frames in a row, while another body moved by more than three times its noise
///    (at least 0.1 mm or 1 mrad), and a body above it, the base included, by more than a micrometre
///    or 10 microradians from one frame to the next: by its noise, or because it moves; or
///  - in twice frozen_frames frames in a row, the second half of them since the commands to its
///    segment or to one above have moved, while some other segment end does move. Where all repeat, the whole sensor is frozen, or an arm
///    without noise is at rest: that is for the safety monitor to decide.
/// Never the base, which may stand still. Stale lasts until the pose changes. Reads no clock,
/// allocates nothing after construction.
class StaleBodies {
 public:
  /// Noise and stale_frames of the settings, for the n + 1 bodies of an arm.
  StaleBodies(const EstimationSettings& settings, int segments);

  /// The next frame in order whose poses are finite. Bodies that are not valid are not looked at.
  void observe(const MocapFrame& frame, const CommandedMotion& commanded) noexcept;

  /// Whether this body (0: the base) was stale in the newest frame.
  bool stale(std::size_t body) const noexcept { return watched_[body].stale; }

  /// Forgets the past.
  void reset() noexcept;

 private:
  struct Watched {
    BodyPose pose;    // as it was last seen
    BodyPose anchor;  // from which it has not moved noticeably since anchored_ns
    std::int64_t seen_ns = 0, changed_ns = 0, anchored_ns = 0;
    std::int64_t step_began_ns = kNever;  // of its newest visible step from one frame to the next
    int repeats = 0;                      // frames in a row in which `pose` came again
    int command_frames = 0;               // of them since the commands were seen to have moved
    bool stale = false;
  };
  void look(const BodyPose& pose, std::int64_t capture_ns, Watched& body) noexcept;

  int stale_frames_;
  double noticeable_m_, noticeable_rad_;
  std::vector<Watched> watched_;
  std::int64_t motion_began_ns_ = 0;  // start of the newest noticeable movement of any body
};

}  // namespace softarm
