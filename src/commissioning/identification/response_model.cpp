#include "softarm/commissioning/identification/response_model.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "softarm/actuation/input_map.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/statics.hpp"

namespace softarm {
namespace {

constexpr double kLargest_rad = 20.0;     ///< a response beyond it is not that of an arm
constexpr double kFastest_1ps = 40000.0;  ///< beyond it a simulation takes too long
constexpr double kStep = 2.0;  ///< times the fastest mode's time constant; stable below 2.78

ArmHypothesis hypothesis(const ArmParameters& arm, const ActuationSettings& actuation) {
  ArmHypothesis out;
  out.arm = arm;
  out.arm.extensible = false;  // what is identified is how segments bend
  out.rest_rad.setZero(2 * arm.size());
  out.input_map.resize(2, chamber_count(actuation));
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < actuation.segments.size(); ++i) {
    const Eigen::Matrix2Xd map = input_map(actuation.kind, actuation.segments[i]);
    out.input_map.middleCols(first, map.cols()) = map;
    out.segment_of.insert(out.segment_of.end(), actuation.segments[i].size(), static_cast<int>(i));
    first += map.cols();
  }
  return out;
}

/// Storage of one simulation, and the acceleration of (16).
class Motion {
 public:
  explicit Motion(const ArmHypothesis& arm)
      : arm_(arm),
        plain_(arm.arm),
        workspace_(arm.arm),
        force_(arm.arm.dof()),
        spring_(arm.arm.dof()) {
    // The springs are added here, with their rest and their cubic part.
    for (SegmentParameters& segment : plain_.segments) segment.stiffness_nm_per_rad = 0.0;
  }

  [[nodiscard]] bool acceleration(const Eigen::VectorXd& u, const Eigen::VectorXd& v,
                                  const Eigen::VectorXd& input, Eigen::VectorXd& a) {
    actuation_force(arm_, u, input, force_);
    spring_force(arm_, u, spring_);
    force_ -= spring_;
    return forward_dynamics(plain_, workspace_, u, v, force_, a);
  }

  /// Residual of the static balance: G + springs - input.
  void imbalance(const Eigen::VectorXd& u, const Eigen::VectorXd& input, Eigen::VectorXd& out) {
    actuation_force(arm_, u, input, force_);
    spring_force(arm_, u, spring_);
    gravity_moments(plain_, workspace_, u, out);
    out += spring_ - force_;
  }

  /// The shape at rest under an input.
  std::optional<Eigen::VectorXd> settled(const Eigen::VectorXd& input) {
    return solve_balance(
        [&](const Eigen::VectorXd& u, Eigen::VectorXd& left) { imbalance(u, input, left); },
        arm_.rest_rad);
  }

  /// One step of length h; inputs at its begin, middle and end.
  [[nodiscard]] bool step(double h, const Eigen::VectorXd& p0, const Eigen::VectorXd& p1,
                          const Eigen::VectorXd& p2, Eigen::VectorXd& u, Eigen::VectorXd& v) {
    if (!arm_.inertia) return quasi_static_step(h, p0, p1, p2, u);
    if (!acceleration(u, v, p0, a1_)) return false;
    u2_ = u + 0.5 * h * v;
    v2_ = v + 0.5 * h * a1_;
    if (!acceleration(u2_, v2_, p1, a2_)) return false;
    u3_ = u + 0.5 * h * v2_;
    v3_ = v + 0.5 * h * a2_;
    if (!acceleration(u3_, v3_, p1, a3_)) return false;
    u4_ = u + h * v3_;
    v4_ = v + h * a3_;
    if (!acceleration(u4_, v4_, p2, a4_)) return false;
    u += h / 6.0 * (v + 2.0 * v2_ + 2.0 * v3_ + v4_);
    v += h / 6.0 * (a1_ + 2.0 * a2_ + 2.0 * a3_ + a4_);
    return u.allFinite() && u.cwiseAbs().maxCoeff() < kLargest_rad;
  }

