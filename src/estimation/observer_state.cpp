#include "estimation/observer_state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include "estimation/correction_limits.hpp"
#include "softarm/base/time.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

/// The longest step of the mean and of the covariance.
constexpr double kMeanStep_s = 2.5e-3, kCovarianceStep_s = 0.01;
/// Frames, however exact, are not trusted further.
constexpr double kLeastNoise_rad = 1e-4;
/// What is not known when the observer starts: speed (rad/s), disturbance (of the segment's torque
/// scale).
constexpr double kFirstSpeed_radps = 0.5, kFirstDisturbance = 0.1;
/// Of a segment that a frame does not show.
constexpr double kUnseenVariance_rad2 = 1e4;
constexpr double kLargestLoad = 1.0;
/// A mass at the tip has more inertia for its weight than the arm: along a motion that shows as a
/// spring which is softer still, down to one of less than zero.
constexpr double kLeastStiffness = -1.5;

double total_mass_kg(const ArmParameters& arm) {
  double sum = 0.0;
  for (const SegmentParameters& segment : arm.segments) sum += segment.mass_kg;
  return sum;
}

SegmentVector torque_scale(const ArmParameters& arm) {
  SegmentVector scale(arm.dof());
  const double g = arm.gravity_mps2.norm();
  for (int i = 0; i < arm.size(); ++i) {
    const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
    scale.segment<2>(2 * i).setConstant(segment.stiffness_nm_per_rad +
                                        0.5 * g * segment.mass_kg * segment.length_m);
  }
  const double largest = scale.maxCoeff();
  return scale.cwiseMax(largest > 0.0 ? 1e-3 * largest : 1.0);
}

/// The weight is what stiffness, damping and gain are relative to: with a mass of payload_kg at the
/// tip a segment carries (1 + s) times of what is configured, and the three come out at 1 / (1 + s)
/// of it. s from the moments of both in slightly bent poses.
std::vector<double> payload_parts(const ArmParameters& arm, double payload_kg) {
  constexpr double kBend_rad = 0.1;
  constexpr DynamicsTerms kGravity{false, false, true};
  const int n = arm.size();
  std::vector<double> parts(static_cast<std::size_t>(n), 0.0);
  if (payload_kg <= 0.0) return parts;
  DynamicsWorkspace workspace(arm);
  SegmentVector u(2 * n), own(2 * n);
  Eigen::Matrix3Xd jacobian(3, 2 * n);
  Eigen::VectorXd shared = Eigen::VectorXd::Zero(n), square = Eigen::VectorXd::Zero(n);
  for (int axis = 0; axis < 2; ++axis) {
    for (int j = 0; j < 2 * n; ++j) u[j] = j % 2 == axis ? kBend_rad : 0.0;
    inverse_dynamics(arm, workspace, u, u, u, u, kGravity, own);
    tip_jacobian(arm, u, jacobian);
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d hung =
          -payload_kg * jacobian.middleCols<2>(2 * i).transpose() * arm.gravity_mps2;
      shared[i] += hung.dot(own.segment<2>(2 * i));
      square[i] += own.segment<2>(2 * i).squaredNorm();
    }
  }
  for (int i = 0; i < n; ++i) {
    const double s = square[i] > 0.0 ? std::max(0.0, shared[i] / square[i]) : 0.0;
    parts[static_cast<std::size_t>(i)] = -s / (1.0 + s);
  }
  return parts;
}

void require(bool holds, const char* what, double value) {
  if (!holds)
    throw std::invalid_argument(fmt::format("observer: expected a {}, got {}", what, value));
}

}  // namespace

