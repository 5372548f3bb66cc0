#include "simulation/pcc_system.hpp"

#include <cmath>
#include <limits>

#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/memory.hpp"
#include "softarm/model/segment.hpp"
#include "softarm/model/statics.hpp"

namespace softarm {

std::unique_ptr<PlantSystem> PccSettings::make(const PlantSettings& settings) const {
  return std::make_unique<PccSystem>(settings, settings.arm, 1);
}

PccSystem::PccSystem(const PlantSettings& settings, const ArmParameters& arm, int pieces)
    : PlantSystem(settings, true, pieces == 1),
      segments_(settings.arm.size()),
      pieces_(pieces),
      width_(arm.segment_dof()),
      arm_(arm),
      share_(arm_.size()),
      gravity_mps2_(arm_.gravity_mps2),
      loads_(arm_, pieces_, settings.payload_kg),
      material_(settings.material),
      bends_otherwise_(material_.bends_otherwise()),
      bouc_wen_{.limit_rad = material_.bouc_wen_rad,
                .exponent = material_.bouc_wen_exponent,
                .shape = material_.bouc_wen_shape},
      workspace_(arm_),
      piece_ends_(static_cast<std::size_t>(arm_.size())) {
  const Eigen::Index n = arm_.dof();
  for (Eigen::VectorXd* vector : {&stiffness_, &damping_, &shifted_, &above_, &below_, &sum_}) {
    vector->setZero(n);
  }
  if (material_.stiffening_per_bar != 0.0) {
    segment_sum_.setZero(segments_, chamber_count(settings.actuation));
    Eigen::Index chamber = 0;
    for (int i = 0; i < segments_; ++i) {
      const auto count = static_cast<Eigen::Index>(
          settings.actuation.segments[static_cast<std::size_t>(i)].size());
      segment_sum_.block(i, chamber, 1, count).setOnes();
      chamber += count;
    }
  }
  if (material_.bouc_wen != 0.0)
    for (Eigen::VectorXd* each : {&yielded_rad_, &yielded_at_rad_}) each->setZero(2 * segments_);
  coriolis_.setZero(n, n);
  inertia_.setZero(n, n);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n), one = Eigen::VectorXd::Ones(n);
  add_impedance(arm_, one, zero, stiffness_);
  add_impedance(arm_, zero, one, damping_);
  maxwell_ = maxwell_elements();
  for (int j = 0; j < arm_.size(); ++j) {
    const SegmentParameters& piece = arm_.segments[static_cast<std::size_t>(j)];
    const SegmentParameters& whole = settings.arm.segments[static_cast<std::size_t>(j / pieces_)];
    // A segment without stiffness bends under no moment in particular: equally, then.
    share_[j] = pieces_ == 1 ? 1.0
                : piece.stiffness_nm_per_rad > 0.0
                    ? whole.stiffness_nm_per_rad / piece.stiffness_nm_per_rad
                    : 1.0 / pieces_;
    if (arm_.extensible && piece.constant_length) held_.push_back(3 * j + 2);
  }
}

std::vector<PccSystem::MaxwellElement> PccSystem::maxwell_elements() const {
  std::vector<MaxwellElement> out;
  const auto add = [&](double part, double axial_part, double time_s) {
    if (part == 0.0 && (axial_part == 0.0 || !arm_.extensible)) return;
    MaxwellElement element{stiffness_, Eigen::VectorXd::Zero(arm_.dof()), time_s};
    for (Eigen::Index c = 0; c < arm_.dof(); ++c)
      element.stiffness[c] *= c % width_ == 2 ? axial_part : part;
    out.push_back(std::move(element));
  };
  add(material_.remanence, material_.axial_remanence, material_.remanence_s);
  add(material_.remanence_2, material_.axial_remanence_2, material_.remanence_2_s);
  return out;
}

void PccSystem::add_couple(const Eigen::Vector2d& tau_nm, int first_piece, ConstVector u,
                           Vector out) const {
  Eigen::Vector3d local(tau_nm.x(), tau_nm.y(), 0.0);  // in the axes of the piece's start
  for (int j = first_piece; j < first_piece + pieces_; ++j) {
    const Eigen::Vector2d bend = u.segment<2>(2 * j);
    out.segment<2>(2 * j) += segment_angular_jacobian(bend).transpose() * local;
    local = segment_rotation(bend).transpose() * local;
  }
}

void PccSystem::add_material(double t_s, ConstVector u, Vector out) {
  if (material_.stiffening_per_bar != 0.0)
    pressure_sum_bar_.noalias() = segment_sum_ * input_.pressures_bar(t_s);
  for (int i = 0; i < segments_; ++i) {
    const auto bend = u.segment<2>(width_ * i);
    const double k = arm_.segments[static_cast<std::size_t>(i)].stiffness_nm_per_rad;
    if (material_.stiffening_per_bar != 0.0)
      out.segment<2>(width_ * i) -= k * material_.stiffening_per_bar * pressure_sum_bar_[i] * bend;
    if (material_.bouc_wen != 0.0)
      out.segment<2>(width_ * i) -= k * material_.bouc_wen * yielded(i, bend);
  }
  for (const MaxwellElement& element : maxwell_)
    out -= element.stiffness.cwiseProduct(u - element.relaxed);
}

