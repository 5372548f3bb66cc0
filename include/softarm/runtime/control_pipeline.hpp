// From motion-capture frames to valve pressures: the tick.
//
//   ControlPipeline pipeline(settings);
//   const TickOutput& output = pipeline.tick({.now_ns = now, .frames = frames});   // every period
//   send(output.pressure_bar);
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "softarm/actuation/pressure_allocator.hpp"
#include "softarm/actuation/pressure_ramps.hpp"
#include "softarm/base/time.hpp"
#include "softarm/control/control_law.hpp"
#include "softarm/control/control_laws.hpp"
#include "softarm/control/reference.hpp"
#include "softarm/estimation/curvature_filter.hpp"
#include "softarm/estimation/frame_validator.hpp"
#include "softarm/estimation/observer_report.hpp"
#include "softarm/runtime/activation_limit.hpp"
#include "softarm/runtime/contact_watch.hpp"
#include "softarm/runtime/following.hpp"
#include "softarm/runtime/newest_frames.hpp"
#include "softarm/runtime/safety_monitor.hpp"
#include "softarm/runtime/settings.hpp"

namespace softarm {

class ActuatorInverse;
class ElongationReference;
class ModelObserver;
class RepetitiveCompensation;

/// A live reference as it came over the wire: 2n numbers each; rad, rad/s, rad/s^2.
struct LiveReferenceInput {
  SegmentVector u, velocity, acceleration;
};

/// A live target of the tip as it came over the wire, in the world frame.
struct TipTargetInput {
  Eigen::Vector3d position_m, velocity_mps;
};

/// An answer of an external law as it came over the wire.
struct LawInput {
  std::int64_t state_ns = kNever;  ///< tick of the state that it answers, on our clock
  std::int64_t arrival_ns = kNever;
  std::int64_t validity_ns = 0;  ///< from state_ns on
  LawAnswer answer = LawAnswer::force;
  /// tau_u, N m, as many as u_rad of the request; or a pressure a chamber, bar.
  PressureVector values;
};

/// What an external law is to answer: 2n numbers each (3n where segments stretch), of the middle of
/// the period in which an answer to it acts that comes in time for the next tick.
struct LawView {
  double active_s = 0.0;  ///< since the arm became ACTIVE; 0 where it is not
  SegmentVector u_rad, velocity_radps;
  /// Where the arm is not ACTIVE it rests at u_rad: so it will begin.
  ReferenceSample reference;
};

/// How often something came, by what became of it (LawVerdict, LiveVerdict).
template <int verdicts>
using VerdictCounts = std::array<std::int64_t, verdicts>;

/// What has happened since the last tick. Times are of one monotonic clock, in ns.
struct TickInput {
  std::int64_t now_ns = 0;
  std::span<const MocapFrame> frames;  ///< in order of arrival, capture times on our clock
  const LiveReferenceInput* reference = nullptr;  ///< the newest, if one came
  OperatorRequests requests = {};
  bool command_expired = false;  ///< the last one sent has expired: the valves have vented
  bool paused = false;           ///< the clock of `now_ns` stood still since the last tick
  int consecutive_overruns = 0;  ///< ticks missed in a row; zero where they are not to be judged
  /// Arrival of the newest pressure measurement, where the valves publish them.
  std::int64_t newest_measurement_ns = kNever;
  const TipTargetInput* tip_target = nullptr;  ///< the newest, if one came
  const LawInput* law = nullptr;  ///< the newest answer of an external law, if one came
  /// The measured pressures (bar, one a chamber), if some came since the last tick.
  const PressureVector* measured_bar = nullptr;
  /// Arrival of the newest "go", where there is a dead-man input.
  std::int64_t newest_go_ns = kNever;
  /// Arrival of the newest set points on our command channel that another program sent.
  std::int64_t newest_foreign_ns = kNever;
};

/// What the tick saw, decided and commands.
struct TickOutput {
  Mode mode = Mode::init;
  Reason reason = Reason::starting;
  bool armed = false;
  bool saturated = false;     ///< a torque was out of the chambers' reach and was scaled down
  bool slew_limited = false;  ///< a pressure could not move as fast as asked
  bool reference_limited =
      false;                    ///< the reference was bent, or a live one refused, by a soft limit
  bool soft_limit = false;      ///< the arm is beyond max_theta_rad or max_speed_radps
  bool bounded = false;         ///< the controller bounded something near a singularity
  bool length_warning = false;  ///< a segment is not as long as configured
  bool wrong_model = false;     ///< a parameter of the model-based observer stands at its limit
  bool contact = false;         ///< something pushes the arm
  std::int64_t frame_number = -1;  ///< newest accepted frame
  /// Why the newest frame was refused; `accepted` where it was not.
  FrameVerdict refusal = FrameVerdict::accepted;
  double frame_age_s = std::numeric_limits<double>::quiet_NaN();  ///< now minus its capture
  /// u and u' predicted to the middle of the period that begins now; of the model-based observer,
  /// later by control.delay_s, when the command acts.
  FilteredMotion motion;
  /// In the middle of the period that begins now; empty unless ACTIVE.
  ReferenceSample reference;
  /// Correction of the model, its deviations and the innovations; null without a model-based
  /// observer, and while it does not run and `motion` is the kinematic filter's.
  const ModelObserver* observer = nullptr;
  /// What an external law is to answer; null without one, and where the motion is not known.
  const LawView* law = nullptr;
  /// Time in which the newest accepted answer of an external law came back; NaN without any.
  double law_round_trip_s = std::numeric_limits<double>::quiet_NaN();
  /// Of the law, (17); empty unless ACTIVE. As of `motion` and `reference`: 3n where segments
  /// stretch.
  SegmentVector tau_actuation_nm;
  PressureVector pressure_bar;  ///< to be sent
};

/// The same object runs in the daemon, in lock-step simulation and in replay. Reads no clock,
/// allocates nothing and throws nothing after construction.
class ControlPipeline {
 public:
  /// @throws std::invalid_argument for settings that do not fit together, as the modules it is
  /// composed of
  explicit ControlPipeline(const PipelineSettings& settings);
  ~ControlPipeline();

