#include "softarm/control/reference.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "control/blend.hpp"
#include "control/soft_limit.hpp"
#include "control/task_space_tracker.hpp"
#include "softarm/control/reach.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

constexpr double kShortestLive = 0.05;  ///< s, for a live reference that is corrected a little

double largest_norm(const SegmentVector& v, Eigen::Index width) noexcept {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < v.size(); i += width) {
    largest = std::max(largest, std::hypot(v[i], v[i + 1]));
  }
  return largest;
}

void resize(ReferenceSample& sample, int dof) noexcept {
  sample.u.resize(dof);
  sample.velocity.resize(dof);
  sample.acceleration.resize(dof);
  sample.has_polar = false;
  sample.limited = false;
  sample.has_tip = false;
}

void check_phase(int phase, const ReferenceKind& kind, const ControllerSettings& control,
                 int segments) {
  const ReferencePlace place{phase};
  kind.check(place, control, segments);
  place.require(kind.largest_theta_rad() <= control.max_theta_rad,
                fmt::format("theta within control.max_theta_rad ({} rad)", control.max_theta_rad),
                fmt::format("up to {:.6g} rad", kind.largest_theta_rad()));
  place.require(
      kind.largest_speed_radps() <= control.max_speed_radps,
      fmt::format("speeds within control.max_speed_radps ({} rad/s)", control.max_speed_radps),
      fmt::format("up to {:.4g} rad/s; give it more time", kind.largest_speed_radps()));
}

}  // namespace

const char* name(LiveVerdict verdict) noexcept {
  constexpr std::array kNames{"accepted",     "not_live",      "wrong_size",
                              "not_finite",   "out_of_limits", "step_too_large",
                              "out_of_order", "unreachable",   "not_held"};
  static_assert(kNames.size() == static_cast<std::size_t>(kLiveVerdicts));
  const auto index = static_cast<std::size_t>(verdict);
  return index < kNames.size() ? kNames[index] : "unknown";
}

double largest_theta_rad(const ReferenceSettings& settings) noexcept {
  double theta = 0.0;
  for (const ReferencePhase& phase : settings.phases) {
    theta = std::max(theta, phase.kind.largest_theta_rad());
  }
  return theta;
}

bool whole_periods(double time_s, double period_s) noexcept {
  constexpr double kRounding = 1e-6;
  const double periods = time_s / period_s;
  return periods > 0.5 && std::abs(periods - std::round(periods)) <= kRounding * periods;
}

double period_s(const ReferencePhase& phase) noexcept {
  const ElongationPath& path = phase.elongation;
  const double own_s = phase.kind.period_s();
  if (path.amplitude_m == 0.0 || path.rate_radps == 0.0) return own_s;
  return whole_periods(own_s, 2.0 * std::numbers::pi / std::abs(path.rate_radps)) ? own_s : 0.0;
}

struct Reference::State {
  /// The latest message of a live phase; its times count from the beginning of the phase.
  struct Message {
    bool received = false;
    double time_s = 0.0;
    SegmentVector u, velocity, acceleration;
    Blend rest;  ///< back to u once messages stop
  };
  struct Phase {
    ReferenceKind kind;
    ElongationPath elongation;
    bool live = false;
    double timeout_s = 0.0;  ///< of a live phase
    double begin_s = 0.0;
    double peak_speed_radps = 0.0;
    Blend join;
    Message message;
    std::optional<TaskSpaceTracker> tracker;  ///< where the phase is in task space
    double max_tip_speed_mps = 0.0;           ///< of a live target
  };

  ArmParameters arm;
  int dof = 0;
  Eigen::Index width = 2;    ///< coordinates of a segment
  SegmentScalars natural_m;  ///< elongation where a phase asks for none
  ControllerSettings control;
  std::vector<Phase> phases;
  bool started = false;
  double start_s = 0.0;
  int entered = 0;  ///< phases in task space begin and end when advance() says so
  bool tip_seen = false;
  double tip_time_s = 0.0;
  Eigen::Vector3d tip_m = Eigen::Vector3d::Zero();
  ReferenceSample from, to;  ///< scratch
  SegmentVector offset, offset_rate, zero;
  HoldLimits* hold = nullptr;
  SegmentVector bend;                   ///< scratch: what can be held
  std::optional<TipSearch> tip_search;  ///< where a phase takes live targets of the tip

