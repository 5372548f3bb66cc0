#include "softarm/control/curvature_controller.hpp"

#include <fmt/core.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "softarm/model/actuation_matrix.hpp"

namespace softarm {
namespace {

void check_gains(const char* name, const std::vector<double>& values, int expected,
                 const char* each) {
  if (values.size() != static_cast<std::size_t>(expected)) {
    throw std::invalid_argument(fmt::format("control, {}: expected {} gains ({} a segment), got {}",
                                            name, expected, each, values.size()));
  }
  for (double value : values) {
    if (!std::isfinite(value) || value < 0.0) {
      throw std::invalid_argument(
          fmt::format("control, {}: expected finite gains >= 0, got {}", name, value));
    }
  }
}

/// In the order of the coordinates: two a segment and, where segments stretch, one along e.
SegmentVector gains(const char* name, const ArmParameters& arm, const std::vector<double>& bending,
                    const std::vector<double>& axial) {
  const int n = arm.size(), width = arm.segment_dof();
  check_gains(name, bending, 2 * n, "2");
  if (arm.extensible && !axial.empty()) check_gains(name, axial, n, "1 along e");
  SegmentVector out(arm.dof());
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    out.segment<2>(width * i) << bending[2 * k], bending[2 * k + 1];
    if (arm.extensible) out[width * i + 2] = axial.empty() ? 0.0 : axial[k];
  }
  return out;
}

/// One segment in polar coordinates, bounded at theta = 0.
struct PolarState {
  double phi, theta;
  double inverse_theta;  ///< 1 / theta; below theta_min it falls to 0 as theta / theta_min^2
  Eigen::Vector2d normal, tangent;
};

PolarState polar_state(const Eigen::Vector2d& u, double theta_min, double phi_where_straight) {
  PolarState s;
  s.theta = u.norm();
  s.phi = s.theta > 0.0 ? std::atan2(u[1], u[0]) : phi_where_straight;
  s.inverse_theta = s.theta >= theta_min ? 1.0 / s.theta : s.theta / (theta_min * theta_min);
  s.normal = {std::cos(s.phi), std::sin(s.phi)};
  s.tangent = {-s.normal[1], s.normal[0]};
  return s;
}

/// phi, theta of a reference and their derivatives.
struct PolarReference {
  double phi, theta, phi_d, theta_d, phi_dd, theta_dd;
};

PolarReference polar_reference(const ReferenceSample& r, Eigen::Index i, double theta_min) {
  if (r.has_polar) {
    return {r.polar[i],
            r.polar[i + 1],
            r.polar_velocity[i],
            r.polar_velocity[i + 1],
            r.polar_acceleration[i],
            r.polar_acceleration[i + 1]};
  }
  const Eigen::Vector2d u = r.u.segment<2>(i), ud = r.velocity.segment<2>(i),
                        udd = r.acceleration.segment<2>(i);
  const PolarState s = polar_state(u, theta_min, 0.0);
  PolarReference p{};
  p.phi = s.phi;
  p.theta = s.theta;
  p.phi_d = s.inverse_theta * s.tangent.dot(ud);
  p.theta_d = s.normal.dot(ud);
  p.phi_dd = s.inverse_theta * (s.tangent.dot(udd) - 2.0 * p.theta_d * p.phi_d);
  p.theta_dd = s.normal.dot(udd) + s.theta * p.phi_d * p.phi_d;
  return p;
}

/// angle - 2 pi k in (-pi, pi].
double wrapped(double angle) {
  const double rest = std::remainder(angle, 2.0 * std::numbers::pi);
  return rest <= -std::numbers::pi ? rest + 2.0 * std::numbers::pi : rest;
}

/// Largest factor by which a gain below what is configured raises K_P and K_D. A smaller one costs
/// accuracy while the parameters settle; a larger one uses up the loop's gain margin where the gain
/// overshoots in the first second, which loses arms with a payload and dead time.
constexpr double kLargestGainFactor = 3.0;

}  // namespace