  /// One tick: validate, estimate, safety, control (17), allocate, limit. To be called once per
  /// period with increasing times; the result is valid until the next call.
  const TickOutput& tick(const TickInput& input) noexcept;

  /// Result of the latest tick.
  const TickOutput& output() const noexcept { return output_; }
  /// Frames accepted, rejected and missing since the start.
  const FrameCounters& counters() const noexcept { return validator_.counters(); }
  /// Dropped for their age: captured more than max_latency_s ago, or not yet.
  std::int64_t late_frames() const noexcept { return late_frames_; }
  /// Accepted, but not taken by the model-based observer: too many in one tick (NewestFrames).
  std::int64_t frames_left_out() const noexcept { return newest_frames_.left_out(); }
  /// u and residuals of the newest accepted frame.
  const CurvatureEstimate& estimate() const noexcept { return validator_.estimate(); }
  /// Whether there is a model-based observer.
  bool has_observer() const noexcept { return observer_ != nullptr; }
  /// What it knows after the latest tick; `out` stays as it was where there is none.
  void report(ObserverReport& out) const noexcept;
  /// Answers of an external law so far, by LawVerdict.
  const VerdictCounts<kLawVerdicts>& law_counts() const noexcept { return law_counts_; }
  /// Live references so far that came while the arm was ACTIVE, by LiveVerdict.
  const VerdictCounts<kLiveVerdicts>& reference_counts() const noexcept {
    return reference_counts_;
  }
  /// Every commanded pressure is zero.
  bool fully_vented() const noexcept { return output_.pressure_bar.isZero(0.0); }
  /// Period of the tick, 1/rate_hz.
  std::int64_t period_ns() const noexcept { return period_ns_; }