  const Phase& at(double time_s, int& index) const noexcept;
  void curve(const Phase& phase, double time_s, ReferenceSample& out) const noexcept;
  void add_elongation(const Phase& phase, double time_s, ReferenceSample& out) const noexcept;
  double norm(const SegmentVector& v) const noexcept { return largest_norm(v, width); }
  void unlimited(int index, double time_s, ReferenceSample& out) const noexcept;
  double blend_duration(const SegmentVector& d, double peak_speed_radps) const noexcept;
  void join(int index) noexcept;
  void join_following(int index) noexcept;
  void join_message(Phase& phase, double time_s) noexcept;
  bool can_be_held(const SegmentVector& u) noexcept;
};

const Reference::State::Phase& Reference::State::at(double time_s, int& index) const noexcept {
  const auto phase = [this](int i) -> const Phase& { return phases[static_cast<std::size_t>(i)]; };
  int last = entered;
  const int count = static_cast<int>(phases.size());
  while (last + 1 < count && !phase(last).tracker && !phase(last + 1).tracker) ++last;
  index = last;
  while (index > 0 && time_s < phase(index).begin_s) --index;
  return phase(index);
}

// The phase's own curve at a time since its beginning.
void Reference::State::curve(const Phase& phase, double time_s,
                             ReferenceSample& out) const noexcept {
  if (!phase.tracker && !phase.live) {
    resize(out, 2 * arm.size());
    phase.kind.evaluate(time_s, out);
    if (arm.extensible) add_elongation(phase, time_s, out);
    return;
  }
  resize(out, dof);
  if (phase.tracker) return phase.tracker->sample(phase.begin_s + time_s, out);
  const Message& message = phase.message;
  const double age = std::max(time_s - message.time_s, 0.0);
  out.u = message.u;
  out.velocity.setZero();
  out.acceleration.setZero();
  if (!message.received) return;
  if (age < phase.timeout_s) {
    out.u += age * message.velocity + 0.5 * age * age * message.acceleration;
    out.velocity = message.velocity + age * message.acceleration;
    out.acceleration = message.acceleration;
  } else {
    message.rest.add(time_s, out);
  }
}

// From [u_x, u_y] of every segment to [u_x, u_y, e].
void Reference::State::add_elongation(const Phase& phase, double time_s,
                                      ReferenceSample& out) const noexcept {
  const auto spread = [this](SegmentVector& v) {
    v.conservativeResize(dof);  // storage in place
    for (Eigen::Index i = arm.size(); i-- > 0;) {
      v[3 * i + 1] = v[2 * i + 1];
      v[3 * i] = v[2 * i];
      v[3 * i + 2] = 0.0;
    }
  };
  for (SegmentVector* v : {&out.u, &out.velocity, &out.acceleration}) spread(*v);
  for (Eigen::Index i = 0; i < arm.size(); ++i) {
    if (arm.segments[static_cast<std::size_t>(i)].constant_length) continue;
    const ElongationPath& path = phase.elongation;
    const double rate = path.rate_radps, angle = rate * time_s;
    out.u[3 * i + 2] = path.mean_m.value_or(natural_m[i]) + path.amplitude_m * std::sin(angle);
    out.velocity[3 * i + 2] = path.amplitude_m * rate * std::cos(angle);
    out.acceleration[3 * i + 2] = -path.amplitude_m * rate * rate * std::sin(angle);
  }
}

void Reference::State::unlimited(int index, double time_s, ReferenceSample& out) const noexcept {
  const Phase& phase = phases[static_cast<std::size_t>(index)];
  const double local = time_s - phase.begin_s;
  curve(phase, local, out);
  if (phase.join.active(local)) {
    phase.join.add(local, out);
    out.has_polar = false;
  }
}

double Reference::State::blend_duration(const SegmentVector& d, double peak) const noexcept {
  const double speed = std::max(control.max_speed_radps - peak, 0.25 * control.max_speed_radps);
  return std::max({control.blend_s, kQuinticPeakSpeed * norm(d) / speed, 1e-3});
}

// Joins phase `index` to `from` (u, velocity), what the reference is just before it.
void Reference::State::join(int index) noexcept {
  Phase& phase = phases[static_cast<std::size_t>(index)];
  if (phase.tracker) {
    // The tip was measured a little ago: so the model's tip is taken then, too.
    offset = from.u - std::max(start_s + phase.begin_s - tip_time_s, 0.0) * from.velocity;
    const Eigen::Vector3d off =
        tip_seen ? (tip_m - tip_position(arm, offset)).eval() : Eigen::Vector3d::Zero();
    return phase.tracker->start(phase.begin_s, from.u, from.velocity, off);
  }
  if (phase.live) {
    phase.message.received = false;
    phase.message.u = from.u;
    for (Eigen::Index i = 0; i < natural_m.size(); ++i) phase.message.u[3 * i + 2] = natural_m[i];
    phase.message.time_s = 0.0;
  }
  phase.join.clear();
  curve(phase, 0.0, to);
  offset = from.u - to.u;
  offset_rate = from.velocity - to.velocity;
  phase.join.set(0.0, blend_duration(offset, phase.peak_speed_radps), offset, offset_rate, zero);
}