  /// The same without inertia.
  [[nodiscard]] bool quasi_static_step(double h, const Eigen::VectorXd& p0,
                                       const Eigen::VectorXd& p1, const Eigen::VectorXd& p2,
                                       Eigen::VectorXd& u) {
    velocity(u, p0, a1_);
    u2_ = u + 0.5 * h * a1_;
    velocity(u2_, p1, a2_);
    u3_ = u + 0.5 * h * a2_;
    velocity(u3_, p1, a3_);
    u4_ = u + h * a3_;
    velocity(u4_, p2, a4_);
    u += h / 6.0 * (a1_ + 2.0 * a2_ + 2.0 * a3_ + a4_);
    return u.allFinite() && u.cwiseAbs().maxCoeff() < kLargest_rad;
  }

  void velocity(const Eigen::VectorXd& u, const Eigen::VectorXd& input, Eigen::VectorXd& v) {
    imbalance(u, input, v);
    for (Eigen::Index c = 0; c < v.size(); ++c)
      v[c] /= -arm_.arm.segments[static_cast<std::size_t>(c / 2)].damping_nms_per_rad;
  }

  void reserve(Eigen::Index dof) {
    for (Eigen::VectorXd* each : {&a1_, &a2_, &a3_, &a4_}) each->setZero(dof);
  }

 private:
  const ArmHypothesis& arm_;
  ArmParameters plain_;
  DynamicsWorkspace workspace_;
  Eigen::VectorXd force_, spring_;
  Eigen::VectorXd a1_, a2_, a3_, a4_, u2_, u3_, u4_, v2_, v3_, v4_;
};

}  // namespace

ArmHypothesis configured(const Experiment& experiment) {
  ArmHypothesis out = hypothesis(experiment.arm, experiment.actuation);
  const IdentificationSettings& extra = experiment.identification;
  for (std::size_t c = 0; c < extra.rest_u_rad.size(); ++c)
    out.rest_rad[static_cast<Eigen::Index>(c)] = extra.rest_u_rad[c];
  out.cubic_nm_per_rad3 = extra.cubic_nm_per_rad3;
  out.lag_s = extra.lag_s;
  out.dead_time_s = extra.dead_time_s;
  return out;
}

ArmHypothesis of_plant(const Experiment& experiment) {
  ArmHypothesis out = hypothesis(experiment.plant.arm, experiment.plant.actuation);
  out.lag_s = experiment.plant.valves.lag_s;
  out.dead_time_s = experiment.plant.valves.dead_time_s;
  return out;
}

void actuation_force(const ArmHypothesis& arm, ConstVectorRef u, const Eigen::VectorXd& input,
                     VectorRef force) {
  force.setZero();
  for (Eigen::Index j = 0; j < arm.input_map.cols(); ++j)
    force.segment<2>(2 * arm.segment_of[static_cast<std::size_t>(j)]) +=
        input[j] * arm.input_map.col(j);
  if (arm.arm.actuation == ActuationModel::chamber) return;
  for (Eigen::Index i = 0; i < arm.arm.size(); ++i) {
    const Eigen::Vector2d f = force.segment<2>(2 * i);  // = A_chamber tau_A
    force.segment<2>(2 * i) =
        actuation_matrix(arm.arm.actuation, u.segment<2>(2 * i)) * Eigen::Vector2d(-f.y(), f.x());
  }
}

void spring_force(const ArmHypothesis& arm, ConstVectorRef u, VectorRef force) {
  for (Eigen::Index i = 0; i < arm.arm.size(); ++i) {
    const Eigen::Vector2d bend = u.segment<2>(2 * i) - arm.rest_rad.segment<2>(2 * i);
    force.segment<2>(2 * i) = (arm.arm.segments[static_cast<std::size_t>(i)].stiffness_nm_per_rad +
                               arm.cubic_nm_per_rad3 * bend.squaredNorm()) *
                              bend;
  }
}