CurvatureController::CurvatureController(const ArmParameters& arm,
                                         const ControllerSettings& settings)
    : arm_(arm),
      settings_(settings),
      workspace_(arm),
      kp_(gains("kp", arm, settings.kp, settings.kp_axial)),
      kd_(gains("kd", arm, settings.kd, settings.kd_axial)),
      ki_(settings.ki.empty() ? SegmentVector::Zero(arm.dof())
                              : gains("ki", arm, settings.ki, settings.ki_axial)),
      integral_(SegmentVector::Zero(arm.dof())),
      horizontal_(arm),
      integrates_(!ki_.isZero(0.0)) {
  if (arm.extensible && (settings.coordinates == ControlCoordinates::polar ||
                         arm.actuation != ActuationModel::chamber)) {
    throw std::invalid_argument(
        "control: expected of segments that stretch coordinates u and actuation by chamber, got "
        "polar or couple");
  }
  if (!std::isfinite(settings.valve_lag_s) || settings.valve_lag_s < 0.0) {
    throw std::invalid_argument(
        fmt::format("control, valve_lag_s: expected a time >= 0, got {}", settings.valve_lag_s));
  }
  if (!(settings.polar_theta_min_rad > 0.0)) {
    throw std::invalid_argument(
        fmt::format("control, polar_theta_min_rad: expected an angle > 0, got {}",
                    settings.polar_theta_min_rad));
  }
  const int dof = arm.dof();
  stiffness_.setZero(dof);
  damping_.setZero(dof);
  const int width = arm.segment_dof();
  for (int i = 0; i < dof; ++i) {
    const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i / width)];
    const bool axial = i % width == 2;
    if (settings.terms.stiffness)
      stiffness_[i] = axial ? segment.axial_stiffness_n_per_m : segment.stiffness_nm_per_rad;
    if (settings.terms.damping)
      damping_[i] = axial ? segment.axial_damping_ns_per_m : segment.damping_nms_per_rad;
  }
  for (SegmentVector* v :
       {&velocity_ref_, &acceleration_ref_, &before_, &after_, &along_x_, &along_y_})
    v->setZero(dof);
}

// Half the lag: where theta'' of the reference jumps (by J, (24) at t = 1 s) the difference spreads
// valve_lag B J over one valve_lag, no more than the jump itself, and its error valve_lag delta^2 /
// 6 FF''' stays far below sensing noise.
double CurvatureController::lookahead_s() const noexcept { return 0.5 * settings_.valve_lag_s; }

void CurvatureController::compute(ConstVectorRef u, ConstVectorRef velocity,
                                  const ReferenceWindow& reference, ControlOutput& out,
                                  const ModelCorrection* correction) noexcept {
  out.tau_u_nm.resize(arm_.dof());
  out.tau_actuation_nm.resize(arm_.dof());
  out.bounded = false;
  if (arm_.extensible) {
    feedback_u<3>(u, velocity, reference.now, out);
  } else if (settings_.coordinates == ControlCoordinates::u) {
    feedback_u<2>(u, velocity, reference.now, out);
  } else {
    feedback_polar(u, velocity, reference.now, out);
  }
  if (settings_.valve_lag_s > 0.0 && reference.interval_s > 0.0) add_lag_inverse(reference, out);
  if (integrates_) out.tau_u_nm += integral_;
  if (correction != nullptr && settings_.disturbance != DisturbanceRejection::none)
    correct(*correction, u, velocity, reference, out);
  solve_actuation(arm_, u, out.tau_u_nm, out.tau_actuation_nm);
  if (arm_.actuation == ActuationModel::couple) {
    for (Eigen::Index i = 0; i < u.size(); i += 2) {
      const double theta = std::hypot(u[i], u[i + 1]);
      out.bounded |= theta > 1.0 && std::abs(std::sin(theta)) < kMinActuationDeterminant * theta;
    }
  }
}