 private:
  void forget_command() noexcept;
  void validate_and_estimate(const TickInput& input, SafetyInput& safety) noexcept;
  void watch(const TickInput& input, SafetyInput& safety) noexcept;
  void watch_contact(const TickInput& input, SafetyInput& safety) noexcept;
  const ModelCorrection* correction() noexcept;
  const ModelCorrection* ahead(const ModelCorrection* found, std::int64_t at_ns) noexcept;
  void use_frame(bool too_many) noexcept;
  void observe(const MocapFrame& frame, const CurvatureEstimate& estimate,
               const KnownMotion* expected) noexcept;
  void predict(std::int64_t now_ns, std::int64_t at_ns) noexcept;
  void expect(std::int64_t at_ns) noexcept;
  void take_law(const TickInput& input, SafetyInput& safety) noexcept;
  LawVerdict judge(const LawInput& law, std::int64_t now_ns) noexcept;
  void view_for_law(Mode mode, std::int64_t act_ns) noexcept;
  void take_reference(const TickInput& input) noexcept;
  void note_reference(LiveVerdict verdict) noexcept;
  void control(std::int64_t act_ns) noexcept;
  void allocate() noexcept;
  void note_command(std::int64_t now_ns) noexcept;
  void limit(Mode mode) noexcept;
  bool poses_frozen(std::int64_t now_ns) const noexcept;
  bool beyond_soft_limit(bool speed_too) const noexcept;
  double seconds(std::int64_t time_ns) const noexcept { return to_seconds(time_ns - epoch_ns_); }

  PipelineSettings settings_;
  std::int64_t period_ns_;
  double period_s_;
  FrameValidator validator_;
  CurvatureFilter filter_;
  std::unique_ptr<ModelObserver> observer_;  ///< where it is configured
  NewestFrames newest_frames_;               ///< that it takes of too many in one tick
  std::optional<ContactWatch> contact_watch_;
  SegmentVector measured_tau_nm_, modelled_tau_nm_;  ///< scratch
  SegmentVector
      missing_nm_;  ///< generalized force that measured pressures lack; empty: not measured
  std::int64_t wrong_model_since_ns_ = kNever;
  ModelCorrection yielding_;                            ///< the correction without what pushes
  std::unique_ptr<RepetitiveCompensation> repetition_;  ///< where it is configured
  std::vector<double> periods_s_;                       ///< of the reference's phases, for that
  int repeating_phase_ = -1;  ///< that it learns; -1: it has just become ACTIVE
  ModelCorrection ahead_;     ///< the correction with what repeats
  std::int64_t delay_ns_;     ///< that they and the controller look ahead by
  SafetyMonitor safety_;
  ActivationLimit activation_limit_;
  std::int64_t answer_ns_;  ///< in which a command that moved must show in frames that are not late
  Reference reference_;
  std::unique_ptr<HoldLimits> hold_;
  std::unique_ptr<ControlLaw> law_;
  ExternalLawInput* external_;  ///< the same law, where it is external
  SegmentVector most_force_;    ///< of an external law: more is no force of this arm
  PressureAllocator allocator_;
  std::unique_ptr<ActuatorInverse> inverse_;         ///< where it is configured
  std::unique_ptr<ElongationReference> elongation_;  ///< where segments stretch
  PressureRamps ramps_;
  PressureWatch pressure_watch_;
  CommandMoves command_moves_;
  FramePeriodWatch frame_period_watch_;
  CurvatureWatch curvature_watch_;
  OscillationWatch oscillation_watch_;
  LengthWatch length_watch_;

  TickOutput output_;
  ReferenceWindow window_;
  KnownMotion known_;
  ControlOutput control_;
  LawView law_view_;
  FilteredMotion law_motion_;
  VerdictCounts<kLawVerdicts> law_counts_{};
  std::int64_t law_until_ns_ = kNever;
  VerdictCounts<kLiveVerdicts> reference_counts_{};
  Allocation allocation_;
  PressureVector previous_bar_;
  SegmentVector previous_tau_nm_;                ///< that these give
  SegmentVector commanded_tau_nm_;               ///< scratch of what is sent now
  SegmentVector at_rest_;                        ///< zero
  PressureVector pressure_at_last_motion_bar_;   ///< commanded when the poses last changed
  std::int64_t unanswered_since_ns_ = kForever;  ///< when the command moved away from it
  std::array<std::int64_t, kMaxSegments> seen_ns_{};
  std::int64_t epoch_ns_ = 0;
  std::int64_t active_since_ns_ = 0;
  std::int64_t previous_ns_ = 0;
  std::int64_t newest_capture_ns_ = kNever;
  std::int64_t late_frames_ = 0;
  std::uint32_t activations_ = 0;
  bool ticked_ = false;
};

}  // namespace softarm