ModelObserver::State::State(const ArmParameters& arm_, const EstimationSettings& settings_,
                            std::span<const BodyNoise> noise_, const ObserverTiming& timing)
    : arm(at_rest_length(arm_)),
      settings(settings_.model_observer),
      predicted_frames(settings_.predicted_frames),
      max_latency_ns(to_ns(timing.max_latency_s)),
      delay_ns(to_ns(timing.dead_time_s)),
      noise(noise_.begin(), noise_.end()),
      estimator(
          [&] {
            EstimationSettings by_orientation = settings_;
            by_orientation.method = CurvatureMethod::orientation;
            return by_orientation;
          }(),
          arm, noise_),
      history(2 * arm.size(),
              8 + static_cast<int>(std::ceil((timing.max_latency_s + timing.dead_time_s) /
                                             timing.control_period_s)),
              timing.valve_lag_s),
      predictor(arm),
      base_average(noise_.front().orientation_rad),
      monitor(torque_scale(arm), settings.disturbance_drift_per_sqrt_s,
              settings.largest_disturbance_drift_per_sqrt_s),
      scale_nm(torque_scale(arm)),
      payload_part(payload_parts(arm, settings.payload_deviation * total_mass_kg(arm))) {
  require(settings.parameter_deviation >= 0.0, "parameter_deviation >= 0",
          settings.parameter_deviation);
  require(settings.disturbance_drift_per_sqrt_s > 0.0, "disturbance_drift_per_sqrt_s > 0",
          settings.disturbance_drift_per_sqrt_s);
  require(settings.largest_disturbance_drift_per_sqrt_s >= settings.disturbance_drift_per_sqrt_s,
          "largest_disturbance_drift_per_sqrt_s not below the least",
          settings.largest_disturbance_drift_per_sqrt_s);
  const double load_deviation = settings.load_deviation.value_or(0.0);
  require(load_deviation >= 0.0, "load_deviation >= 0", load_deviation);
  const int n = arm.size();
  if (arm_.extensible) {
    whole = arm_;
    axial = std::make_unique<AxialObserver>(arm_, settings, history.size(), timing.valve_lag_s);
  }
  if (n <= kJoint) {
    joint_.emplace(n);
    gravity_slope.setZero(2 * n, 2 * n);
  } else {
    for (int i = 0; i < n; ++i) single_.emplace_back(1);
  }
  regressors.setZero(2 * n, 5);
  previous_regressors = regressors;
  for (SegmentVector* each : {&measured_u, &mean_torque, &along_x, &along_y, &force, &gravity,
                              &shifted, &base.u, &base.velocity})
    each->setZero(2 * n);
  forget_parameters();
}

/// What made it fail may be in any of its numbers.
void ModelObserver::State::fail() noexcept {
  running = false;
  ++failures;
  forget_parameters();
}

void ModelObserver::State::forget_parameters() noexcept {
  for (Parameters& shown : information) shown.setZero();
  correction.segment.fill({});
  const auto known = std::min(settings.load.size() / 2, static_cast<std::size_t>(arm.size()));
  for (std::size_t i = 0; i < known; ++i)
    correction.segment[i].load = {settings.load[2 * i], settings.load[2 * i + 1]};
  correction.disturbance_nm.setZero(arm.dof());
  if (axial) axial->forget_parameters();
  const bool learns_any = settings.learn_parameters;
  const double sigma = learns_any ? settings.parameter_deviation : 0.0;
  const double load_sigma = learns_any ? settings.load_deviation.value_or(sigma) : 0.0;
  for_groups([&](auto& errors, auto&, int first) {
    using Vector = typename std::remove_cvref_t<decltype(errors)>::Vector;
    errors.reset(1.0, 1.0, Vector::Ones(errors.velocity()), sigma * sigma);
    errors.set_load_variance(load_sigma * load_sigma);
    if (!learns_any || settings.payload_deviation == 0.0) return true;
    const int segments = errors.velocity() / 2;
    Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 5 * kJoint, 1> payload(5 * segments);
    payload.setZero();
    for (int i = 0; i < segments; ++i)
      payload.segment<3>(5 * i).setConstant(payload_part[static_cast<std::size_t>(first + i)]);
    errors.add_to_parameters(payload);
    return true;
  });
}

/// With e held, what bends see of a segment that stretches is its length.
void ModelObserver::State::take_lengths() noexcept {
  const SegmentScalars length_m = lengths(whole) + axial->e_m();
  set_lengths(arm, length_m);
  predictor.set_stretch(length_m, axial->coupling_nm());
  axial->put(correction);
  at_limit |= axial->at_limit();
}