// (17) in u, or in (u, e).
template <int Width>
void CurvatureController::feedback_u(ConstVectorRef u, ConstVectorRef velocity,
                                     const ReferenceSample& r, ControlOutput& out) noexcept {
  const DynamicsTerms terms{settings_.terms.inertia, settings_.terms.coriolis,
                            settings_.terms.gravity};
  inverse_dynamics(arm_, workspace_, u, velocity, r.velocity, r.acceleration, terms, out.tau_u_nm);
  for (Eigen::Index i = 0; i < u.size(); i += Width) {  // a segment: fixed sizes, no remainders
    const auto at = [i](const auto& v) { return v.template segment<Width>(i).array(); };
    out.tau_u_nm.segment<Width>(i).array() +=
        at(stiffness_) * at(r.u) + at(damping_) * at(r.velocity) + at(kp_) * (at(r.u) - at(u)) +
        at(kd_) * (at(r.velocity) - at(velocity));
  }
}

// (17) in q = [phi, theta], as a force in u: tau_u = P^-T tau_q with u' = P q', P = [theta t, n].
// With B_q = P'BP, C_q = P'(C P + B P'), D_q = beta P'P, K_q q_ref = (0, k theta_ref) that is
//   tau_u = G + C (P q'_ref) + B (P q''_ref + P' q'_ref) + beta P q'_ref + k theta_ref n + P^-T
//   (K_P e + K_D e'),
// P and its rate P' at the measured state, P^-T (a, b) = a / theta t + b n.
void CurvatureController::feedback_polar(ConstVectorRef u, ConstVectorRef velocity,
                                         const ReferenceSample& r, ControlOutput& out) noexcept {
  const double theta_min = settings_.polar_theta_min_rad;
  SegmentVector& force = before_;
  for (Eigen::Index i = 0; i < u.size(); i += 2) {
    const PolarReference ref = polar_reference(r, i, theta_min);
    const PolarState s = polar_state(u.segment<2>(i), theta_min, ref.phi);
    out.bounded |= s.theta < theta_min;
    const Eigen::Vector2d ud = velocity.segment<2>(i);
    const double phi_d = s.inverse_theta * s.tangent.dot(ud), theta_d = s.normal.dot(ud);

    velocity_ref_.segment<2>(i) = s.theta * ref.phi_d * s.tangent + ref.theta_d * s.normal;
    acceleration_ref_.segment<2>(i) =
        (s.theta * ref.phi_dd + theta_d * ref.phi_d + phi_d * ref.theta_d) * s.tangent +
        (ref.theta_dd - s.theta * phi_d * ref.phi_d) * s.normal;

    const double phi_force = kp_[i] * wrapped(ref.phi - s.phi) + kd_[i] * (ref.phi_d - phi_d);
    const double theta_force =
        kp_[i + 1] * (ref.theta - s.theta) + kd_[i + 1] * (ref.theta_d - theta_d);
    force.segment<2>(i) = damping_[i] * velocity_ref_.segment<2>(i) +
                          (stiffness_[i] * ref.theta + theta_force) * s.normal +
                          phi_force * s.inverse_theta * s.tangent;
  }
  const DynamicsTerms terms{settings_.terms.inertia, settings_.terms.coriolis,
                            settings_.terms.gravity};
  inverse_dynamics(arm_, workspace_, u, velocity, velocity_ref_, acceleration_ref_, terms,
                   out.tau_u_nm);
  out.tau_u_nm += force;
}

void CurvatureController::integrate(double period_s, ConstVectorRef u,
                                    const ReferenceSample& reference,
                                    ConstVectorRef scale) noexcept {
  if (!integrates_) return;
  const Eigen::Index width = arm_.segment_dof();
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    const double growth = period_s * ki_[i] * (reference.u[i] - u[i]);
    // Out of reach already: more of the same would only have to be undone later.
    if (scale[i / width] >= 1.0 || growth * integral_[i] < 0.0) integral_[i] += growth;
  }
}

