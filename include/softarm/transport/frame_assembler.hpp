// Bodies that arrive one by one, each on a channel of its own -> frames.
#pragma once

#include <array>
#include <cstdint>

#include "softarm/estimation/mocap_frame.hpp"

namespace softarm {

/// The rule: bodies whose stamps lie less than half a frame period from that of the first one
/// belong to one frame. The frame is done when all bodies are there; or when one of a later frame
/// arrives, or half a frame period has passed since the first arrived: then what is missing counts
/// as not seen. What arrives for a frame that is done already is dropped, and so is what is older;
/// twice as many old ones in a row as there are bodies are a clock that was set back, and a new
/// beginning. Frames are numbered from 1, for their sender does not. Allocates nothing.
class FrameAssembler {
 public:
  /// A body waits with the frame under way, has begun one, or was dropped.
  enum class Outcome { waiting, begun, dropped };

  /// @param segments their ends are bodies 1 .. segments; body 0 is the base
  /// @param fixed_base is waited for by nobody
  /// @param frame_period_s above 0
  FrameAssembler(int segments, bool fixed_base, double frame_period_s) noexcept;

  /// One body. `waiting`: it joined the frame under way; `begun`: it is the first of its frame;
  /// `dropped`. Frames that are done then wait in `take_done`.
  Outcome add(std::size_t body, const BodyPose& pose, std::int64_t stamp_us,
              std::int64_t arrival_ns) noexcept;

  /// Capture time of the frame under way; to be called after `begun`, before `take_done`.
  void set_capture_ns(std::int64_t capture_ns) noexcept;

  /// Moves bodies, number and capture time of the frame that is done to `frame`; what is not its to
  /// tell (a fixed base) is left alone. False if none is.
  bool take_done(MocapFrame& frame) noexcept;

  /// Declares the frame under way done where its first body arrived long enough before `now_ns`.
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
  Frame current_;  // under way, or the last one
  Frame done_;
  bool begun_ = false;
  bool under_way_ = false;
  bool has_done_ = false;
  int old_in_row_ = 0;
  std::int64_t number_ = 0;
};

}  // namespace softarm
