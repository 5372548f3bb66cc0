// Checks that the arm follows its commands and is the one configured: measured against commanded
// pressures, curvature against pressures and against the reference, measured against configured
// lengths.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/base/time.hpp"
#include "softarm/estimation/curvature_estimator.hpp"
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

/// A loop that is unstable: the error u_ref - u of some coordinate oscillates and does not fade.
/// Errors and reference pass the same high-pass filter (two poles at `oscillation_lowest_hz`). An
/// extremum counts where the error has changed sign since the last one, no longer ago than half a
/// period of the lowest frequency, by at least `oscillation_rad`, by at least `oscillation_part` of
/// what the reference did meanwhile (what follows the reference, well or badly, is no oscillation),
/// and by at least 0.7 of the first one in a row (what fades is none either). No allocation, no
/// clock; bounded: it is found within `oscillation_periods` periods.
class OscillationWatch {
 public:
  /// Of `dof` coordinates that are judged every `period_s`.
  OscillationWatch(const SafetySettings& settings, double period_s, int dof);

  /// The next tick under control: where the arm should be and where it is, `dof` each, rad.
  void judge(ConstVectorRef reference_rad, ConstVectorRef u_rad) noexcept;

  /// Some coordinate oscillated for so many periods.
  bool oscillates() const noexcept { return oscillates_; }
  /// Starts again, where the arm was not under control.
  void reset() noexcept;

 private:
  class HighPass {
   public:
    double pass(double value, double share) noexcept;

   private:
    double slow_ = 0.0, slower_ = 0.0;
    bool started_ = false;
  };
  struct Coordinate {
    HighPass error, reference;
    double extremum = 0.0, first_extremum = 0.0;
    double reference_extremum = 0.0, last_reference_extremum = 0.0;
    int ticks = 0;         ///< since the error changed sign
    int half_periods = 0;  ///< in a row
  };

  void judge(Coordinate& it, double error_rad, double reference_rad) noexcept;
  void end_half_period(Coordinate& it) noexcept;

  double amplitude_rad_, part_, share_;
  int longest_ticks_, half_periods_;
  std::vector<Coordinate> coordinates_;
  bool oscillates_ = false;
};

/// The controller's model has segments of constant length. A measured length that is another one for
/// long means an arm that stretches, a marker frame that slipped or a wrong number in the
/// configuration: the tip is then not where it is reported. No allocation, no clock.
///
/// Of segments that stretch: a length that is not the modelled one under control, and otherwise one
/// that no pressure gives.
class LengthWatch {
 public:
  /// @param most_elongation_m n, of segments that stretch, at the highest pressure; otherwise empty
  LengthWatch(const SafetySettings& settings, const ArmParameters& arm,
              const SegmentScalars& most_elongation_m = {});

  /// The lengths of an accepted frame. A length whose standard deviation is above a third of a limit
  /// is no evidence for or against it.
  /// @param expected [u_x, u_y, e] a segment, of segments that stretch; null: not known
  void judge(std::int64_t capture_ns, const CurvatureEstimate& estimate,
             const SegmentVector* expected = nullptr) noexcept;

  /// Some segment's length was off by more than the warning throughout the settling time.
  bool warns() const noexcept { return warning_.exceeded; }
  /// The same of the fault.
  bool out_of_tolerance() const noexcept { return fault_.exceeded; }
  /// Some segment's length was off by more than the fault when it was last measured.
  bool beyond() const noexcept { return fault_.beyond; }
  /// Starts again, for a gap in which anything may have happened.
  void reset() noexcept;

 private:
  struct Limit {
    double relative;  ///< 0: none
    bool exceeded = false;
    bool beyond = false;
    std::array<std::int64_t, kMaxSegments> since_ns{};  ///< kNever while within the limit
  };
  void judge(std::int64_t capture_ns, const CurvatureEstimate& estimate,
             const SegmentVector* expected, Limit& limit) noexcept;

  std::vector<double> length_m_, reach_m_;
  std::int64_t settling_ns_;
  Limit warning_, fault_;
};

}  // namespace softarm