/// At rest where a frame with every segment shows the arm.
void ModelObserver::State::start(std::int64_t capture_ns) noexcept {
  running = true;
  base.u = measured_u;
  base.velocity.setZero();
  history.settle(capture_ns, base.torque);
  correction.disturbance_nm.setZero();
  monitor.reset();
  ahead_is_stale = true;
  nis = 1.0;
  regressors_known = false;
  for_groups([&](auto& errors, auto&, int first) {
    const double sigma = 2.0 * noise.back().orientation_rad + kLeastNoise_rad;
    errors.restart_motion(
        sigma * sigma, kFirstSpeed_radps * kFirstSpeed_radps,
        (kFirstDisturbance * scale_nm.segment(2 * first, errors.velocity())).cwiseAbs2());
    return true;
  });
}

bool ModelObserver::State::advance_motion(std::int64_t time_ns, Motion& motion) noexcept {
  const std::int64_t gap_ns = time_ns - motion.torque.time_ns;
  if (gap_ns <= 0) return true;
  const auto steps = static_cast<std::int64_t>(std::ceil(to_seconds(gap_ns) / kMeanStep_s - 1e-6));
  const std::int64_t begin_ns = motion.torque.time_ns;
  for (std::int64_t k = 1; k <= steps; ++k) {
    const std::int64_t from_ns = motion.torque.time_ns, to_ns = begin_ns + gap_ns * k / steps;
    history.advance(to_ns, motion.torque, mean_torque);
    if (!predictor.step(to_seconds(to_ns - from_ns), mean_torque, correction, motion.u,
                        motion.velocity))
      return false;
  }
  return true;
}

void ModelObserver::State::find_regressors(const KnownMotion* reference) noexcept {
  constexpr DynamicsTerms kAll{true, true, true};
  if (reference == nullptr) {
    regressors.setZero();  // nothing is learnt, and what the parameters do not explain is d
    return;
  }
  const SegmentVector& u = reference->u_rad;
  const SegmentVector& velocity = reference->velocity_radps;
  predictor.horizontal().rows(u, predictor.workspace(), along_x, along_y);
  // The force that the reference takes: what the gain, if wrong, is wrong by.
  inverse_dynamics(arm, predictor.workspace(), u, velocity, velocity,
                   reference->acceleration_radps2, kAll, force);
  force.array() +=
      predictor.stiffness().array() * u.array() + predictor.damping().array() * velocity.array();
  for (int i = 0; i < arm.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const SegmentCorrection& off = correction.segment[k];
    const auto rows = [i](const SegmentVector& v) { return v.segment<2>(2 * i); };
    auto here = regressors.middleRows<2>(2 * i);
    here.col(0) = -arm.segments[k].stiffness_nm_per_rad * rows(u);
    here.col(1) = -arm.segments[k].damping_nms_per_rad * rows(velocity);
    here.col(2) = (rows(force) + off.load.x() * rows(along_x) + off.load.y() * rows(along_y)) /
                  (1.0 + off.gain);
    here.col(3) = -rows(along_x);
    here.col(4) = -rows(along_y);
  }
}

void ModelObserver::State::find_gravity_slope() noexcept {
  constexpr double kStep_rad = 1e-4;
  constexpr DynamicsTerms kGravity{false, false, true};
  const SegmentVector& u = base.u;
  inverse_dynamics(arm, predictor.workspace(), u, u, u, u, kGravity, gravity);
  shifted = u;
  for (Eigen::Index j = 0; j < u.size(); ++j) {
    shifted[j] = u[j] + kStep_rad;
    inverse_dynamics(arm, predictor.workspace(), shifted, u, u, u, kGravity, force);
    shifted[j] = u[j];
    gravity_slope.col(j) = (force - gravity) / kStep_rad;
  }
}

