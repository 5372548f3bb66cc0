// Checks that the arm follows its commands: measured against commanded pressures, curvature against
// pressures.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/base/time.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {

/// A valve, however slow, gives a pressure between the smallest and the largest of its latest
/// commands. A measured pressure outside that range does not follow: a burst, a leak, a blocked
/// tube, a wrong valve. The range spans at least the settling time, at most twice that.
///
/// A valve whose measurement repeats bit for bit was not measured again: it is out of tolerance too
/// where its command has moved by more than half the tolerance since the measurement last changed,
/// a settling time ago or more. A valve that works, and one that is commanded to rest, do not repeat
/// a measurement then, however coarse it is, as long as its steps are below half the tolerance. No
/// allocation, no clock.
class PressureWatch {
 public:
  /// Consecutive measurements that must be out of tolerance: a single one may be a disturbance.
  static constexpr int kInRow = 3;

  /// Tolerance and settling time of the settings, for `chambers` chambers of the arm.
  PressureWatch(const SafetySettings& settings, int chambers) noexcept;

  /// The pressures commanded from `now_ns` on (bar, one per chamber).
  void command(std::int64_t now_ns, const PressureVector& commanded_bar) noexcept;

  /// The next measurement (bar, one per chamber). Any value is accepted until the commands of a
  /// whole settling time are known.
  void measure(const PressureVector& measured_bar) noexcept;

  /// Clears the history, after a gap in which the valves may have vented by themselves.
  void reset() noexcept;

  /// The last kInRow measurements were outside the range by more than the tolerance, or one valve
  /// repeats its measurement.
  bool out_of_tolerance() const noexcept { return in_row_ >= kInRow || stale_; }

 private:
  struct Range {
    PressureVector low, high;
  };

  void judge_repeats(const PressureVector& measured_bar) noexcept;

  double tolerance_bar_;
  std::int64_t settling_ns_;
  Range since_change_;  // of the commands since each measurement last changed
  PressureVector commanded_bar_, measured_bar_;  // the newest
  std::vector<std::int64_t> moved_ns_;           // when that range became wide; kNever: it is not
  std::int64_t now_ns_ = 0;
  bool measured_ = false;
  bool stale_ = false;
  Range now_, before_;  // of the current settling time and of the previous one
  std::int64_t since_ns_ = 0;
  int known_ = 0;  // how many of the two are known
  int in_row_ = 0;
};

/// When the commands to each segment last moved noticeably, as StaleBodies needs it. No allocation,
/// no clock.
class CommandMoves {
 public:
  /// For the chambers of these settings, segment by segment.
  explicit CommandMoves(const ActuationSettings& actuation);

  /// The pressures commanded from `now_ns` on (bar, one per chamber).
  void command(std::int64_t now_ns, const PressureVector& commanded_bar) noexcept;

  /// For every segment the start of the newest movement by more than 0.03 bar of a chamber of it or
  /// of a segment above it; kNever where there was none.
  std::span<const std::int64_t> began_ns() const noexcept { return began_ns_; }

 private:
  std::vector<Eigen::Index> chambers_;  // of every segment
  PressureVector anchor_bar_;
  std::vector<std::int64_t> anchored_ns_, began_ns_;
};

/// Whether frames come much faster than declared: then the thresholds derived from the declared
/// period are longer than meant. Judged over 40 frames and 20 declared periods or more: not once
/// may two frames have been a third of the declared period apart. Streams that come in bursts have
/// longer gaps. No allocation, no clock.
class FramePeriodWatch {
 public:
  explicit FramePeriodWatch(const SafetySettings& settings) noexcept
      : declared_ns_(to_ns(settings.frame_period_s)) {}

  /// Capture time of the next accepted frame.
  void frame(std::int64_t capture_ns) noexcept;
  /// Result of the last complete interval.
  bool mismatch() const noexcept { return mismatch_; }
  /// Starts an interval, after a gap in which frames were not taken; keeps the result.
  void restart() noexcept { frames_ = 0; }

 private:
  std::int64_t declared_ns_;
  std::int64_t begin_ns_ = 0, last_ns_ = 0, longest_ns_ = 0;
  int frames_ = 0;
  bool mismatch_ = false;
};

/// At rest a segment balances: K u + G(u) = A(u) tau_A. A persistent residual means that the model
/// or the arm is wrong: an obstacle, a burst chamber, a marker body that slipped. It cannot be
/// distinguished from a model error or from inertia and damping in fast motion, so the limit must
/// exceed both. O(n), no allocation, no clock.
class CurvatureWatch {
 public:
  /// @throws std::invalid_argument as DynamicsWorkspace
  CurvatureWatch(const SafetySettings& settings, const ArmParameters& arm);

  /// u: 2n, rad; tau_actuation: 2n, N m, of the pressures in force. Skip ticks that are not to be
  /// judged: after a gap longer than the settling time the check starts again.
  void judge(std::int64_t now_ns, ConstVectorRef u_rad, ConstVectorRef tau_actuation_nm) noexcept;

  /// Whether the settings have a limit.
  bool used() const noexcept { return limit_nm_ > 0.0; }
  /// Some segment's residual was above the limit throughout the settling time.
  bool out_of_tolerance() const noexcept { return strays_; }
  /// Starts again, for a gap in which the arm was not under control.
  void reset() noexcept { strays_ = beyond_ = false; }

 private:
  double largest_residual_nm(ConstVectorRef u_rad, ConstVectorRef tau_actuation_nm) noexcept;

  double limit_nm_;
  std::int64_t settling_ns_;
  ArmParameters arm_;
  DynamicsWorkspace workspace_;
  SegmentVector force_, actuated_;
  std::int64_t since_ns_ = 0;
  bool beyond_ = false;
  bool strays_ = false;
};

}  // namespace softarm
