#include "softarm/estimation/model_observer.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "estimation/observer_state.hpp"
#include "softarm/base/time.hpp"
#include "softarm/model/coordinates.hpp"

namespace softarm {
namespace {

/// Silence after which what was known of the motion is worth nothing.
constexpr double kResetGap_s = 1.0;

}  // namespace

ModelObserver::ModelObserver(const ArmParameters& arm, const EstimationSettings& settings,
                             std::span<const BodyNoise> noise, const ObserverTiming& timing)
    : state_(std::make_unique<State>(arm, settings, noise, timing)) {}
ModelObserver::~ModelObserver() = default;
ModelObserver::ModelObserver(ModelObserver&&) noexcept = default;
ModelObserver& ModelObserver::operator=(ModelObserver&&) noexcept = default;

void ModelObserver::command(std::int64_t now_ns, ConstVectorRef tau_actuation_nm) noexcept {
  State& s = *state_;
  const std::int64_t from_ns = now_ns + s.delay_ns;
  if (s.axial) {
    s.axial->command(from_ns, tau_actuation_nm);
    s.history.command(from_ns, bend_part(s.whole, tau_actuation_nm));
  } else {
    s.history.command(from_ns, tau_actuation_nm);
  }
}

void ModelObserver::vented() noexcept {
  state_->history.clear();
  if (state_->axial) state_->axial->clear();
  state_->running = false;
}

void ModelObserver::reset() noexcept {
  state_->running = false;
  state_->base_average.reset();
}

void ModelObserver::update(const MocapFrame& frame, const CurvatureEstimate& estimate,
                           const KnownMotion* reference, bool learn) noexcept {
  State& s = *state_;
  const int n = s.arm.size();
  if (estimate.segments != n || frame.segments != n) return;
  if (s.newest_ns != 0 && frame.capture_ns <= s.newest_ns) return;
  const double since_s =
      s.newest_ns == 0 ? 0.0 : std::min(kResetGap_s, to_seconds(frame.capture_ns - s.newest_ns));
  if (since_s >= kResetGap_s) s.running = false;
  s.newest_ns = frame.capture_ns;
  s.measure(frame, estimate, since_s);
  if (!s.running) {
    if (std::all_of(s.seen.begin(), s.seen.begin() + n, [](bool each) { return each; })) {
      s.start(frame.capture_ns);
      if (s.axial) {
        s.axial->start(frame.capture_ns, estimate);
        s.take_lengths();
      }
    }
    return;
  }
  const KnownMotion* const whole = reference;
  if (s.axial && reference != nullptr) {
    for (auto part :
         {&KnownMotion::u_rad, &KnownMotion::velocity_radps, &KnownMotion::acceleration_radps2})
      s.bends.*part = bend_part(s.whole, reference->*part);
    reference = &s.bends;
  }
  const bool usable = reference != nullptr && reference->u_rad.size() == 2 * n &&
                      reference->velocity_radps.size() == 2 * n &&
                      reference->acceleration_radps2.size() == 2 * n;
  s.may_learn = learn;
  s.learns = s.settings.learn_parameters && usable && learn && !s.monitor.jump();
  s.ahead_is_stale = true;
  if (!s.advance_base(frame.capture_ns, usable ? reference : nullptr) || !s.correct(since_s))
    return s.fail();
  if (!s.axial) return;
  if (!s.axial->advance(frame.capture_ns, s.base.u, s.base.velocity, usable ? whole : nullptr) ||
      !s.axial->correct(estimate, since_s, s.learns))
    return s.fail();
  s.take_lengths();
}

void ModelObserver::predict(std::int64_t now_ns, std::int64_t act_ns,
                            FilteredMotion& out) noexcept {
  State& s = *state_;
  const std::int64_t known_ns = now_ns + s.delay_ns, time_ns = act_ns + s.delay_ns;
  const int n = s.arm.size();
  out.segments = n;
  const int dof = s.axial ? 3 * n : 2 * n;
  out.u_rad.setZero(dof);
  out.velocity_radps.setZero(dof);
  out.valid.fill(false);
  if (!s.running) return;
  // No frame will show what is older than this; so the way ahead stays short, however long the
  // silence.
  const std::int64_t oldest_ns = now_ns - s.max_latency_ns;
  if (!s.advance_base(oldest_ns, nullptr)) return s.fail();
  if (s.axial && !s.axial->advance(oldest_ns, s.base.u, s.base.velocity, nullptr)) return s.fail();
  if (s.ahead_is_stale) {
    s.ahead = s.base;
    s.predictor.linearize(s.base.u, s.correction);
    s.ahead_is_stale = false;
  }
  Motion& at = s.ahead;
  if (!s.advance_motion(known_ns, at)) return s.fail();
  out.u_rad = at.u;
  out.velocity_radps = at.velocity;
  // The rest of the way the next command is not known yet.
  if (time_ns > at.torque.time_ns) {
    Motion& last = s.last;
    last = at;
    if (!s.advance_motion(time_ns, last)) return s.fail();
    out.u_rad = last.u;
    out.velocity_radps = last.velocity;
  }
  if (s.axial) {
    s.axial->predict(time_ns, s.e_m, s.rate_mps);
    out.u_rad = coordinates(s.whole, out.u_rad, s.e_m);
    out.velocity_radps = coordinates(s.whole, out.velocity_radps, s.rate_mps);
  }
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    out.valid[k] = s.unseen_frames[k] <= s.predicted_frames;
  }
}

