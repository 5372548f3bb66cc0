// Why the daemon does not take what it receives, for a person.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "softarm/base/time.hpp"
#include "softarm/estimation/frame_validator.hpp"
#include "softarm/runtime/control_pipeline.hpp"
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
    /// Live references and targets of the tip, and answers of an external law, by verdict.
    VerdictCounts<kLiveVerdicts> live{};
    VerdictCounts<kLawVerdicts> answers{};
  };

  /// What is to be printed, one line; empty where there is nothing. Valid until the next call.
  std::string_view refusals(std::int64_t now_ns, const Counts& counts) noexcept;
  /// The same, in every mode, of refused live references, then of refused answers of a law.
  std::string_view refused_references(std::int64_t now_ns, const Counts& counts) noexcept;
  std::string_view refused_answers(std::int64_t now_ns, const Counts& counts) noexcept;
  /// The same, of a second sender. To be asked after refusals(), at any rate.
  std::string_view second_sender(std::int64_t now_ns, const Counts& counts) noexcept;

 private:
  struct Window {
    std::int64_t begin_ns = kNever;
    std::int64_t before = 0;
    bool reported = false;
  };
  template <int verdicts>
  struct Refused {
    std::int64_t reported_ns = kNever;
    VerdictCounts<verdicts> before{};
  };
  template <class Verdict, int verdicts>
  std::string_view refused(std::int64_t now_ns, const char* what,
                           const VerdictCounts<verdicts>& now, Refused<verdicts>& last) noexcept;
  std::string_view backward(std::int64_t now_ns, const Backward& now, std::int64_t tolerated,
                            Window& window) noexcept;

  std::array<char, 240> text_;
  FrameCounters before_;
  std::int64_t late_before_ = 0;
  std::int64_t reported_ns_ = kNever;
  std::array<Window, 3> windows_;
  Refused<kLiveVerdicts> live_;
  Refused<kLawVerdicts> answers_;
};

}  // namespace softarm
