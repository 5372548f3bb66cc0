#include "softarm/runtime/control_pipeline.hpp"

#include <algorithm>
#include <cmath>

#include "softarm/actuation/actuator_inverse.hpp"
#include "softarm/base/time.hpp"
#include "softarm/control/repetition.hpp"
#include "softarm/estimation/model_observer.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/runtime/elongation_reference.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/runtime/static_hold.hpp"

namespace softarm {
namespace {

/// The arm may overshoot what its reference may not exceed, by so much.
constexpr double kSoftLimitMargin = 1.1;
/// A command that has moved by so much must move the arm, unless the poses are frozen.
constexpr double kFrozenCommandChange_bar = 0.05;

/// A force of an external law beyond so many times what the chambers of its segment give together
/// is none of this arm: a wrong unit, or a law that diverges. What is below is scaled into reach.
constexpr double kMostForce = 10.0;
/// Pressures of an external law may be off the limits by rounding.
constexpr double kPressureRounding = 1e-6;

SegmentVector most_force(const ArmParameters& arm, const ActuationSettings& actuation) {
  const int width = arm.segment_dof();
  SegmentVector most(arm.dof());
  for (int i = 0; i < arm.size(); ++i) {
    const LargestForce force = largest_force(actuation, static_cast<std::size_t>(i));
    most.segment<2>(width * i).setConstant(kMostForce * force.moment_nm);
    if (width == 3) most[width * i + 2] = kMostForce * force.axial_n;
  }
  return most;
}

std::unique_ptr<ModelObserver> make_observer(const PipelineSettings& settings) {
  if (settings.estimation.observer != ObserverKind::model) return nullptr;
  return std::make_unique<ModelObserver>(
      settings.arm, settings.estimation, body_noise(settings.estimation, settings.arm.size()),
      ObserverTiming{.valve_lag_s = settings.control.valve_lag_s,
                     .max_latency_s = settings.safety.max_latency_s,
                     .control_period_s = 1.0 / settings.rate_hz,
                     .dead_time_s = settings.control.dead_time_s});
}

std::unique_ptr<RepetitiveCompensation> make_repetition(const PipelineSettings& settings) {
  const double lead_s = settings.control.repetition.lead_s;
  if (!(lead_s > 0.0) || settings.estimation.observer != ObserverKind::model) return nullptr;
  return std::make_unique<RepetitiveCompensation>(settings.arm, lead_s, 1.0 / settings.rate_hz);
}

std::vector<double> periods_s(const PipelineSettings& settings) {
  std::vector<double> out;
  for (const ReferencePhase& phase : settings.reference.phases)
    out.push_back(settings.control.repetition.period_s.value_or(period_s(phase)));
  return out;
}

/// Of segments that stretch, at this pressure in all chambers; empty where they do not.
SegmentScalars elongation(const PipelineSettings& settings, double pressure_bar) {
  if (!settings.arm.extensible) return {};
  return straight_elongation(settings.arm, settings.actuation, pressure_bar);
}

std::optional<ContactWatch> make_contact_watch(const PipelineSettings& settings) {
  if (settings.estimation.observer != ObserverKind::model) return std::nullopt;
  return ContactWatch(at_rest_length(settings.arm), settings.safety);
}

}  // namespace

ControlPipeline::ControlPipeline(const PipelineSettings& settings)
    : settings_(settings),
      period_ns_(to_ns(1.0 / settings.rate_hz)),
      period_s_(1.0 / settings.rate_hz),
      validator_(settings.estimation, settings.arm,
                 body_noise(settings.estimation, settings.arm.size())),
      filter_(settings.estimation, settings.arm),
      observer_(make_observer(settings)),
      newest_frames_(observer_ ? NewestFrames::most(settings.arm.size(), period_s_) : 0),
      contact_watch_(make_contact_watch(settings)),
      repetition_(make_repetition(settings)),
      periods_s_(periods_s(settings)),
      delay_ns_(observer_ ? to_ns(settings.control.dead_time_s) : 0),
      safety_(settings.safety, period_s_),
      activation_limit_(settings.safety),
      answer_ns_(safety_.thresholds().hold_after_ns + to_ns(settings.control.dead_time_s)),
      reference_(settings.reference, settings.control, settings.arm,
                 elongation(settings, settings.actuation.bias_pressure_bar)),
      hold_(settings.arm.extensible
                ? nullptr
                : std::make_unique<StaticHold>(settings.arm, settings.actuation)),
      law_(settings.control.law.make(
          {settings.arm, settings.control, chamber_count(settings.actuation)})),
      external_(dynamic_cast<ExternalLawInput*>(law_.get())),
      most_force_(most_force(settings.arm, settings.actuation)),
      allocator_(settings.actuation, settings.arm.extensible),
      inverse_(settings.actuator_inverse.any()
                   ? std::make_unique<ActuatorInverse>(
                         settings.arm, settings.actuation, settings.actuator_inverse,
                         settings.control.valve_lag_s, 1.0 / settings.rate_hz)
                   : nullptr),
      elongation_(settings.arm.extensible ? std::make_unique<ElongationReference>(
                                                settings.arm, settings.actuation, allocator_)
                                          : nullptr),
      ramps_(settings.actuation),
      pressure_watch_(settings.safety, allocator_.chambers()),
      command_moves_(settings.actuation),
      frame_period_watch_(settings.safety),
      curvature_watch_(settings.safety, settings.arm),
      oscillation_watch_(settings.safety, period_s_, settings.arm.dof()),
      length_watch_(settings.safety, settings.arm,
                    elongation(settings, settings.actuation.max_pressure_bar)),
      previous_bar_(PressureVector::Zero(allocator_.chambers())),
      previous_tau_nm_(SegmentVector::Zero(settings.arm.dof())),
      commanded_tau_nm_(previous_tau_nm_),
      at_rest_(previous_tau_nm_),
      pressure_at_last_motion_bar_(previous_bar_) {
  if (hold_) reference_.hold_within(*hold_);
  seen_ns_.fill(kNever);
  if (observer_) measured_tau_nm_ = modelled_tau_nm_ = previous_tau_nm_;
  control_.tau_u_nm.setZero(settings.arm.dof());
  control_.tau_actuation_nm.setZero(settings.arm.dof());
  control_.pressure_bar.setZero(allocator_.chambers());
  output_.pressure_bar = previous_bar_;
}

ControlPipeline::~ControlPipeline() = default;

const TickOutput& ControlPipeline::tick(const TickInput& input) noexcept {
  if (!ticked_) epoch_ns_ = input.now_ns;
  if (inverse_ && ticked_)
    inverse_->advance(to_seconds(input.now_ns - previous_ns_), previous_bar_);
  if (input.command_expired || input.paused) forget_command();
  SafetyInput safety;
  validate_and_estimate(input, safety);

  // The command is held over the coming period: it is computed for the middle of it.
  const std::int64_t act_ns = input.now_ns + period_ns_ / 2;
  predict(input.now_ns, act_ns);
  safety.motion_unknown = !output_.motion.all_valid();
  safety.command_expired = input.command_expired && ticked_;
  safety.paused = input.paused && ticked_;
  watch(input, safety);
  if (external_ != nullptr) take_law(input, safety);

  const Mode before = safety_.mode();
  safety.activated_too_often = activation_limit_.reached(input.now_ns, safety_);
  const Mode mode = safety_.step(safety);
  activation_limit_.note(input.now_ns, before, input.requests.arm, safety_);
  if (mode == Mode::active && before != Mode::active) {
    // Frozen or vented for so many good frames the arm is at rest; its measured velocity would only
    // be noise.
    const SegmentVector at_rest = SegmentVector::Zero(settings_.arm.dof());
    reference_.start(seconds(act_ns), output_.motion.u_rad, at_rest);
    if (elongation_) elongation_->start(seconds(act_ns), output_.motion.u_rad);
    law_->reset();
    repeating_phase_ = -1;
    if (inverse_) inverse_->start();
    active_since_ns_ = input.now_ns;
    ++activations_;
  }
  take_reference(input);
  if (mode == Mode::active) {
    reference_.advance(seconds(act_ns));
    control(act_ns);
    oscillation_watch_.judge(window_.now.u, output_.motion.u_rad);
  } else {
    oscillation_watch_.reset();
  }
  limit(mode);
  if (external_ != nullptr) view_for_law(mode, act_ns);
  if (observer_ || inverse_) note_command(input.now_ns);
  pressure_watch_.command(input.now_ns, output_.pressure_bar);
  command_moves_.command(input.now_ns, output_.pressure_bar);
  if (unanswered_since_ns_ == kForever &&
      (previous_bar_ - pressure_at_last_motion_bar_).cwiseAbs().maxCoeff() >
          kFrozenCommandChange_bar)
    unanswered_since_ns_ = input.now_ns;

  output_.mode = mode;
  output_.reason = safety_.reason();
  output_.armed = safety_.armed();
  previous_ns_ = input.now_ns;
  ticked_ = true;
  return output_;
}

/// The valves have vented: pressures rise from zero again, within the slew.
void ControlPipeline::forget_command() noexcept {
  previous_bar_.setZero();
  output_.pressure_bar.setZero();
  pressure_watch_.reset();
  if (inverse_) inverse_->reset();
  if (observer_) observer_->vented();
}

void ControlPipeline::validate_and_estimate(const TickInput& input, SafetyInput& safety) noexcept {
  // After a stop of this process anything may have happened: what is queued is history, not
  // measurement.
  const bool gap =
      ticked_ && (input.paused || input.now_ns - previous_ns_ > safety_.thresholds().vent_after_ns);
  if (gap) {
    validator_.reset();
    filter_.reset();
    if (observer_) observer_->reset();
    pressure_watch_.reset();
    curvature_watch_.reset();
    frame_period_watch_.restart();
    length_watch_.reset();
  }
  const CommandedMotion commanded{command_moves_.began_ns(), settings_.safety.frozen_frames};
  const std::int64_t max_latency_ns = to_ns(settings_.safety.max_latency_s);
  const bool too_many = newest_frames_.too_many(input.frames.size());
  for (const MocapFrame& frame : input.frames) {
    if (gap) break;
    // A capture yet to come would make all after it look old, and its age hide the silence of the
    // sender.
    if (frame.capture_ns < input.now_ns - max_latency_ns || frame.capture_ns > input.now_ns) {
      ++late_frames_;
      ++safety.bad_frames;
      continue;
    }
    const FrameVerdict verdict = validator_.accept(frame, commanded);
    safety.sender_restarted |= verdict == FrameVerdict::sender_restarted;
    if (verdict == FrameVerdict::repeated) continue;
    output_.refusal = verdict;
    if (verdict != FrameVerdict::accepted) {
      ++safety.bad_frames;
      continue;
    }
    use_frame(too_many);
    const auto& seen = validator_.estimate().valid;
    const bool complete = std::all_of(seen.begin(), seen.begin() + settings_.arm.size(),
                                      [](bool each) { return each; });
    ++(complete ? safety.good_frames : safety.bad_frames);
  }
  if (too_many) newest_frames_.take([this](const auto&... kept) { observe(kept...); });
  safety.now_ns = input.now_ns;
  safety.frames_refused = output_.refusal != FrameVerdict::accepted;
  safety.frame_period_mismatch = frame_period_watch_.mismatch();
  safety.newest_capture_ns =
      *std::min_element(seen_ns_.begin(), seen_ns_.begin() + settings_.arm.size());
  safety.poses_frozen = poses_frozen(input.now_ns);
  // In HOLD only while the arm is seen, as what is predicted longer than that is no evidence, and
  // by its bend alone: where it is seen again after a while, the filter takes the way for speed.
  const bool held_and_seen =
      safety_.mode() == Mode::hold && safety.newest_capture_ns != kNever &&
      input.now_ns - safety.newest_capture_ns <= safety_.thresholds().hold_after_ns;
  safety.soft_limit_exceeded = (safety_.mode() == Mode::active && beyond_soft_limit(true)) ||
                               (held_and_seen && beyond_soft_limit(false));
  safety.fully_vented = fully_vented();
  safety.consecutive_overruns = input.consecutive_overruns;
  safety.newest_measurement_ns = input.newest_measurement_ns;
  safety.deadman_used = settings_.safety.deadman;
  safety.newest_go_ns = input.newest_go_ns;
  safety.newest_foreign_ns = input.newest_foreign_ns;
  safety.requests = input.requests;
  output_.soft_limit = safety.soft_limit_exceeded;
  output_.frame_age_s = newest_capture_ns_ == kNever
                            ? std::numeric_limits<double>::quiet_NaN()
                            : to_seconds(input.now_ns - newest_capture_ns_);
}

void ControlPipeline::watch(const TickInput& input, SafetyInput& safety) noexcept {
  if (input.measured_bar != nullptr && input.measured_bar->size() == previous_bar_.size())
    pressure_watch_.measure(*input.measured_bar);
  safety.oscillation = oscillation_watch_.oscillates();
  safety.pressure_mismatch = settings_.safety.valve_readback && pressure_watch_.out_of_tolerance();
  // An arm that is not pressurised yet can wait for a second look.
  const bool waiting = safety_.mode() == Mode::wait_frames;
  safety.length_mismatch = length_watch_.out_of_tolerance() || (waiting && length_watch_.beyond());
  output_.length_warning = length_watch_.warns();
  if (observer_) watch_contact(input, safety);
  if (!curvature_watch_.used()) return;
  // What is judged is the balance of an arm that is observed and commanded.
  const bool under_control = safety_.mode() == Mode::active || safety_.mode() == Mode::hold;
  if (under_control && !safety.motion_unknown) {
    allocator_.torque(previous_bar_, previous_tau_nm_);
    curvature_watch_.judge(input.now_ns, output_.motion.u_rad, previous_tau_nm_);
  } else {
    curvature_watch_.reset();
  }
  safety.curvature_mismatch = curvature_watch_.out_of_tolerance();
}

/// Judged where the arm is under control: elsewhere the disturbance is all that the model lacks.
void ControlPipeline::watch_contact(const TickInput& input, SafetyInput& safety) noexcept {
  output_.wrong_model = observer_->running() && observer_->wrong_model();
  const bool under_control = safety_.mode() == Mode::active || safety_.mode() == Mode::hold;
  if (!under_control || !output_.wrong_model) {
    wrong_model_since_ns_ = kNever;
  } else if (wrong_model_since_ns_ == kNever) {
    wrong_model_since_ns_ = input.now_ns;
  }
  const double settling_s = settings_.safety.wrong_model_settling_s;
  safety.wrong_model = settling_s > 0.0 && wrong_model_since_ns_ != kNever &&
                       input.now_ns - wrong_model_since_ns_ >= to_ns(settling_s);
  if (!under_control) contact_watch_->reset();
  if (settings_.safety.valve_readback && under_control && input.measured_bar != nullptr &&
      input.measured_bar->size() == previous_bar_.size()) {
    constexpr double kMemory_s = 0.03;  // that of the disturbance after a jump
    allocator_.torque(*input.measured_bar, measured_tau_nm_);
    observer_->modelled_torque(input.now_ns, modelled_tau_nm_);
    const bool stretches = settings_.arm.extensible;
    if (stretches)
      modelled_tau_nm_ =
          coordinates(settings_.arm, modelled_tau_nm_, SegmentScalars::Zero(settings_.arm.size()));
    measured_tau_nm_ -= modelled_tau_nm_;
    apply_actuation(settings_.arm, output_.motion.u_rad, measured_tau_nm_, modelled_tau_nm_);
    if (stretches) modelled_tau_nm_ = bend_part(settings_.arm, modelled_tau_nm_);
    if (missing_nm_.size() == 0) missing_nm_.setZero(modelled_tau_nm_.size());
    missing_nm_ += std::min(1.0, period_s_ / kMemory_s) * (modelled_tau_nm_ - missing_nm_);
  }
  output_.contact = contact_watch_->contact();
  const ContactReaction reaction = settings_.safety.contact_reaction;
  safety.contact_holds = output_.contact && reaction == ContactReaction::hold;
  safety.contact_vents = output_.contact && reaction == ContactReaction::vent;
}

/// What (17) compensates: nothing that pushes, where the arm is to yield.
const ModelCorrection* ControlPipeline::correction() noexcept {
  if (output_.observer == nullptr) return nullptr;
  const ModelCorrection& found = output_.observer->correction();
  if (!output_.contact || settings_.safety.contact_reaction != ContactReaction::yield)
    return &found;
  yielding_ = found;
  yielding_.disturbance_nm = contact_watch_->slow_disturbance_nm();
  return &yielding_;
}

/// With what repeats along the reference, as far ahead as is configured.
const ModelCorrection* ControlPipeline::ahead(const ModelCorrection* found,
                                              std::int64_t at_ns) noexcept {
  if (!repetition_) return found;
  if (found == nullptr) {  // the observer starts again, and so does this
    repeating_phase_ = -1;
    return nullptr;
  }
  const Reference::Place place = reference_.place(seconds(at_ns));
  if (place.phase != repeating_phase_)
    repetition_->start(periods_s_[static_cast<std::size_t>(place.phase)]);
  repeating_phase_ = place.phase;
  ahead_ = *found;
  const bool learn = !output_.saturated && !output_.contact && !output_.observer->surprised();
  repetition_->advance(place.since_s, learn, ahead_);
  return &ahead_;
}

/// Of the newest accepted frame. The filter takes every frame, the observer, which costs more, those
/// of a tick that are not `too_many`.
void ControlPipeline::use_frame(bool too_many) noexcept {
  const MocapFrame& frame = validator_.newest();
  const CurvatureEstimate& estimate = validator_.estimate();
  for (int i = 0; i < settings_.arm.size(); ++i)
    if (estimate.valid[static_cast<std::size_t>(i)])
      seen_ns_[static_cast<std::size_t>(i)] = frame.capture_ns;
  frame_period_watch_.frame(frame.capture_ns);
  if (validator_.identical_in_row() == 0) {
    pressure_at_last_motion_bar_ = previous_bar_;
    unanswered_since_ns_ = kForever;
  }
  newest_capture_ns_ = frame.capture_ns;
  output_.frame_number = frame.frame_number;
  const BodyPose& tip = frame.body[static_cast<std::size_t>(settings_.arm.size())];
  if (tip.valid) reference_.measure_tip(seconds(frame.capture_ns), tip.position_m);

  // Under control the arm is expected to follow its commands; the filter then smooths only the
  // deviation.
  const bool expects = safety_.mode() == Mode::active;
  if (expects) expect(frame.capture_ns);
  const KnownMotion* const expected = expects ? &known_ : nullptr;
  filter_.update(frame.capture_ns, estimate, expected);
  length_watch_.judge(frame.capture_ns, estimate, expects && elongation_ ? &known_.u_rad : nullptr);
  if (!observer_) return;
  if (too_many) {
    newest_frames_.keep(frame, estimate, expected);
  } else {
    observe(frame, estimate, expected);
  }
}

void ControlPipeline::observe(const MocapFrame& frame, const CurvatureEstimate& estimate,
                              const KnownMotion* expected) noexcept {
  const bool learn = !output_.saturated && !contact_watch_->contact();
  observer_->update(frame, estimate, expected, learn);
  if (expected != nullptr || safety_.mode() == Mode::hold)
    contact_watch_->judge(frame.capture_ns, *observer_, missing_nm_);
}

void ControlPipeline::predict(std::int64_t now_ns, std::int64_t at_ns) noexcept {
  const bool expects = safety_.mode() == Mode::active;
  output_.observer = nullptr;
  if (observer_) {
    observer_->predict(now_ns, at_ns, output_.motion);
    if (observer_->running()) {
      output_.observer = observer_.get();
      return;
    }
  }
  if (expects) expect(at_ns);
  filter_.predict(at_ns, output_.motion, expects ? &known_ : nullptr);
}

void ControlPipeline::expect(std::int64_t at_ns) noexcept {
  reference_.sample(seconds(at_ns), window_.now);
  if (elongation_) elongation_->replace(seconds(at_ns), window_.now);
  known_ = {window_.now.u, window_.now.velocity, window_.now.acceleration, activations_};
}

LawVerdict ControlPipeline::judge(const LawInput& law, std::int64_t now_ns) noexcept {
  if (law.state_ns == kNever || law.state_ns > now_ns) return LawVerdict::not_recent;
  const std::int64_t longest_ns = to_ns(settings_.safety.law_validity_s);
  const std::int64_t validity_ns = std::clamp<std::int64_t>(law.validity_ns, 0, longest_ns);
  if (now_ns - law.state_ns >= validity_ns) return LawVerdict::expired;
  const ActuationSettings& actuation = settings_.actuation;
  if (!law.values.allFinite()) return LawVerdict::not_finite;
  if (law.answer == LawAnswer::pressures) {
    const double rounding =
        kPressureRounding * (actuation.max_pressure_bar - actuation.min_pressure_bar);
    if (law.values.size() > 0 && (law.values.minCoeff() < actuation.min_pressure_bar - rounding ||
                                  law.values.maxCoeff() > actuation.max_pressure_bar + rounding))
      return LawVerdict::out_of_limits;
  } else if (law.values.size() == most_force_.size() &&
             (law.values.array().abs() > most_force_.array()).any()) {
    return LawVerdict::out_of_limits;
  }
  const LawVerdict verdict = external_->take(law.answer, law.values);
  if (verdict != LawVerdict::accepted) return verdict;
  law_until_ns_ = law.state_ns + validity_ns;
  output_.law_round_trip_s = to_seconds(law.arrival_ns - law.state_ns);
  return LawVerdict::accepted;
}

void ControlPipeline::take_law(const TickInput& input, SafetyInput& safety) noexcept {
  if (input.law != nullptr)
    ++law_counts_[static_cast<std::size_t>(judge(*input.law, input.now_ns))];
  safety.law_used = true;
  safety.law_until_ns = law_until_ns_;
}

/// The answer comes for the next tick at the earliest, and acts in the middle of its period.
void ControlPipeline::view_for_law(Mode mode, std::int64_t act_ns) noexcept {
  output_.law = nullptr;
  if (!output_.motion.all_valid()) return;
  const bool active = mode == Mode::active;
  const std::int64_t at_ns = act_ns + period_ns_;
  if (active) {
    const std::int64_t ahead_ns = output_.observer != nullptr ? delay_ns_ : 0;
    reference_.sample(seconds(at_ns + ahead_ns), law_view_.reference);
  }
  if (output_.observer != nullptr) {
    law_view_.u_rad = output_.motion.u_rad + period_s_ * output_.motion.velocity_radps;
    law_view_.velocity_radps = output_.motion.velocity_radps;
  } else {
    const ReferenceSample& known = law_view_.reference;
    known_ = {known.u, known.velocity, known.acceleration, activations_};
    filter_.predict(at_ns, law_motion_, active ? &known_ : nullptr);
    law_view_.u_rad = law_motion_.u_rad;
    law_view_.velocity_radps = law_motion_.velocity_radps;
  }
  if (!active) {
    law_view_.reference.u = law_view_.u_rad;
    law_view_.reference.velocity.setZero(law_view_.u_rad.size());
    law_view_.reference.acceleration.setZero(law_view_.u_rad.size());
  }
  law_view_.active_s = active ? to_seconds(at_ns - active_since_ns_) : 0.0;
  output_.law = &law_view_;
}

void ControlPipeline::take_reference(const TickInput& input) noexcept {
  output_.reference_limited = false;
  if (safety_.mode() != Mode::active) return;
  const double now_s = seconds(input.now_ns);
  if (input.reference != nullptr)
    note_reference(reference_.receive(now_s, input.reference->u, input.reference->velocity,
                                      input.reference->acceleration));
  if (input.tip_target != nullptr)
    note_reference(reference_.receive_tip(now_s, input.tip_target->position_m,
                                          input.tip_target->velocity_mps));
}

void ControlPipeline::note_reference(LiveVerdict verdict) noexcept {
  ++reference_counts_[static_cast<std::size_t>(verdict)];
  output_.reference_limited |= verdict != LiveVerdict::accepted && verdict != LiveVerdict::not_live;
}

void ControlPipeline::control(std::int64_t act_ns) noexcept {
  const std::int64_t ahead_ns = output_.observer != nullptr ? delay_ns_ : 0;
  double lookahead_s = law_->lookahead_s();
  if (elongation_) lookahead_s = std::max(lookahead_s, ElongationReference::kLookahead_s);
  reference_.window(seconds(act_ns + ahead_ns), lookahead_s, window_);
  const ModelCorrection* const found = ahead(correction(), act_ns + ahead_ns);
  if (elongation_) {
    const DisturbanceRejection use = settings_.control.disturbance;
    elongation_->advance(seconds(act_ns + ahead_ns), lookahead_s, window_,
                         use == DisturbanceRejection::none ? nullptr : found,
                         use == DisturbanceRejection::cancel);
  }
  const LawState state{output_.motion.u_rad, output_.motion.velocity_radps, found};
  control_.answer = LawAnswer::force;
  control_.bounded = false;
  law_->compute(state, window_, control_);
  if (elongation_) elongation_->hold_constant_lengths(control_.tau_actuation_nm);
  allocate();
  law_->applied(period_s_, state, window_.now, allocation_.scale);
  if (ahead_ns > 0) {
    reference_.sample(seconds(act_ns), window_.now);
    if (elongation_) elongation_->replace(seconds(act_ns), window_.now);
  }
  output_.reference = window_.now;
  output_.reference_limited |= window_.now.limited;
  output_.tau_actuation_nm = control_.tau_actuation_nm;
  output_.bounded = control_.bounded;
  output_.saturated = allocation_.saturated;
}

void ControlPipeline::allocate() noexcept {
  if (control_.answer == LawAnswer::pressures) {
    allocation_.pressures_bar = control_.pressure_bar;
    allocation_.scale.setOnes(settings_.arm.size());
    allocation_.saturated = false;
    control_.tau_actuation_nm.resize(settings_.arm.dof());
    allocator_.torque(control_.pressure_bar, control_.tau_actuation_nm);
    return;
  }
  if (control_.answer == LawAnswer::force)
    solve_actuation(settings_.arm, output_.motion.u_rad, control_.tau_u_nm,
                    control_.tau_actuation_nm);
  if (inverse_) {
    const ActuatorInverse::Motion motion{output_.motion.u_rad, window_.now.u, window_.now.velocity};
    inverse_->allocate(allocator_, control_.tau_actuation_nm, motion, allocation_);
  } else {
    allocator_.allocate(control_.tau_actuation_nm, allocation_);
  }
}

/// What the observer takes for the command: of an arm whose actuators are inverted, that of the
/// linear ones that do the same.
void ControlPipeline::note_command(std::int64_t now_ns) noexcept {
  if (inverse_) {
    const bool follows = safety_.mode() == Mode::active;
    const ActuatorInverse::Motion motion{output_.motion.u_rad,
                                         follows ? window_.now.u : output_.motion.u_rad,
                                         follows ? window_.now.velocity : at_rest_};
    inverse_->sent(allocator_, output_.pressure_bar, motion, commanded_tau_nm_);
    if (inverse_->learns() && output_.observer != nullptr)
      inverse_->learn(allocator_, output_.motion.u_rad,
                      output_.observer->correction().disturbance_nm,
                      follows && !output_.saturated && !output_.contact);
  } else {
    allocator_.torque(output_.pressure_bar, commanded_tau_nm_);
  }
  if (observer_) observer_->command(now_ns, commanded_tau_nm_);
}

void ControlPipeline::limit(Mode mode) noexcept {
  output_.slew_limited = false;
  switch (mode) {
    case Mode::active:
      ramps_.limit(previous_bar_, allocation_.pressures_bar, period_s_, output_.pressure_bar);
      output_.slew_limited = output_.pressure_bar != allocation_.pressures_bar;
      break;
    case Mode::hold:
      break;
    case Mode::init:
    case Mode::wait_frames:
    case Mode::vent:
    case Mode::fault:
      ramps_.vent(previous_bar_, period_s_, output_.pressure_bar);
      break;
  }
  if (mode != Mode::active) {
    output_.saturated = output_.bounded = false;
    output_.reference.u.resize(0);
    output_.tau_actuation_nm.resize(0);
  }
  previous_bar_ = output_.pressure_bar;
}

void ControlPipeline::report(ObserverReport& out) const noexcept {
  if (!observer_) return;
  observer_->report(out);
  out.force_n = contact_watch_->force_n();
  out.force_covariance_n2 = contact_watch_->covariance_n2();
  out.contact = contact_watch_->contact();
  out.pressure_loss = contact_watch_->pressure_loss();
}

bool ControlPipeline::poses_frozen(std::int64_t now_ns) const noexcept {
  const int frozen = settings_.safety.frozen_frames;
  return frozen > 0 && validator_.identical_in_row() >= frozen &&
         unanswered_since_ns_ != kForever && now_ns - unanswered_since_ns_ >= answer_ns_;
}

bool ControlPipeline::beyond_soft_limit(bool speed_too) const noexcept {
  const FilteredMotion& motion = output_.motion;
  const int width = settings_.arm.segment_dof();
  for (int i = 0; i < motion.segments; ++i) {
    if (motion.u_rad.segment<2>(width * i).norm() >
            kSoftLimitMargin * settings_.control.max_theta_rad ||
        (speed_too && motion.velocity_radps.segment<2>(width * i).norm() >
                          kSoftLimitMargin * settings_.control.max_speed_radps))
      return true;
  }
  return false;
}

}  // namespace softarm