// Joins what follows phase `index` and is known beforehand.
void Reference::State::join_following(int index) noexcept {
  for (std::size_t i = static_cast<std::size_t>(index) + 1; i < phases.size(); ++i) {
    if (phases[i - 1].tracker || phases[i].tracker) return;
    unlimited(static_cast<int>(i) - 1, phases[i].begin_s, from);
    join(static_cast<int>(i));
  }
}

// The message in `to` (u, velocity, acceleration) takes over from the curve in `from`. What the
// earlier blend still has to do goes on as it would have; what the message adds takes the time that
// keeps accelerations those of a full step in blend_s.
void Reference::State::join_message(Phase& phase, double time_s) noexcept {
  offset = from.u - to.u;
  offset_rate = from.velocity - to.velocity;
  const double acceleration =
      control.max_step_rad / std::max(control.blend_s * control.blend_s, 1e-6);
  double duration = std::max({phase.join.remaining_s(time_s), kShortestLive,
                              std::sqrt(norm(offset) / acceleration),
                              std::min(norm(offset_rate) / acceleration, control.blend_s),
                              kQuinticPeakSpeed * norm(offset) / (0.5 * control.max_speed_radps)});
  from.u = offset;
  from.velocity = offset_rate;
  from.acceleration -= to.acceleration;
  phase.join.add(time_s, from);
  phase.join.set(time_s, duration, from.u, from.velocity, from.acceleration);

  Message& message = phase.message;
  message.received = true;
  message.time_s = time_s;
  message.u = to.u;
  message.velocity = to.velocity;
  message.acceleration = to.acceleration;
  const double timeout = phase.timeout_s;
  offset = timeout * to.velocity + 0.5 * timeout * timeout * to.acceleration;
  offset_rate = to.velocity + timeout * to.acceleration;
  message.rest.set(time_s + timeout, blend_duration(offset, 0.0), offset, offset_rate,
                   to.acceleration);
}

bool Reference::State::can_be_held(const SegmentVector& u) noexcept {
  if (hold == nullptr) return true;
  constexpr double kRounding = 1e-9;
  hold->largest_bend(u, bend);
  for (Eigen::Index i = 0; i < bend.size(); ++i)
    if (u.segment<2>(2 * i).norm() > bend[i] + kRounding) return false;
  return true;
}

Reference::Reference(const ReferenceSettings& settings, const ControllerSettings& control,
                     int segments)
    : Reference(settings, control, [&] {
        for (const ReferencePhase& phase : settings.phases) {
          if (phase.kind.is_tip_path()) {
            throw std::invalid_argument(
                "reference: expected an arm for a path of the tip, got none");
          }
        }
        ArmParameters arm;
        arm.segments.resize(static_cast<std::size_t>(std::max(segments, 0)));
        return arm;
      }()) {}

