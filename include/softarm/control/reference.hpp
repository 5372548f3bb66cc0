// What the arm is asked to do: u_ref(t) with its first two derivatives, joined smoothly from
// wherever the arm is.
//
//   Reference reference(settings, control, arm);
//   reference.measure_tip(capture_s, tip_m);          // every frame, for references of the tip
//   reference.start(now_s, u, velocity);              // at ACTIVE, also after HOLD and VENT
//   reference.advance(now_s);                         // every tick while ACTIVE
//   reference.window(now_s, controller.lookahead_s(), samples);
//   controller.compute(u, velocity, samples, output);
#pragma once

#include <memory>

#include "softarm/control/hold_limits.hpp"
#include "softarm/control/settings.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/coordinates.hpp"

namespace softarm {

/// What became of a live reference. The numbers go over the wire.
enum class LiveVerdict : std::int8_t {
  accepted,
  not_live,    ///< the phase of this time does not listen
  wrong_size,  ///< not 2n numbers
  not_finite,
  out_of_limits,   ///< beyond max_theta_rad or max_speed_radps
  step_too_large,  ///< further than max_step_rad from the reference so far
  out_of_order,    ///< its sequence is below that of the newest
  unreachable,     ///< no pose within max_theta_rad was found that brings the tip there
  not_held         ///< the chambers cannot hold the arm there at rest
};
inline constexpr int kLiveVerdicts = static_cast<int>(LiveVerdict::not_held) + 1;
/// "accepted", "not_live", ...; "unknown" for a value outside the enumeration.
const char* name(LiveVerdict verdict) noexcept;

/// Largest theta that a reference reaches, live ones apart (0).
double largest_theta_rad(const ReferenceSettings& settings) noexcept;

/// Whether a time is a whole number of periods, one or more, to rounding (1e-6).
bool whole_periods(double time_s, double period_s) noexcept;

/// After which a phase repeats, s; 0: not, or not that it is known beforehand.
double period_s(const ReferencePhase& phase) noexcept;

/// The phases of an experiment. Times are seconds of any one clock of the caller's. No allocation
/// after construction.
///
/// Joining: to the phase's own curve a quintic offset d(t) is added that starts with d = u - u_ref,
/// d' = u' - u'_ref, d'' = 0 and is zero with its first two derivatives after blend_s, or later
/// where max_speed_radps asks for it. An arm at rest on the reference thus follows it exactly.
/// Phases of a sequence are joined in the same way.
///
/// Task space: a phase with a path of the tip is followed by (21), integrated from what the
/// reference is where the phase begins, with the tip as measured. It is then a function of time and
/// of the measurements, and of how it is advanced; away from the time advanced to it is carried on
/// with constant u''_ref, and so is what comes before such a phase until advance() enters it.
///
/// Soft limits: curves that would exceed max_theta_rad or max_speed_radps are refused at load or on
/// reception. What a blend adds beyond 98 % of max_theta_rad is bent inside it radially (C2,
/// derivatives exact), and flagged; a blend that still exceeds max_speed_radps is only flagged.
class Reference {
 public:
  /// Throws ReferenceError for sizes, times or limits of a phase that do not fit, and
  /// std::invalid_argument for other settings.
  /// Where segments stretch, samples have 3n numbers, [u_x, u_y, e] a segment.
  /// @param natural_elongation_m n: e in phases that give none, and where e rests in phases of the
  /// tip; empty: zero
  Reference(const ReferenceSettings& settings, const ControllerSettings& control,
            const ArmParameters& arm, const SegmentScalars& natural_elongation_m = {});
  /// Where no phase is in task space, the number of segments is all that matters.
  Reference(const ReferenceSettings& settings, const ControllerSettings& control, int segments);
  ~Reference();
  Reference(Reference&&) noexcept;
  Reference& operator=(Reference&&) noexcept;

  /// Starts the reference's time at `time_s` with the arm at u (2n, rad; 3n where segments stretch),
  /// velocity (the same, rad/s and m/s).
  void start(double time_s, ConstVectorRef u, ConstVectorRef velocity) noexcept;
  bool started() const noexcept;

  /// Lets a phase in task space go on to `time_s`, and such phases begin and end; nothing happens
  /// for other phases. Bounded work. Does nothing before the first start().
  void advance(double time_s) noexcept;

  /// Which phase a time belongs to (0, 1, ...), as sample() has it, and the time (s) since it began.
  struct Place {
    int phase;
    double since_s;
  };
  Place place(double time_s) const noexcept;

  /// The tip (m, world frame) as measured at `time_s`; start() and phases in task space use the
  /// newest.
  void measure_tip(double time_s, const Eigen::Vector3d& tip_m) noexcept;

  /// The reference at any time; before the start it is what it is at the start. A function of time
  /// alone between calls of start(), advance(), measure_tip() and receive(). Unspecified before the
  /// first start().
  void sample(double time_s, ReferenceSample& out) const noexcept;

  /// `now`, and with lookahead_s > 0 also `before` and `after` by so much, not reaching back over
  /// the start.
  void window(double time_s, double lookahead_s, ReferenceWindow& out) const noexcept;

  /// A live reference arrived: 2n numbers each, curvatures alone; rad, rad/s, rad/s^2. Between messages it is
  /// extrapolated with the received derivatives; after `timeout_s` it returns to the last received
  /// u and rests there.
  LiveVerdict receive(double time_s, ConstVectorRef u, ConstVectorRef velocity,
                      ConstVectorRef acceleration) noexcept;

  /// A live target of the tip arrived (world frame), for a phase of kind live_tip. It is approached
  /// from where the target was, within the speed and acceleration of the phase, and carried on with
  /// its velocity for `timeout_s`; then it rests. Refused where no pose is found that reaches it
  /// (kTipSearchSteps steps of a search, from the reference's own pose first).
  LiveVerdict receive_tip(double time_s, const Eigen::Vector3d& position_m,
                          const Eigen::Vector3d& velocity_mps) noexcept;

  /// From now on live references stay where the chambers can hold the arm, and so do u_ref of
  /// phases in task space: they do not wind up where pressures saturate. `limits` must outlive this.
  void hold_within(HoldLimits& limits) noexcept;

  static constexpr int kTipSearchSteps = 60;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace softarm