/// Information of the last seconds about the parameters of each segment, with the disturbance a
/// random walk: a constant regressor cannot be separated from it, one that moves can.
void ModelObserver::State::note_excitation(double step_s, const KnownMotion* reference) noexcept {
  constexpr double kMemory_s = 2.0;
  const bool known = reference != nullptr;
  for (int i = 0; i < arm.size(); ++i) {
    Parameters& shown = information[static_cast<std::size_t>(i)];
    shown *= std::exp(-step_s / kMemory_s);
    if (!known || !regressors_known) continue;
    const Eigen::Matrix<double, 2, 5> moved =
        scale_nm.segment<2>(2 * i).cwiseInverse().asDiagonal() *
        (regressors.middleRows<2>(2 * i) - previous_regressors.middleRows<2>(2 * i));
    shown.noalias() += moved.transpose() * moved / (monitor.drift_per_s() * step_s);
  }
  previous_regressors = regressors;
  regressors_known = known;
}

template <int k>
bool ModelObserver::State::propagate(ErrorCovariance<k>& errors, GroupModel<2 * k>& model,
                                     int first, double step_s) noexcept {
  const int dof = errors.velocity(), at = 2 * first;
  model.inertia = predictor.inertia().block(at, at, dof, dof);
  if (joint_) {
    model.stiffness = gravity_slope;
  } else {
    model.stiffness.setZero(dof, dof);
  }
  model.stiffness.diagonal() += predictor.stiffness().segment(at, dof);
  model.damping = predictor.damping().segment(at, dof);
  model.regressors = regressors.middleRows(at, dof);
  if (!errors.propagate(step_s, model)) return false;
  errors.add_to_disturbance(monitor.drift_per_s() * step_s * scale_nm.segment(at, dof).cwiseAbs2());
  if (!learns) return true;
  // Only what the motion has shown lately may walk: M (M + P_0^-1)^-1 is the part of what is known
  // of each direction that comes from the motion. What is not excited stays as it is.
  const double drift = settings.parameter_drift_per_sqrt_s;
  const double prior = settings.parameter_deviation * settings.parameter_deviation;
  for (int i = 0; i < dof / 2; ++i) {
    const Parameters& shown = information[static_cast<std::size_t>(first + i)];
    const Eigen::LLT<Parameters> all(shown + Parameters::Identity() / prior);
    const Parameters part = Parameters::Identity() - all.solve(Parameters::Identity()) / prior;
    errors.add_to_parameters(i, drift * drift * step_s * part, settings.parameter_deviation);
  }
  return true;
}

bool ModelObserver::State::advance_base(std::int64_t time_ns,
                                        const KnownMotion* reference) noexcept {
  const std::int64_t gap_ns = time_ns - base.torque.time_ns;
  if (gap_ns <= 0) return true;
  ahead_is_stale = true;
  const auto steps =
      static_cast<std::int64_t>(std::ceil(to_seconds(gap_ns) / kCovarianceStep_s - 1e-6));
  const std::int64_t begin_ns = base.torque.time_ns;
  for (std::int64_t s = 1; s <= steps; ++s) {
    const std::int64_t to_ns = begin_ns + gap_ns * s / steps;
    const double step_s = to_seconds(to_ns - base.torque.time_ns);
    predictor.linearize(base.u, correction);
    if (joint_) find_gravity_slope();
    find_regressors(reference);
    note_excitation(step_s, reference);
    if (!for_groups([&](auto& errors, auto& model, int first) {
          return propagate(errors, model, first, step_s);
        }))
      return false;
    if (!advance_motion(to_ns, base)) return false;
  }
  return true;
}

void ModelObserver::State::measure(const MocapFrame& frame, const CurvatureEstimate& estimate,
                                   double since_s) noexcept {
  BodyPose mean_base = frame.body[0];
  if (mean_base.valid) mean_base.orientation = base_average.add(mean_base.orientation, since_s);
  for (int i = 0; i < arm.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    SegmentCurvature one;
    if (estimate.valid[k])
      one = estimator.segment(i, i == 0 ? mean_base : frame.body[k], frame.body[k + 1]);
    seen[k] = one.valid;
    unseen_frames[k] = one.valid ? 0 : std::min(unseen_frames[k] + 1, 1 << 20);
    measured_u.segment<2>(2 * i) = one.u_rad;
  }
}

