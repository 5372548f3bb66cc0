#include "simulation/pcc_loads.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"

namespace softarm {

PccLoads::PccLoads(const ArmParameters& arm, int pieces, const std::vector<double>& payload_kg) {
  const int segments = arm.size() / pieces;
  for (int i = 0; i < segments; ++i) {
    End end{.arm = arm, .jacobian = {}, .jacobian_rate = {}};
    end.arm.segments.resize(static_cast<std::size_t>((i + 1) * pieces));
    if (!payload_kg.empty()) end.payload_kg = payload_kg[static_cast<std::size_t>(i)];
    has_payload_ |= end.payload_kg > 0.0;
    end.jacobian.setZero(3, end.arm.dof());
    end.jacobian_rate.setZero(3, end.arm.dof());
    ends_.push_back(std::move(end));
  }
}

void PccLoads::add_external(const ExternalLoads& loads, double t_s, ConstVector u, Vector out) {
  for (const ExternalLoads::Load& load : loads.loads()) {
    if (!load.on) continue;
    End& end = ends_[static_cast<std::size_t>(load.segment)];
    const Eigen::Index n = end.arm.dof();
    const double scale = ExternalLoads::scale(load, t_s);
    add_tip_force(end.arm, u.head(n), scale * load.force_n, out.head(n));
    if (load.moment_nm != Eigen::Vector3d::Zero()) {
      tip_angular_jacobian(end.arm, u.head(n), end.jacobian);
      out.head(n).noalias() += scale * (end.jacobian.transpose() * load.moment_nm);
    }
  }
}

void PccLoads::add_payload(ConstVector u, ConstVector v, ConstVector a,
                           const Eigen::Vector3d& gravity_mps2, Vector out) {
  for (End& end : ends_) {
    if (end.payload_kg == 0.0) continue;
    const Eigen::Index n = end.arm.dof();
    tip_jacobians(end.arm, u.head(n), v.head(n), end.jacobian, end.jacobian_rate);
    const Eigen::Vector3d force =
        end.payload_kg * (end.jacobian * a.head(n) + end.jacobian_rate * v.head(n) - gravity_mps2);
    out.head(n).noalias() += end.jacobian.transpose() * force;
  }
}

void PccLoads::add_payload(ConstVector u, ConstVector v, Matrix B, Matrix C) {
  for (End& end : ends_) {
    if (end.payload_kg == 0.0) continue;
    const Eigen::Index n = end.arm.dof();
    tip_jacobians(end.arm, u.head(n), v.head(n), end.jacobian, end.jacobian_rate);
    B.topLeftCorner(n, n).noalias() += end.payload_kg * end.jacobian.transpose() * end.jacobian;
    C.topLeftCorner(n, n).noalias() +=
        end.payload_kg * end.jacobian.transpose() * end.jacobian_rate;
  }
}

double PccLoads::kinetic_energy_j(ConstVector u, ConstVector v) {
  double energy = 0.0;
  for (End& end : ends_) {
    if (end.payload_kg == 0.0) continue;
    const Eigen::Index n = end.arm.dof();
    tip_jacobian(end.arm, u.head(n), end.jacobian);
    energy += 0.5 * end.payload_kg * (end.jacobian * v.head(n)).squaredNorm();
  }
  return energy;
}

double PccLoads::potential_energy_j(ConstVector u) {
  double energy = 0.0;
  for (const End& end : ends_) {
    if (end.payload_kg == 0.0) continue;
    energy -=
        end.payload_kg * end.arm.gravity_mps2.dot(tip_position(end.arm, u.head(end.arm.dof())));
  }
  return energy;
}

}  // namespace softarm