Eigen::Vector2d PccSystem::yielded(int segment, const Eigen::Vector2d& bend) const {
  return bouc_wen_.step(yielded_rad_.segment<2>(2 * segment),
                        bend - yielded_at_rad_.segment<2>(2 * segment));
}

void PccSystem::add_cubic(ConstVector u, Vector out) const {
  for (int i = 0; i < segments_; ++i) {
    const Eigen::Vector2d bend = u.segment<2>(width_ * i);
    out.segment<2>(width_ * i) += arm_.segments[static_cast<std::size_t>(i)].stiffness_nm_per_rad *
                                  material_.cubic_per_rad2 * bend.squaredNorm() * bend;
  }
}

void PccSystem::remember(double passed_s, ConstVector u) {
  for (MaxwellElement& element : maxwell_) {
    const Remanence relaxation{.share = 1.0, .time_s = element.time_s};
    for (Eigen::Index c = 0; c < u.size(); ++c)
      element.relaxed[c] = relaxation.step(element.relaxed[c], u[c], passed_s);
  }
  if (material_.bouc_wen == 0.0) return;
  for (int i = 0; i < segments_; ++i) {
    const Eigen::Vector2d bend = u.segment<2>(width_ * i);
    yielded_rad_.segment<2>(2 * i) = yielded(i, bend);
    yielded_at_rad_.segment<2>(2 * i) = bend;
  }
}

double PccSystem::unit(Eigen::Index i) const {
  return i % width_ == 2 ? arm_.segments[static_cast<std::size_t>(i / width_)].length_m : 1.0;
}

bool PccSystem::has_lengths(ConstVector u) const {
  for (int j = 0; j < arm_.size(); ++j) {
    if (!(arm_.segments[static_cast<std::size_t>(j)].length_m + u[3 * j + 2] > 0.0)) return false;
  }
  return true;
}

void PccSystem::feel_base(double t_s) {
  if (external_loads_.base_moves()) {
    arm_.gravity_mps2 = gravity_mps2_ - external_loads_.base_acceleration_mps2(t_s);
  }
}

void PccSystem::add_input(double t_s, ConstVector u, Vector out) {
  const bool couple = arm_.actuation == ActuationModel::couple;
  const Eigen::VectorXd& force = input_.force_nm(t_s);
  for (int i = 0; i < segments_; ++i) {
    const int first = i * pieces_;
    if (arm_.extensible) {  // and no couple
      for (int j = first; j < first + pieces_; ++j)
        out.segment<3>(3 * j) += force.segment<3>(3 * i);
      continue;
    }
    if (!couple) {
      for (int j = first; j < first + pieces_; ++j) {
        out.segment<2>(2 * j) += force.segment<2>(2 * i);
      }
    } else if (pieces_ == 1) {
      out.segment<2>(2 * i) +=
          actuation_matrix(arm_.actuation, u.segment<2>(2 * i)) * input_.tau_nm(t_s, i);
    } else {
      add_couple(input_.tau_nm(t_s, i), first, u, out);
    }
  }
  if (external_loads_.any_load_on()) {
    loads_.add_external(external_loads_, t_s, u, out);
  }
}

void PccSystem::residual(double t_s, ConstVector u, ConstVector velocity, ConstVector acceleration,
                         Vector out) {
  sum_.setZero();
  add_input(t_s, u, sum_);
  if (bends_otherwise_) add_material(t_s, u, sum_);
  feel_base(t_s);
  inverse_dynamics(arm_, workspace_, u, velocity, velocity, acceleration, {}, out);
  if (loads_.has_payload()) {
    loads_.add_payload(u, velocity, acceleration, arm_.gravity_mps2, out);
  }
  out += stiffness_.cwiseProduct(u) + damping_.cwiseProduct(velocity) - sum_;
  if (bends_otherwise_) add_cubic(u, out);
  if (!arm_.extensible) return;
  for (const Eigen::Index e : held_) out[e] = acceleration[e];
  if (!has_lengths(u)) out.setConstant(std::numeric_limits<double>::quiet_NaN());
}