bool ModelObserver::running() const noexcept { return state_->running; }
std::int64_t ModelObserver::failures() const noexcept { return state_->failures; }
const ModelCorrection& ModelObserver::correction() const noexcept { return state_->correction; }
double ModelObserver::nis() const noexcept { return state_->nis; }
bool ModelObserver::surprised() const noexcept { return state_->monitor.jump(); }
bool ModelObserver::wrong_model() const noexcept { return state_->at_limit; }

const SegmentVector& ModelObserver::newest_u_rad() const noexcept { return state_->base.u; }

void ModelObserver::modelled_torque(std::int64_t time_ns, SegmentVector& tau_nm) noexcept {
  State& s = *state_;
  s.last.torque = s.base.torque;
  if (s.running && time_ns > s.last.torque.time_ns)
    s.history.advance(time_ns, s.last.torque, s.mean_torque);
  tau_nm = s.last.torque.tau_nm;
}

bool ModelObserver::project_disturbance(Eigen::Ref<const Eigen::Matrix3Xd> jacobian,
                                        ConstVectorRef disturbance_nm, Eigen::Matrix3d& information,
                                        Eigen::Vector3d& weighted) const noexcept {
  information.setZero();
  weighted.setZero();
  const bool factored = state_->for_groups([&](auto& errors, auto&, int first) {
    using Errors = std::remove_cvref_t<decltype(errors)>;
    using Columns = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::ColMajor, Errors::kDof, 4>;
    const int dof = errors.velocity();
    Columns columns(dof, 4);
    columns.template leftCols<3>() = jacobian.middleCols(2 * first, dof).transpose();
    columns.col(3) = disturbance_nm.segment(2 * first, dof);
    if (!errors.whiten_disturbance(columns)) return false;
    information.noalias() +=
        columns.template leftCols<3>().transpose() * columns.template leftCols<3>();
    weighted.noalias() += columns.template leftCols<3>().transpose() * columns.col(3);
    return true;
  });
  if (!factored) {
    information.setZero();
    weighted.setZero();
  }
  return factored;
}

void ModelObserver::report(ObserverReport& out) const noexcept {
  out.segments = state_->arm.size();
  out.running = running();
  out.surprised = running() && surprised();
  out.wrong_model = running() && wrong_model();
  out.failures = failures();
  out.nis = nis();
  out.correction = correction();
  deviation(out.deviation);
  if (state_->axial) state_->axial->put_elongation(out.elongation_m, out.elongation_deviation_m);
}

void ModelObserver::deviation(ModelCorrection& out) const noexcept {
  out.disturbance_nm.setZero(state_->arm.dof());
  state_->for_groups([&](auto& errors, auto&, int first) {
    const int dof = errors.velocity();
    const auto sigma = [&errors](int at) {
      return std::sqrt(std::max(0.0, errors.matrix()(at, at)));
    };
    for (int j = 0; j < dof; ++j)
      out.disturbance_nm[2 * first + j] = sigma(errors.disturbance() + j);
    for (int i = 0; i < dof / 2; ++i) {
      const int at = errors.parameters() + 5 * i;
      out.segment[static_cast<std::size_t>(first + i)] = {
          sigma(at), sigma(at + 1), sigma(at + 2), {sigma(at + 3), sigma(at + 4)}};
    }
    return true;
  });
  if (state_->axial) state_->axial->put_deviation(out);
}

void ModelObserver::deviation(FilteredMotion& out) const noexcept {
  const int n = state_->arm.size();
  out.segments = n;
  out.u_rad.setZero(2 * n);
  out.velocity_radps.setZero(2 * n);
  out.valid.fill(state_->running);
  state_->for_groups([&](auto& errors, auto&, int first) {
    const int dof = errors.velocity();
    for (int j = 0; j < dof; ++j) {
      out.u_rad[2 * first + j] = std::sqrt(std::max(0.0, errors.matrix()(j, j)));
      out.velocity_radps[2 * first + j] =
          std::sqrt(std::max(0.0, errors.matrix()(dof + j, dof + j)));
    }
    return true;
  });
}

}  // namespace softarm
