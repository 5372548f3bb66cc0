// Assembles frames from bodies that arrive one by one, each on a separate channel.
#pragma once

#include <array>
#include <cstdint>

#include "softarm/estimation/mocap_frame.hpp"
#include "softarm/transport/coarse_clock.hpp"

namespace softarm {

/// Bodies whose stamps are less than half a frame period from that of the first one belong to one
/// frame. A frame is complete when all bodies have arrived; it is also closed when a body of a
/// later frame arrives, or half a frame period after its first body arrived: missing bodies then
/// count as not seen. Bodies of a closed or older frame are dropped. A body that comes again with
/// its old stamp but moved, half a frame period after the frame began, is of the next frame: the
/// sender's clock is coarser than its frames, and arrivals separate them. Twice as many older bodies
/// in a row as a frame has mean that the sender's clock was set back: assembly then starts again.
/// Frames are numbered from 1, because the sender does not number them. Allocates nothing.
class FrameAssembler {
 public:
  /// What `add` did with a body: it joined the current frame, began a new one, or was dropped.
  enum class Outcome { waiting, begun, dropped };

  /// @param segments  number n of segments: their ends are bodies 1 .. n, the base is body 0
  /// @param fixed_base  the base is fixed: no message of body 0 is expected
  /// @param frame_period_s  above 0
  FrameAssembler(int segments, bool fixed_base, double frame_period_s) noexcept;

  /// Takes one body. A frame that this closes is then available from `take_done`.
  /// @param stamp_us  time stamp of the sender  @param arrival_ns  on our monotonic clock
  Outcome add(std::size_t body, const BodyPose& pose, std::int64_t stamp_us,
              std::int64_t arrival_ns) noexcept;

  /// Sets the capture time of the current frame; call after `begun`, before `take_done`.
  void set_capture_ns(std::int64_t capture_ns) noexcept;

  /// Moves bodies, number and capture time of the closed frame to `frame`; a fixed base is left
  /// unchanged. False if no frame is closed.
  bool take_done(MocapFrame& frame) noexcept;

  /// Stamps repeat from frame to frame: they are no times of capture.
  bool coarse_clock() const noexcept { return clock_.coarse(); }

  /// Closes the current frame if its first body arrived at least half a frame period before
  /// `now_ns`.
  void look_at_clock(std::int64_t now_ns) noexcept;

 private:
  struct Body {
    bool seen = false;
    std::int64_t stamp_us = 0;
    BodyPose pose;
  };
  struct Frame {
    std::array<Body, kMaxBodies> body;
    std::int64_t stamp_us = 0;  // of the first
    std::int64_t arrival_ns = 0;
    std::int64_t capture_ns = 0;
    int seen = 0;
  };

  Outcome begin(std::size_t body, const BodyPose& pose, std::int64_t stamp_us,
                std::int64_t arrival_ns) noexcept;
  void put(std::size_t body, const BodyPose& pose, std::int64_t stamp_us) noexcept;
  void finish() noexcept;

  std::size_t bodies_;  // base included
  std::size_t first_;   // 1 where the base is fixed
  std::int64_t half_period_ns_;
  CoarseClock clock_;
  Frame current_;  // being assembled, or the last one
  Frame done_;
  bool begun_ = false;
  bool under_way_ = false;
  bool has_done_ = false;
  int old_in_row_ = 0;
  std::int64_t number_ = 0;
};

}  // namespace softarm