double ResponseModel::fastest_1ps(const ArmHypothesis& arm) const {
  const Eigen::Index dof = arm.arm.dof();
  DynamicsWorkspace workspace(arm.arm);
  double bend_rad = 0.0;  // where the cubic springs are stiffest
  if (arm.cubic_nm_per_rad3 > 0.0)
    for (Eigen::Index i = 0; i < record_.u_rad.cols() / 2; ++i)
      bend_rad = std::max(bend_rad, record_.u_rad.middleCols<2>(2 * i).rowwise().norm().maxCoeff());
  Eigen::VectorXd damping(dof), springs(dof);
  for (Eigen::Index c = 0; c < dof; ++c) {
    const SegmentParameters& segment = arm.arm.segments[static_cast<std::size_t>(c / 2)];
    damping[c] = segment.damping_nms_per_rad;
    springs[c] = segment.stiffness_nm_per_rad + 3.0 * arm.cubic_nm_per_rad3 * bend_rad * bend_rad;
  }
  const Eigen::VectorXd straight = Eigen::VectorXd::Zero(dof);
  if (!arm.inertia) {
    Eigen::MatrixXd stiffness = gravity_slope(arm.arm, straight);
    stiffness.diagonal() += springs;
    const double largest = stiffness.cwiseAbs().rowwise().sum().maxCoeff();  // >= any eigenvalue
    return damping.minCoeff() > 0.0 ? largest / damping.minCoeff()
                                    : std::numeric_limits<double>::infinity();
  }
  Eigen::MatrixXd B(dof, dof);
  inertia_matrix(arm.arm, workspace, straight, B);
  const double smallest =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(B, Eigen::EigenvaluesOnly).eigenvalues()[0];
  const Eigen::MatrixXd impedance = damping.asDiagonal();
  const double damped = Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(
                            impedance, B, Eigen::EigenvaluesOnly)
                            .eigenvalues()[dof - 1];
  return std::max(damped, std::sqrt(springs.maxCoeff() / smallest));
}

std::optional<double> ResponseModel::step_s(const ArmHypothesis& arm) const {
  const double rate = fastest_1ps(arm);
  if (!(rate < kFastest_1ps)) return std::nullopt;
  return kStep / rate;
}

double ResponseModel::longest_step_s(const ArmHypothesis& arm) const {
  if (const std::optional<double> step = step_s(arm)) return *step;
  throw std::runtime_error(fmt::format(
      "the fastest mode of the arm is at {:.3g} 1/s: its response cannot be simulated in "
      "reasonable time; arm.mass_model: distributed has slower modes, --linear needs none",
      fastest_1ps(arm)));
}

bool ResponseModel::simulate(const ArmHypothesis& arm, double longest_step_s,
                             Eigen::MatrixXd& u) const {
  const Eigen::Index frames = record_.time_s.size(), dof = arm.arm.dof();
  u.resize(frames, dof);
  LaggedInput input(record_.input, arm.lag_s, arm.dead_time_s);
  Motion motion(arm);
  motion.reserve(dof);
  Eigen::VectorXd p0(arm.input_map.cols()), p1 = p0, p2 = p0, v = Eigen::VectorXd::Zero(dof);
  input.at(record_.time_s[0], p0);
  const std::optional<Eigen::VectorXd> settled = motion.settled(p0);
  if (!settled) return false;
  Eigen::VectorXd now = *settled;
  u.row(0) = now;
  for (Eigen::Index k = 1; k < frames; ++k) {
    const double from_s = record_.time_s[k - 1], span_s = record_.time_s[k] - from_s;
    const int steps = std::max(1, static_cast<int>(std::ceil(span_s / longest_step_s - 1e-9)));
    const double h = span_s / steps;
    for (int j = 0; j < steps; ++j) {
      input.at(from_s + (j + 0.5) * h, p1);
      const double to_s = j + 1 == steps ? record_.time_s[k] : from_s + (j + 1) * h;
      input.at(to_s, p2, true);
      if (!motion.step(h, p0, p1, p2, now, v)) return false;
      input.at(to_s, p0);
    }
    u.row(k) = now;
  }
  return true;
}

}  // namespace softarm
