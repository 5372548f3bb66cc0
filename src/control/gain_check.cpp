#include "softarm/control/gain_check.hpp"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {
namespace {

constexpr double kLargestFactor = 1e3;
constexpr double kMargin = 1.25;

/// One bending plane of the arm, linearized about the straight pose.
struct Plane {
  Eigen::MatrixXd inverse_inertia, gravity_slope;
  Eigen::VectorXd stiffness, damping, kp, kd;
};

Plane plane_of(const ArmParameters& arm, const Eigen::MatrixXd& inertia,
               const Eigen::MatrixXd& slope, const Eigen::VectorXd& kp, const Eigen::VectorXd& kd,
               int axis) {
  const int n = arm.size();
  Plane plane;
  Eigen::MatrixXd B(n, n);
  plane.gravity_slope.resize(n, n);
  for (Eigen::VectorXd* v : {&plane.stiffness, &plane.damping, &plane.kp, &plane.kd}) v->resize(n);
  for (int i = 0; i < n; ++i) {
    const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
    plane.stiffness[i] = segment.stiffness_nm_per_rad;
    plane.damping[i] = segment.damping_nms_per_rad;
    plane.kp[i] = kp[2 * i + axis];
    plane.kd[i] = kd[2 * i + axis];
    for (int j = 0; j < n; ++j) {
      B(i, j) = inertia(2 * i + axis, 2 * j + axis);
      plane.gravity_slope(i, j) = slope(2 * i + axis, 2 * j + axis);
    }
  }
  plane.inverse_inertia = B.llt().solve(Eigen::MatrixXd::Identity(n, n));
  return plane;
}

/// States u, u', valve force (if there is a lag), three of the delay a segment (if there is one).
bool stable(const Plane& plane, const ControllerSettings& settings, double factor) {
  const Eigen::Index n = plane.stiffness.size();
  const bool lag = settings.valve_lag_s > 0.0, delay = settings.delay_s > 0.0;
  const Eigen::Index force_at = 2 * n, delay_at = force_at + (lag ? n : 0),
                     size = delay_at + (delay ? 3 * n : 0);
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(n, n);

  // What the controller asks for, -y, and what comes out of the delay, -w; rows over all states.
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(n, size);
  y.leftCols(n) = (factor * plane.kp).asDiagonal();
  if (settings.terms.gravity) y.leftCols(n) -= plane.gravity_slope;
  y.middleCols(n, n) = (factor * plane.kd).asDiagonal();
  Eigen::MatrixXd w = y;
  if (delay) {  // e^-x ~ -1 + (240 + 24 x^2) / (120 + 60 x + 12 x^2 + x^3), x = s T
    w = -y;
    w.middleCols(delay_at, n) += 240.0 * I;
    w.middleCols(delay_at + 2 * n, n) += 24.0 * I;
  }
  Eigen::MatrixXd force = w;
  if (lag) {
    force.setZero();
    force.middleCols(force_at, n) = I;
  }

  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(size, size);
  A.block(0, n, n, n) = I;
  Eigen::MatrixXd push = -force;
  push.leftCols(n) -= plane.gravity_slope;
  push.leftCols(n).diagonal() -= plane.stiffness;
  push.middleCols(n, n).diagonal() -= plane.damping;
  A.middleRows(n, n) = plane.inverse_inertia * push;
  if (lag) A.middleRows(force_at, n) = (w - force) / settings.valve_lag_s;
  if (delay) {
    const double rate = 1.0 / settings.delay_s;
    A.block(delay_at, delay_at + n, n, n) = rate * I;
    A.block(delay_at + n, delay_at + 2 * n, n, n) = rate * I;
    A.middleRows(delay_at + 2 * n, n) = rate * y;
    A.block(delay_at + 2 * n, delay_at, n, n) -= 120.0 * rate * I;
    A.block(delay_at + 2 * n, delay_at + n, n, n) -= 60.0 * rate * I;
    A.block(delay_at + 2 * n, delay_at + 2 * n, n, n) -= 12.0 * rate * I;
  }
  return A.eigenvalues().real().maxCoeff() < 0.0;
}

double largest_factor(const Plane& plane, const ControllerSettings& settings) {
  if (plane.kp.isZero(0.0) && plane.kd.isZero(0.0)) return kLargestFactor;
  if (stable(plane, settings, kLargestFactor)) return kLargestFactor;
  double low = 1e-4, high = kLargestFactor;
  if (!stable(plane, settings, low)) return 0.0;
  while (high > 1.001 * low) {
    const double middle = std::sqrt(low * high);
    (stable(plane, settings, middle) ? low : high) = middle;
  }
  return low;
}

struct Planes {
  Planes(const ArmParameters& arm, const Eigen::VectorXd& kp, const Eigen::VectorXd& kd) {
    const int dof = arm.dof();
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
    for (int axis = 0; axis < 2; ++axis) plane[axis] = plane_of(arm, B, slope, kp, kd, axis);
  }
  Plane plane[2];
};

std::string explain(const Plane& plane, const ControllerSettings& settings, double factor,
                    const std::string& what) {
  const double kp = plane.kp.maxCoeff();
  if (factor <= 0.0) {
    return fmt::format("{}: with a delay of {} s and a valve lag of {} s no gain is stable", what,
                       settings.delay_s, settings.valve_lag_s);
  }
  return fmt::format(
      "{}: a stiffness of {:.3g} N m/rad is {} what a delay of {} s and a valve lag of {} s leave "
      "stable, about {:.3g} N m/rad; lower the gains or the delay",
      what, kp, factor < 1.0 ? "beyond" : fmt::format("within a factor {} of", kMargin),
      settings.delay_s, settings.valve_lag_s, factor * kp);
}

}  // namespace