Reference::Reference(const ReferenceSettings& settings, const ControllerSettings& control,
                     const ArmParameters& arm, const SegmentScalars& natural_elongation_m)
    : state_(std::make_unique<State>()) {
  const int segments = arm.size();
  if (arm.extensible && segments > kMaxStretchingSegments) {
    throw std::invalid_argument(
        fmt::format("reference: expected up to {} segments that stretch, got {}",
                    kMaxStretchingSegments, segments));
  }
  state_->width = arm.segment_dof();
  if (arm.extensible) {
    state_->natural_m = natural_elongation_m;
    if (natural_elongation_m.size() != segments) state_->natural_m.setZero(segments);
  }
  if (segments < 1 || segments > kMaxSegments) {
    throw std::invalid_argument(
        fmt::format("reference: expected 1 to {} segments, got {}", kMaxSegments, segments));
  }
  if (settings.phases.empty()) {
    throw std::invalid_argument("reference: expected at least one phase, got none");
  }
  if (!(control.max_theta_rad > 0.0) || !(control.max_speed_radps > 0.0) ||
      !(control.max_step_rad > 0.0) || !(control.blend_s >= 0.0)) {
    throw std::invalid_argument(fmt::format(
        "reference: expected max_theta_rad, max_speed_radps, max_step_rad > 0 and blend_s >= 0, "
        "got {}, {}, {} and {}",
        control.max_theta_rad, control.max_speed_radps, control.max_step_rad, control.blend_s));
  }
  state_->arm = arm;
  state_->dof = arm.dof();
  state_->control = control;
  double begin = 0.0;
  for (std::size_t i = 0; i < settings.phases.size(); ++i) {
    const ReferencePhase& phase = settings.phases[i];
    check_phase(static_cast<int>(i), phase.kind, control, segments);
    const bool last = i + 1 == settings.phases.size();
    if (!last && !(std::isfinite(phase.duration_s) && phase.duration_s > 0.0)) {
      throw ReferenceError(static_cast<int>(i), ".duration_s", "a duration (s) > 0",
                           fmt::format("{}", phase.duration_s));
    }
    State::Phase made;
    made.kind = phase.kind;
    made.elongation = phase.elongation;
    made.begin_s = begin;
    if (const auto* live = phase.kind.get_if<LiveReference>()) {
      made.live = true;
      made.timeout_s = live->timeout_s;
    }
    if (const auto* live = phase.kind.get_if<LiveTipReference>()) {
      made.max_tip_speed_mps = live->max_speed_mps;
      if (!state_->tip_search) state_->tip_search.emplace(arm, control.max_theta_rad, std::nullopt);
    }
    made.peak_speed_radps = phase.kind.largest_speed_radps();
    made.join.resize(state_->dof);
    made.message.u.setZero(state_->dof);
    made.message.velocity.setZero(state_->dof);
    made.message.acceleration.setZero(state_->dof);
    made.message.rest.resize(state_->dof);
    if (phase.kind.is_tip_path()) made.tracker.emplace(arm, control, phase.kind, state_->natural_m);
    state_->phases.push_back(std::move(made));
    begin += phase.duration_s;
  }
  state_->zero.setZero(state_->dof);
  state_->bend.setZero(segments);
  state_->offset.setZero(state_->dof);
  state_->offset_rate.setZero(state_->dof);
  resize(state_->from, state_->dof);
  resize(state_->to, state_->dof);
}

Reference::~Reference() = default;
Reference::Reference(Reference&&) noexcept = default;
Reference& Reference::operator=(Reference&&) noexcept = default;

bool Reference::started() const noexcept { return state_->started; }

void Reference::start(double time_s, ConstVectorRef u, ConstVectorRef velocity) noexcept {
  State& s = *state_;
  s.started = true;
  s.start_s = time_s;
  s.entered = 0;
  s.from.u = u;
  s.from.velocity = velocity;
  s.join(0);
  s.join_following(0);
}

void Reference::advance(double time_s) noexcept {
  State& s = *state_;
  if (!s.started) return;
  const double time = time_s - s.start_s;
  for (std::size_t next = static_cast<std::size_t>(s.entered) + 1;
       next < s.phases.size() && time >= s.phases[next].begin_s; ++next) {
    State::Phase &ends = s.phases[next - 1], &begins = s.phases[next];
    if (ends.tracker) ends.tracker->advance(begins.begin_s);
    if (ends.tracker || begins.tracker) {
      s.unlimited(s.entered, begins.begin_s, s.from);
      s.join(static_cast<int>(next));
      s.join_following(static_cast<int>(next));
    }
    s.entered = static_cast<int>(next);
  }
  State::Phase& now = s.phases[static_cast<std::size_t>(s.entered)];
  if (now.tracker) now.tracker->advance(time);
}

void Reference::measure_tip(double time_s, const Eigen::Vector3d& tip_m) noexcept {
  State& s = *state_;
  s.tip_seen = true;
  s.tip_time_s = time_s;
  s.tip_m = tip_m;
  State::Phase& now = s.phases[static_cast<std::size_t>(s.entered)];
  if (s.started && now.tracker) now.tracker->measure(time_s - s.start_s, tip_m);
}

void Reference::sample(double time_s, ReferenceSample& out) const noexcept {
  const State& s = *state_;
  const double time = std::max(time_s - s.start_s, 0.0);
  int index;
  s.at(time, index);
  s.unlimited(index, time, out);
  if (bend_inside(s.control.max_theta_rad, s.width, out)) {
    out.limited = true;
    out.has_polar = false;
  }
  if (s.norm(out.velocity) > s.control.max_speed_radps * (1.0 + 1e-9)) out.limited = true;
}

Reference::Place Reference::place(double time_s) const noexcept {
  Place out{};
  const double local_s = std::max(time_s - state_->start_s, 0.0);
  out.since_s = local_s - state_->at(local_s, out.phase).begin_s;
  return out;
}