template <int k>
bool ModelObserver::State::correct_group(ErrorCovariance<k>& errors, int first,
                                         double& square) noexcept {
  using Errors = ErrorCovariance<k>;
  const int dof = errors.velocity();
  typename Errors::Square R;
  typename Errors::Vector innovation;
  R.setZero(dof, dof);
  innovation.setZero(dof);
  const auto variance = [this](int body) {
    const double sigma = noise[static_cast<std::size_t>(body)].orientation_rad;
    return sigma * sigma;
  };
  for (int i = 0; i < dof / 2; ++i) {
    const int segment = first + i;
    const auto at = static_cast<std::size_t>(segment);
    auto own = R.template block<2, 2>(2 * i, 2 * i);
    if (!seen[at]) {
      own.diagonal().setConstant(kUnseenVariance_rad2);
      continue;
    }
    const BodyNoiseJacobians& here = noise_jacobian[at];
    own = variance(segment + 1) * here.lower * here.lower.transpose();
    // The averaged base has no noise left to speak of.
    if (segment > 0) own += variance(segment) * here.upper * here.upper.transpose();
    own.diagonal().array() += kLeastNoise_rad * kLeastNoise_rad;
    innovation.template segment<2>(2 * i) =
        measured_u.segment<2>(2 * segment) - base.u.segment<2>(2 * segment);
    if (i == 0 || !seen[at - 1]) continue;
    const Eigen::Matrix2d shared =
        -variance(segment) * noise_jacobian[at - 1].lower * here.upper.transpose();
    R.template block<2, 2>(2 * i - 2, 2 * i) = shared;
    R.template block<2, 2>(2 * i, 2 * i - 2) = shared.transpose();
  }
  typename Errors::Correction by;
  double one = 0.0;
  if (!errors.measure(innovation, R, !learns, by, one)) return false;
  square += one;
  base.u.segment(2 * first, dof) += by.segment(errors.u(), dof);
  base.velocity.segment(2 * first, dof) += by.segment(errors.velocity(), dof);
  correction.disturbance_nm.segment(2 * first, dof) += by.segment(errors.disturbance(), dof);
  for (int i = 0; i < dof / 2; ++i) {
    SegmentCorrection& off = correction.segment[static_cast<std::size_t>(first + i)];
    const auto part = by.template segment<5>(errors.parameters() + 5 * i);
    off.stiffness += part[0];
    off.damping += part[1];
    off.gain += part[2];
    off.load += part.template tail<2>();
  }
  return by.allFinite();
}

void ModelObserver::State::limit_corrections() noexcept {
  at_limit = false;
  for (int i = 0; i < arm.size(); ++i) {
    SegmentCorrection& off = correction.segment[static_cast<std::size_t>(i)];
    at_limit |= limit_correction(off.stiffness, kLeastStiffness);
    at_limit |= limit_correction(off.damping);
    at_limit |= limit_correction(off.gain);
    at_limit |= limit_correction(off.load.x(), -kLargestLoad, kLargestLoad);
    at_limit |= limit_correction(off.load.y(), -kLargestLoad, kLargestLoad);
  }
}

bool ModelObserver::State::correct(double since_s) noexcept {
  int components = 0;
  for (int i = 0; i < arm.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!seen[k]) continue;
    components += 2;
    noise_jacobian[k] = body_noise_jacobians(base.u.segment<2>(2 * i));
  }
  if (components == 0) return true;
  double square = 0.0;
  if (!for_groups(
          [&](auto& errors, auto&, int first) { return correct_group(errors, first, square); }))
    return false;
  nis = square / components;
  limit_corrections();
  const bool got_over = monitor.add(nis, correction.disturbance_nm, since_s);
  if (got_over && settings.learn_parameters && may_learn) {
    constexpr double kForgotten = 0.1;
    for_groups([&](auto& errors, auto&, int) {
      errors.add_to_parameters(kForgotten * kForgotten, settings.parameter_deviation);
      return true;
    });
  }
  return base.u.allFinite() && base.velocity.allFinite() && correction.disturbance_nm.allFinite();
}

}  // namespace softarm