Eigen::MatrixXd gravity_slope(const ArmParameters& arm, const Eigen::VectorXd& at) {
  constexpr double kStep = 1e-4;
  const int dof = arm.dof();
  const DynamicsTerms gravity{false, false, true};
  DynamicsWorkspace workspace(arm);
  Eigen::MatrixXd slope(dof, dof);
  Eigen::VectorXd u = at, zero = Eigen::VectorXd::Zero(dof), plus(dof), minus(dof);
  for (int j = 0; j < dof; ++j) {
    u[j] = at[j] + kStep;
    inverse_dynamics(arm, workspace, u, zero, zero, zero, gravity, plus);
    u[j] = at[j] - kStep;
    inverse_dynamics(arm, workspace, u, zero, zero, zero, gravity, minus);
    u[j] = at[j];
    slope.col(j) = (plus - minus) / (2.0 * kStep);
  }
  return slope;
}

Eigen::Matrix3d tip_compliance(const ArmParameters& arm, const Eigen::VectorXd& u,
                               const Eigen::VectorXd& kp_u, bool gravity_fed_back) {
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

double largest_gain_factor(const ArmParameters& arm, const ControllerSettings& settings,
                           const Eigen::VectorXd& kp_u, const Eigen::VectorXd& kd_u) {
  const Planes planes(arm, kp_u, kd_u);
  return std::min(largest_factor(planes.plane[0], settings),
                  largest_factor(planes.plane[1], settings));
}

std::vector<std::string> gain_warnings(const ArmParameters& arm, const ControllerSettings& settings,
                                       double theta_rad) {
  const bool polar = settings.coordinates == ControlCoordinates::polar;
  const double theta = std::max(theta_rad, settings.polar_theta_min_rad);
  Eigen::VectorXd kp = Eigen::Map<const Eigen::VectorXd>(
      settings.kp.data(), static_cast<Eigen::Index>(settings.kp.size()));
  Eigen::VectorXd kd = Eigen::Map<const Eigen::VectorXd>(
      settings.kd.data(), static_cast<Eigen::Index>(settings.kd.size()));
  if (polar) {
    for (Eigen::Index i = 0; i < kp.size(); i += 2) kp[i] /= theta * theta;
    for (Eigen::Index i = 0; i < kd.size(); i += 2) kd[i] /= theta * theta;
  }
  const Planes planes(arm, kp, kd);
  std::vector<std::string> warnings;
  for (int axis = 0; axis < 2; ++axis) {
    const Plane& plane = planes.plane[axis];
    // Two eigenvalue problems say that all is well; the search is for the message only.
    if (stable(plane, settings, 1.0) && stable(plane, settings, kMargin)) continue;
    const double factor = largest_factor(plane, settings);
    std::string what = axis == 0 ? "gains of u_x" : "gains of u_y";
    if (polar && axis == 0) {
      what = fmt::format("gains of phi (K_P / theta^2 at theta = {:.3g} rad)", theta);
    }
    if (polar && axis == 1) what = "gains of theta";
    warnings.push_back(explain(plane, settings, factor, what));
  }
  return warnings;
}

}  // namespace softarm
