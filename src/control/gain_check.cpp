#include "softarm/control/gain_check.hpp"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "control/sampled_loop.hpp"
#include "softarm/model/coordinates.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/statics.hpp"

namespace softarm {
namespace {

constexpr double kLargestFactor = 1e3;
constexpr double kMargin = 1.25;
constexpr int kMostModes = 24;  ///< of a plane; longer arms are reduced to so many

/// What the gains of one bending plane are judged by.
struct Judged {
  BendingPlane plane;
  double largest_kp;
  bool gravity_fed_back;

  bool stable(const LoopSampling& sampling, double factor) const {
    return loop_growth_1ps(plane, sampling, factor, gravity_fed_back) < 0.0;
  }

  double largest_factor(const LoopSampling& sampling) const {
    if (plane.kp.isZero(0.0) && plane.kd.isZero(0.0)) return kLargestFactor;
    double low = 1e-3, high = kLargestFactor;
    if (stable(sampling, high)) return high;
    if (!stable(sampling, low)) return 0.0;
    while (high > 1.001 * low) {
      const double middle = std::sqrt(low * high);
      (stable(sampling, middle) ? low : high) = middle;
    }
    return low;
  }
};

/// Of every segment the row and column of one coordinate: u_x, u_y or e. In the straight pose they do
/// not act on one another.
Eigen::MatrixXd of_plane(const Eigen::MatrixXd& matrix, Eigen::Index width, int axis) {
  const Eigen::Index n = matrix.rows() / width;
  Eigen::MatrixXd part(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) part(i, j) = matrix(width * i + axis, width * j + axis);
  return part;
}
Eigen::VectorXd of_plane(const Eigen::VectorXd& vector, Eigen::Index width, int axis) {
  return Eigen::Map<const Eigen::VectorXd, 0, Eigen::InnerStride<>>(
      vector.data() + axis, vector.size() / width, Eigen::InnerStride<>(width));
}

std::vector<Judged> judged_planes(const ArmParameters& arm, const Eigen::VectorXd& kp,
                                  const Eigen::VectorXd& kd, bool gravity_fed_back) {
  const int n = arm.size(), dof = arm.dof(), width = arm.segment_dof();
  if (kp.size() != dof || kd.size() != dof) {
    throw std::invalid_argument(
        fmt::format("gain check: expected {} gains, got {} and {}", dof, kp.size(), kd.size()));
  }
  DynamicsWorkspace workspace(arm);
  Eigen::MatrixXd B(dof, dof), C(dof, dof);
  Eigen::VectorXd G(dof);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(dof);
  dynamics_matrices(arm, workspace, zero, zero, B, C, G);
  const Eigen::MatrixXd slope = gravity_slope(arm, zero);
  std::vector<Judged> planes(static_cast<std::size_t>(width));
  for (int axis = 0; axis < width; ++axis) {
    Judged& judged = planes[static_cast<std::size_t>(axis)];
    judged.plane.inverse_inertia =
        of_plane(B, width, axis).llt().solve(Eigen::MatrixXd::Identity(n, n));
    judged.plane.gravity_slope = of_plane(slope, width, axis);
    judged.plane.stiffness.setZero(n, n);
    judged.plane.damping.setZero(n, n);
    for (int i = 0; i < n; ++i) {
      const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
      judged.plane.stiffness(i, i) =
          axis == 2 ? segment.axial_stiffness_n_per_m : segment.stiffness_nm_per_rad;
      judged.plane.damping(i, i) =
          axis == 2 ? segment.axial_damping_ns_per_m : segment.damping_nms_per_rad;
    }
    judged.plane.kp = of_plane(kp, width, axis).asDiagonal();
    judged.plane.kd = of_plane(kd, width, axis).asDiagonal();
    judged.largest_kp = of_plane(kp, width, axis).maxCoeff();
    if (n > kMostModes) judged.plane = reduced(judged.plane, kMostModes);
    judged.gravity_fed_back = gravity_fed_back;
  }
  return planes;
}

std::string explain(const LoopSampling& sampling, double kp, double factor, const std::string& what,
                    const char* unit) {
  const std::string loop = fmt::format(
      "{:.4g} Hz of control, frames at {:.4g} Hz that are {:.4g} s late, a filter of {:.4g} rad/s, "
      "a "
      "dead time of {:.4g} s and a valve lag of {:.4g} s",
      1.0 / sampling.control_period_s, 1.0 / sampling.frame_period_s, sampling.frame_latency_s,
      sampling.filter_bandwidth_radps, sampling.dead_time_s, sampling.valve_lag_s);
  if (factor <= 0.0) return fmt::format("{}: with {} no gain is stable", what, loop);
  return fmt::format(
      "{}: a stiffness of {:.3g} {} is {} what {} leave stable, about {:.3g} {}; lower "
      "the "
      "gains or the delays, or try another filter",
      what, kp, unit, factor < 1.0 ? "beyond" : fmt::format("within a factor {} of", kMargin), loop,
      factor * kp, unit);
}

}  // namespace

Eigen::Matrix3d tip_compliance(const ArmParameters& arm, const Eigen::VectorXd& u,
                               const Eigen::VectorXd& kp_u, bool gravity_fed_back) {
  expect_constant_length(arm, "tip compliance");
  const int dof = arm.dof();
  if (u.size() != dof || kp_u.size() != dof) {
    throw std::invalid_argument(fmt::format(
        "tip compliance: expected u and K_P of {}, got {} and {}", dof, u.size(), kp_u.size()));
  }
  Eigen::MatrixXd stiffness = kp_u.asDiagonal();
  for (int i = 0; i < dof; ++i) {
    stiffness(i, i) += arm.segments[static_cast<std::size_t>(i / 2)].stiffness_nm_per_rad;
  }
  if (!gravity_fed_back) stiffness += gravity_slope(arm, u);
  Eigen::MatrixXd J(3, dof);
  tip_jacobian(arm, u, J);
  return J * stiffness.lu().solve(J.transpose());
}

double loop_growth_1ps(const ArmParameters& arm, const LoopSampling& sampling,
                       const Eigen::VectorXd& kp_u, const Eigen::VectorXd& kd_u,
                       bool gravity_fed_back) {
  double growth = -std::numeric_limits<double>::infinity();
  for (const Judged& each : judged_planes(arm, kp_u, kd_u, gravity_fed_back)) {
    growth = std::max(growth, loop_growth_1ps(each.plane, sampling, 1.0, each.gravity_fed_back));
  }
  return growth;
}

double largest_gain_factor(const ArmParameters& arm, const LoopSampling& sampling,
                           const Eigen::VectorXd& kp_u, const Eigen::VectorXd& kd_u,
                           bool gravity_fed_back) {
  double factor = kLargestFactor;
  for (const Judged& each : judged_planes(arm, kp_u, kd_u, gravity_fed_back)) {
    factor = std::min(factor, each.largest_factor(sampling));
  }
  return factor;
}

std::vector<std::string> gain_warnings(const ArmParameters& arm, const ControllerSettings& settings,
                                       const LoopSampling& sampling, double theta_rad) {
  const bool polar = settings.coordinates == ControlCoordinates::polar;
  const auto all = [&](const std::vector<double>& bending, const std::vector<double>& axial) {
    SegmentScalars along = SegmentScalars::Zero(arm.size());
    std::copy(axial.begin(), axial.end(), along.begin());
    return coordinates(arm, Eigen::Map<const Eigen::VectorXd>(bending.data(), std::ssize(bending)),
                       along);
  };
  const double theta = std::max(theta_rad, settings.polar_theta_min_rad);
  Eigen::VectorXd kp = all(settings.kp, settings.kp_axial);
  Eigen::VectorXd kd = all(settings.kd, settings.kd_axial);
  if (polar) {
    for (Eigen::Index i = 0; i < kp.size(); i += 2) kp[i] /= theta * theta;
    for (Eigen::Index i = 0; i < kd.size(); i += 2) kd[i] /= theta * theta;
  }
  const auto planes = judged_planes(arm, kp, kd, settings.terms.gravity);
  std::vector<std::string> warnings;
  for (std::size_t axis = 0; axis < planes.size(); ++axis) {
    const Judged& judged = planes[axis];
    // Two simulations say that all is well; the search is for the message only.
    if (judged.stable(sampling, 1.0) && judged.stable(sampling, kMargin)) continue;
    std::string what = axis == 0 ? "gains of u_x" : axis == 1 ? "gains of u_y" : "gains of e";
    if (polar && axis == 0) {
      what = fmt::format("gains of phi (K_P / theta^2 at theta = {:.3g} rad)", theta);
    }
    if (polar && axis == 1) what = "gains of theta";
    warnings.push_back(explain(sampling, judged.largest_kp, judged.largest_factor(sampling), what,
                               axis == 2 ? "N/m" : "N m/rad"));
  }
  return warnings;
}

}  // namespace softarm