void CurvatureController::feed_forward(const ReferenceSample& r, SegmentVector& out) noexcept {
  const DynamicsTerms terms{settings_.terms.inertia, settings_.terms.coriolis,
                            settings_.terms.gravity};
  inverse_dynamics(arm_, workspace_, r.u, r.velocity, r.velocity, r.acceleration, terms, out);
  out.array() += stiffness_.array() * r.u.array() + damping_.array() * r.velocity.array();
}

void CurvatureController::add_lag_inverse(const ReferenceWindow& reference,
                                          ControlOutput& out) noexcept {
  feed_forward(reference.before, before_);
  feed_forward(reference.after, after_);
  out.tau_u_nm += settings_.valve_lag_s / reference.interval_s * (after_ - before_);
}

// What the corrected arm needs beyond the configured one to follow the reference from u.
void CurvatureController::add_correction(const ModelCorrection& correction, ConstVectorRef u,
                                         const ReferenceSample& r,
                                         SegmentVector& force_nm) noexcept {
  if (settings_.terms.gravity) horizontal_.rows(u, workspace_, along_x_, along_y_);
  const int width = arm_.segment_dof();
  for (int i = 0; i < arm_.size(); ++i) {
    const SegmentCorrection& off = correction.segment[static_cast<std::size_t>(i)];
    const auto at = [=](const auto& v) { return v.template segment<2>(width * i).array(); };
    auto force = force_nm.segment<2>(width * i).array();
    force += off.stiffness * at(stiffness_) * at(r.u) + off.damping * at(damping_) * at(r.velocity);
    if (settings_.terms.gravity) force += off.load.x() * at(along_x_) + off.load.y() * at(along_y_);
    if (width == 3) {
      const int e = 3 * i + 2;
      force_nm[e] += off.axial_stiffness * stiffness_[e] * r.u[e] +
                     off.axial_damping * damping_[e] * r.velocity[e];
    }
  }
}

void CurvatureController::correct(const ModelCorrection& correction, ConstVectorRef u,
                                  ConstVectorRef velocity, const ReferenceWindow& reference,
                                  ControlOutput& out) noexcept {
  add_correction(correction, u, reference.now, out.tau_u_nm);
  if (settings_.valve_lag_s > 0.0 && reference.interval_s > 0.0) {
    before_.setZero();
    after_.setZero();
    add_correction(correction, reference.before.u, reference.before, before_);
    add_correction(correction, reference.after.u, reference.after, after_);
    out.tau_u_nm += settings_.valve_lag_s / reference.interval_s * (after_ - before_);
  }
  const bool cancels = settings_.disturbance == DisturbanceRejection::cancel;
  const int width = arm_.segment_dof();
  for (int i = 0; i < arm_.size(); ++i) {
    const SegmentCorrection& off = correction.segment[static_cast<std::size_t>(i)];
    const double factor = 1.0 / (1.0 + off.gain);
    auto bend = out.tau_u_nm.segment<2>(width * i).array();
    if (cancels) bend -= correction.disturbance_nm.segment<2>(2 * i).array();
    bend *= factor;
    if (factor > kLargestGainFactor && settings_.coordinates == ControlCoordinates::u) {
      const auto at = [=](const auto& v) { return v.template segment<2>(width * i).array(); };
      const ReferenceSample& r = reference.now;
      bend -= (factor - kLargestGainFactor) *
              (at(kp_) * (at(r.u) - at(u)) + at(kd_) * (at(r.velocity) - at(velocity)));
    }
    if (width == 2) continue;
    double& along = out.tau_u_nm[3 * i + 2];
    if (cancels) along -= off.axial_force_n;
    along /= 1.0 + off.axial_gain;
  }
}

}  // namespace softarm
