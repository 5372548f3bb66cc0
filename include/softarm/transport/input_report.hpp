// Why the daemon does not take what it receives, for a person.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "softarm/base/time.hpp"
#include "softarm/estimation/frame_validator.hpp"
#include "softarm/runtime/safety_monitor.hpp"

namespace softarm {

/// Once a second while the arm is not ACTIVE: how many frames were refused, and why. Once: that a
/// channel has two senders, whose numbers then jump back again and again. Neither allocates nor
/// reads a clock, so that it may be asked after every tick.
class InputReport {
 public:
  /// Numbers that jumped back on a channel, since the start.
  struct Backward {
    std::string_view channel;
    std::int64_t count = 0;
  };

  /// What the daemon has counted since its start.
  struct Counts {
    Mode mode = Mode::init;
    const FrameCounters& frames;
    std::int64_t late_frames = 0;
    std::string_view frame_channel;
    Backward measurements, references;
  };

  /// What is to be printed, one line; empty where there is nothing. Valid until the next call.
  std::string_view refusals(std::int64_t now_ns, const Counts& counts) noexcept;
  /// The same, of a second sender. To be asked after refusals(), at any rate.
  std::string_view second_sender(std::int64_t now_ns, const Counts& counts) noexcept;

 private:
  struct Window {
    std::int64_t begin_ns = kNever;
    std::int64_t before = 0;
    bool reported = false;
  };
  std::string_view backward(std::int64_t now_ns, const Backward& now, std::int64_t tolerated,
                            Window& window) noexcept;

  std::array<char, 240> text_;
  FrameCounters before_;
  std::int64_t late_before_ = 0;
  std::int64_t reported_ns_ = kNever;
  std::array<Window, 3> windows_;
};

}  // namespace softarm