bool PccSystem::acceleration(double t_s, ConstVector u, ConstVector velocity, Vector out) {
  if (loads_.has_payload()) {
    above_.setZero();
    residual(t_s, u, velocity, above_, below_);
    below_ = -below_;
    inertia_matrix(arm_, workspace_, u, inertia_);
    loads_.add_payload(u, velocity, inertia_, coriolis_);
    if (arm_.extensible) hold_constant_lengths(arm_, inertia_, below_);
    return solve_inertia(workspace_, inertia_, below_, out);
  }
  sum_.setZero();
  add_input(t_s, u, sum_);
  if (bends_otherwise_) {
    below_.setZero();
    add_cubic(u, below_);
    sum_ -= below_;
    add_material(t_s, u, sum_);
  }
  feel_base(t_s);
  return forward_dynamics(arm_, workspace_, u, velocity, sum_, out);
}

void PccSystem::linearize(double t_s, ConstVector u, ConstVector velocity, ConstVector acceleration,
                          Matrix by_acceleration, Matrix by_velocity, Matrix by_u) {
  dynamics_matrices(arm_, workspace_, u, velocity, by_acceleration, coriolis_, above_);
  if (loads_.has_payload()) {
    loads_.add_payload(u, velocity, by_acceleration, coriolis_);
  }
  by_velocity = 2.0 * coriolis_;  // C(u, a) b is symmetric in a and b
  by_velocity.diagonal() += damping_;
  for (const Eigen::Index e : held_) {
    by_acceleration.row(e) = Eigen::RowVectorXd::Unit(u.size(), e);
    by_velocity.row(e).setZero();
  }
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
  if (bends_otherwise_) add_material(t_s, u, sum_);
  if (external_loads_.base_moves()) {
    // Inertia forces of the base's acceleration, the only weight in this.
    arm_.gravity_mps2 = -external_loads_.base_acceleration_mps2(t_s);
    above_.setZero();
    gravity_moments(arm_, workspace_, u, below_);
    if (loads_.has_payload()) loads_.add_payload(u, above_, above_, arm_.gravity_mps2, below_);
    sum_ -= below_;
  }
  return {.supplied_w = sum_.dot(velocity),
          .dissipated_w = velocity.dot(damping_.cwiseProduct(velocity))};
}

double PccSystem::kinetic_energy_j(ConstVector u, ConstVector velocity) {
  return kinetic_energy(arm_, workspace_, u, velocity) + loads_.kinetic_energy_j(u, velocity);
}

double PccSystem::potential_energy_j(ConstVector u) {
  arm_.gravity_mps2 = gravity_mps2_;
  return gravity_potential(arm_, u) + loads_.potential_energy_j(u) +
         0.5 * u.dot(stiffness_.cwiseProduct(u)) + cubic_energy_j(u);
}

double PccSystem::cubic_energy_j(ConstVector u) const {
  if (material_.cubic_per_rad2 == 0.0) return 0.0;
  double sum = 0.0;
  for (int i = 0; i < segments_; ++i) {
    const double bend2 = u.segment<2>(width_ * i).squaredNorm();
    sum += arm_.segments[static_cast<std::size_t>(i)].stiffness_nm_per_rad * bend2 * bend2;
  }
  return 0.25 * material_.cubic_per_rad2 * sum;
}

void PccSystem::spread(ConstVector u, Vector x) const {
  x.setZero();
  for (int j = 0; j < arm_.size(); ++j) {
    x.segment<2>(width_ * j) = share_[j] * u.segment<2>(2 * (j / pieces_));
  }
}

void PccSystem::segment_ends(ConstVector x, std::span<Eigen::Isometry3d> ends) const {
  forward_kinematics(arm_, x, piece_ends_);
  for (int i = 0; i < segments_; ++i) {
    ends[static_cast<std::size_t>(i)] =
        piece_ends_[static_cast<std::size_t>((i + 1) * pieces_ - 1)];
  }
}

void PccSystem::curvature(ConstVector x, ConstVector v, Vector u, Vector rate) const {
  if (pieces_ == 1) {
    for (int i = 0; i < segments_; ++i) {
      u.segment<2>(2 * i) = x.segment<2>(width_ * i);
      rate.segment<2>(2 * i) = v.segment<2>(width_ * i);
    }
    return;
  }
  for (int i = 0; i < segments_; ++i) {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d chord = Eigen::Vector3d::Zero();
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();
    for (int j = i * pieces_; j < (i + 1) * pieces_; ++j) {
      const Eigen::Vector2d bend = x.segment<2>(width_ * j);
      const double elongation = arm_.extensible ? x[3 * j + 2] : 0.0;
      const double length = arm_.segments[static_cast<std::size_t>(j)].length_m + elongation;
      chord += rotation * segment_tip(length, bend);
      angular += rotation * (segment_angular_jacobian(bend) * v.segment<2>(width_ * j));
      rotation = rotation * segment_rotation(bend);
    }
    Eigen::Vector2d bend, bend_rate;
    fit_segment(rotation, chord, angular, bend, bend_rate);
    u.segment<2>(2 * i) = bend;
    rate.segment<2>(2 * i) = bend_rate;
  }
}

}  // namespace softarm
