#include "identification/parameter_fit.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {
namespace {

/// A Hann window and its first two derivatives, sampled; each sums to what it does to 1, t, t^2
/// / 2.
struct SmoothingKernel {
  Eigen::VectorXd value, first, second;

  SmoothingKernel(double window_s, double period_s) {
    const auto half = static_cast<Eigen::Index>(std::ceil(0.5 * window_s / period_s));
    const double width = 2.0 * static_cast<double>(half) * period_s;
    const double rate = 2.0 * std::numbers::pi / width;
    value.resize(2 * half + 1);
    first.resize(value.size());
    second.resize(value.size());
    for (Eigen::Index k = -half; k <= half; ++k) {
      const double angle = rate * static_cast<double>(k) * period_s;
      const double weight = period_s / width;
      value[k + half] = weight * (1.0 + std::cos(angle));
      first[k + half] = weight * rate * std::sin(angle);
      second[k + half] = -weight * rate * rate * std::cos(angle);
    }
    // Its derivatives do not vanish at the ends: half of the end points belongs to the neighbours.
    second[0] *= 0.5;
    second[2 * half] *= 0.5;
  }
  Eigen::Index half() const { return value.size() / 2; }
};

/// The generalized force in u of what acts behind the valves, with the configured gains (N m).
Eigen::VectorXd generalized_force(const Experiment& experiment, const Eigen::VectorXd& u,
                                  const Eigen::VectorXd& input) {
  const Eigen::Index dof = experiment.arm.dof();
  Eigen::VectorXd tau(dof), force(dof);
  if (experiment.actuation.kind == ActuationKind::torque) {
    tau = input;
  } else {
    Eigen::Index valve = 0;
    for (Eigen::Index i = 0; i < experiment.arm.size(); ++i) {
      Eigen::Vector2d moment = Eigen::Vector2d::Zero();
      for (const Chamber& chamber : experiment.actuation.segments[static_cast<std::size_t>(i)])
        moment -= chamber.gain_nm_per_bar * input[valve++] *
                  Eigen::Vector2d(std::cos(chamber.angle_rad), std::sin(chamber.angle_rad));
      // tau_A = A_chamber^-1 moment
      tau.segment<2>(2 * i) << -moment.y(), moment.x();
    }
  }
  apply_actuation(experiment.arm, u, tau, force);
  return force;
}

}  // namespace

ParameterFit fit_parameters(const Experiment& experiment, const StepResponse& response,
                            bool per_segment, double window_s) {
  const SmoothingKernel kernel(window_s, response.period_s);
  const Eigen::Index dof = experiment.arm.dof(), width = kernel.value.size();
  const Eigen::Index stride = std::max<Eigen::Index>(1, kernel.half());
  const Eigen::Index instants = (response.u_rad.rows() - width) / stride + 1;
  const bool gain = experiment.actuation.kind != ActuationKind::torque;
  const Eigen::Index sets = per_segment ? experiment.arm.size() : 1, kinds = gain ? 3 : 2;
  if (instants * dof < 4 * sets * kinds)
    throw std::runtime_error(fmt::format("a response of {} frames is too short for windows of {} s",
                                         response.u_rad.rows(), window_s));

  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(instants * dof, sets * kinds);
  Eigen::VectorXd y(instants * dof);
  DynamicsWorkspace workspace(experiment.arm);
  Eigen::VectorXd rest(dof);
  ParameterFit fit;
  for (Eigen::Index k = 0; k < instants; ++k) {
    const auto u_part = response.u_rad.middleRows(k * stride, width);
    const Eigen::VectorXd u = u_part.transpose() * kernel.value,
                          velocity = u_part.transpose() * kernel.first,
                          acceleration = u_part.transpose() * kernel.second,
                          input = response.input.middleRows(k * stride, width).transpose() *
                                  kernel.value;
    inverse_dynamics(experiment.arm, workspace, u, velocity, velocity, acceleration, {}, rest);
    const Eigen::VectorXd force = generalized_force(experiment, u, input);
    fit.moment_rms_nm += force.squaredNorm();
    for (Eigen::Index c = 0; c < dof; ++c) {
      const Eigen::Index row = k * dof + c, set = per_segment ? c / 2 : 0;
      X(row, set) = u[c];
      X(row, sets + set) = velocity[c];
      if (gain) X(row, 2 * sets + set) = -force[c];
      y[row] = -rest[c] + (gain ? 0.0 : force[c]);
    }
  }
  fit.moment_rms_nm = std::sqrt(fit.moment_rms_nm / static_cast<double>(instants * dof));

  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(X);
  if (qr.rank() < X.cols())
    throw std::runtime_error("the steps do not move every segment: nothing can be told about it");
  const Eigen::VectorXd found = qr.solve(y);
  const double squared = (y - X * found).squaredNorm();
  fit.residual_rms_nm = std::sqrt(squared / static_cast<double>(y.size()));
  const double variance = squared / static_cast<double>(y.size() - X.cols());
  const Eigen::MatrixXd information = (X.transpose() * X).inverse();
  const auto estimated = [&](Eigen::Index column) {
    return Estimated{found[column], std::sqrt(variance * information(column, column))};
  };
  for (Eigen::Index s = 0; s < sets; ++s) {
    fit.stiffness_nm_per_rad.push_back(estimated(s));
    fit.damping_nms_per_rad.push_back(estimated(sets + s));
    if (gain) fit.gain_factor.push_back(estimated(2 * sets + s));
  }
  return fit;
}

}  // namespace softarm