void Reference::window(double time_s, double lookahead_s, ReferenceWindow& out) const noexcept {
  sample(time_s, out.now);
  out.interval_s = 0.0;
  if (!(lookahead_s > 0.0)) return;
  // Neither over the start nor over the latest message: what was before belongs to another curve.
  const State& s = *state_;
  int index;
  const State::Phase& phase = s.at(std::max(time_s - s.start_s, 0.0), index);
  double earliest = s.start_s;
  if (phase.message.received) earliest += phase.begin_s + phase.message.time_s;
  if (phase.tracker) earliest += phase.begin_s;
  const double before = std::max(time_s - lookahead_s, std::min(earliest, time_s));
  sample(before, out.before);
  sample(time_s + lookahead_s, out.after);
  out.interval_s = time_s + lookahead_s - before;
}

LiveVerdict Reference::receive(double time_s, ConstVectorRef u, ConstVectorRef velocity,
                               ConstVectorRef acceleration) noexcept {
  State& s = *state_;
  const double time = time_s - s.start_s;
  int index;
  s.at(time, index);
  State::Phase& phase = s.phases[static_cast<std::size_t>(index)];
  if (!s.started || time < 0.0 || !phase.live) return LiveVerdict::not_live;
  const Eigen::Index bends = 2 * s.arm.size();
  if (u.size() != bends || velocity.size() != bends || acceleration.size() != bends) {
    return LiveVerdict::wrong_size;
  }
  if (!u.allFinite() || !velocity.allFinite() || !acceleration.allFinite()) {
    return LiveVerdict::not_finite;
  }
  resize(s.to, static_cast<int>(bends));
  s.to.u = u;
  s.to.velocity = velocity;
  s.to.acceleration = acceleration;
  if (s.arm.extensible) s.add_elongation(phase, time - phase.begin_s, s.to);
  s.offset_rate = s.to.velocity + phase.timeout_s * s.to.acceleration;
  const double max_speed = s.control.max_speed_radps;
  if (s.norm(s.to.u) > s.control.max_theta_rad || s.norm(s.to.velocity) > max_speed ||
      s.norm(s.offset_rate) > max_speed) {
    return LiveVerdict::out_of_limits;
  }
  if (!s.can_be_held(s.to.u)) return LiveVerdict::not_held;
  const double local = time - phase.begin_s;
  s.curve(phase, local, s.from);
  s.offset = s.from.u - s.to.u;
  if (s.norm(s.offset) > s.control.max_step_rad) return LiveVerdict::step_too_large;
  s.join_message(phase, local);
  s.join_following(index);
  return LiveVerdict::accepted;
}

LiveVerdict Reference::receive_tip(double time_s, const Eigen::Vector3d& position_m,
                                   const Eigen::Vector3d& velocity_mps) noexcept {
  constexpr double kNearEnough = 0.01;  // of the arm's length: what the model is off by anyway
  State& s = *state_;
  const double time = time_s - s.start_s;
  State::Phase& phase = s.phases[static_cast<std::size_t>(s.entered)];
  if (!s.started || time < 0.0 || !phase.tracker || !phase.tracker->live())
    return LiveVerdict::not_live;
  if (!position_m.allFinite() || !velocity_mps.allFinite()) return LiveVerdict::not_finite;
  if (velocity_mps.norm() > phase.max_tip_speed_mps) return LiveVerdict::out_of_limits;
  const double near_m = kNearEnough * phase.tracker->reach_m();
  if ((position_m - s.arm.base_position_m).norm() > phase.tracker->reach_m() + near_m)
    return LiveVerdict::unreachable;
  TipSearch& search = *s.tip_search;
  search.begin(position_m, phase.tracker->u_rad());
  for (const double part : {0.0, 0.3, 0.8, -0.3}) {
    const int left = (kTipSearchSteps - search.steps()) / 2;
    part == 0.0 ? search.search(phase.tracker->u_rad(), left) : search.search_from_arc(part, left);
  }
  if (search.distance_m() > near_m) return LiveVerdict::unreachable;
  if (!s.can_be_held(search.u_rad())) return LiveVerdict::not_held;
  phase.tracker->retarget(time, position_m, velocity_mps);
  return LiveVerdict::accepted;
}

void Reference::hold_within(HoldLimits& limits) noexcept {
  State& s = *state_;
  s.hold = &limits;
  if (s.tip_search) s.tip_search.emplace(s.arm, s.control.max_theta_rad, limits.plane_rad());
  for (State::Phase& phase : s.phases)
    if (phase.tracker) phase.tracker->hold_within(limits);
}

}  // namespace softarm
