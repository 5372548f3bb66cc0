#include "plant/pcc_system.hpp"

#include <cmath>

#include "softarm/model/actuation_matrix.hpp"

namespace softarm {

PccSystem::PccSystem(const PlantSettings& settings)
    : arm_(settings.arm),
      tip_force_n_(settings.tip_force_n),
      has_tip_force_(settings.tip_force_n != Eigen::Vector3d::Zero()),
      workspace_(settings.arm) {
  const Eigen::Index n = arm_.dof();
  for (Eigen::VectorXd* vector : {&stiffness_, &damping_, &target_nm_, &excess_nm_, &force_nm_,
                                  &shifted_, &above_, &below_, &sum_}) {
    vector->setZero(n);
  }
  coriolis_.setZero(n, n);
  for (int i = 0; i < arm_.size(); ++i) {
    const SegmentParameters& segment = arm_.segments[static_cast<std::size_t>(i)];
    stiffness_.segment<2>(2 * i).setConstant(segment.stiffness_nm_per_rad);
    damping_.segment<2>(2 * i).setConstant(segment.damping_nms_per_rad);
  }
}

void PccSystem::drive(double t_s, ConstVector present_nm, ConstVector target_nm, double lag_s) {
  target_nm_ = target_nm;
  excess_nm_ = present_nm - target_nm;
  since_s_ = t_s;
  rate_per_s_ = lag_s > 0.0 ? 1.0 / lag_s : 0.0;
  force_known_ = false;
}

const Eigen::VectorXd& PccSystem::chamber_force(double t_s) {
  if (!force_known_ || (rate_per_s_ > 0.0 && t_s != force_time_s_)) {
    force_nm_ = target_nm_;
    if (rate_per_s_ > 0.0) {
      force_nm_ += std::exp(-(t_s - since_s_) * rate_per_s_) * excess_nm_;
    }
    force_time_s_ = t_s;
    force_known_ = true;
  }
  return force_nm_;
}

void PccSystem::add_input(double t_s, ConstVector u, Vector out) {
  const Eigen::VectorXd& force = chamber_force(t_s);
  if (arm_.actuation == ActuationModel::chamber) {
    out += force;
  } else {
    for (int i = 0; i < arm_.size(); ++i) {
      // The moments about the segment's own axes that its chambers make, through the other input
      // matrix.
      const Eigen::Vector2d tau_actuation(-force[2 * i + 1], force[2 * i]);
      out.segment<2>(2 * i) +=
          actuation_matrix(arm_.actuation, u.segment<2>(2 * i)) * tau_actuation;
    }
  }
  if (has_tip_force_) {
    add_tip_force(arm_, u, tip_force_n_, out);
  }
}

void PccSystem::residual(double t_s, ConstVector u, ConstVector velocity, ConstVector acceleration,
                         Vector out) {
  sum_.setZero();
  add_input(t_s, u, sum_);
  inverse_dynamics(arm_, workspace_, u, velocity, velocity, acceleration, {}, out);
  out += stiffness_.cwiseProduct(u) + damping_.cwiseProduct(velocity) - sum_;
}

bool PccSystem::acceleration(double t_s, ConstVector u, ConstVector velocity, Vector out) {
  sum_.setZero();
  add_input(t_s, u, sum_);
  return forward_dynamics(arm_, workspace_, u, velocity, sum_, out);
}

void PccSystem::linearize(double t_s, ConstVector u, ConstVector velocity, ConstVector acceleration,
                          Matrix by_acceleration, Matrix by_velocity, Matrix by_u) {
  dynamics_matrices(arm_, workspace_, u, velocity, by_acceleration, coriolis_, above_);
  by_velocity = 2.0 * coriolis_;  // C(u, a) b is symmetric in a and b
  by_velocity.diagonal() += damping_;
  // Central differences: step^2 and round-off / step balance near the cube root of the round-off.
  constexpr double kStep = 1e-5;
  shifted_ = u;
  for (Eigen::Index j = 0; j < u.size(); ++j) {
    shifted_[j] = u[j] + kStep;
    residual(t_s, shifted_, velocity, acceleration, above_);
    shifted_[j] = u[j] - kStep;
    residual(t_s, shifted_, velocity, acceleration, below_);
    shifted_[j] = u[j];
    by_u.col(j) = (above_ - below_) / (2.0 * kStep);
  }
}

SecondOrderSystem::Powers PccSystem::powers(double t_s, ConstVector u, ConstVector velocity) {
  sum_.setZero();
  add_input(t_s, u, sum_);
  return {.supplied_w = sum_.dot(velocity),
          .dissipated_w = velocity.dot(damping_.cwiseProduct(velocity))};
}

double PccSystem::kinetic_energy_j(ConstVector u, ConstVector velocity) {
  return kinetic_energy(arm_, workspace_, u, velocity);
}

double PccSystem::potential_energy_j(ConstVector u) const {
  return gravity_potential(arm_, u) + 0.5 * u.dot(stiffness_.cwiseProduct(u));
}

}  // namespace softarm
