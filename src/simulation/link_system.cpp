#include "simulation/link_system.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "softarm/base/keys.hpp"

namespace softarm {
namespace {

void expect_not_negative(double value, const char* key) {
  if (!(value >= 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(std::string("plant.links.") + key +
                                ": expected a finite number >= 0, got " + std::to_string(value));
  }
}

}  // namespace

template <bool kStretches>
auto LinkSystem<kStretches>::turn(double a, double b) -> Turn {
  return {std::sin(a), std::cos(a), std::sin(b), std::cos(b)};
}

template <bool kStretches>
inline auto LinkSystem<kStretches>::into(const Turn& t, const Vec3& v) -> Vec3 {
  const double y = t.ca * v.y() + t.sa * v.z();
  const double z = t.ca * v.z() - t.sa * v.y();
  return {t.cb * v.x() - t.sb * z, y, t.sb * v.x() + t.cb * z};
}

template <bool kStretches>
inline auto LinkSystem<kStretches>::out_of(const Turn& t, const Vec3& v) -> Vec3 {
  const double x = t.cb * v.x() + t.sb * v.z();
  const double z = t.cb * v.z() - t.sb * v.x();
  return {x, t.ca * v.y() - t.sa * z, t.sa * v.y() + t.ca * z};
}

void LinkSettings::describe(Keys& key) {
  key("links_per_segment", links_per_segment, from(1, kMaxLinksPerSegment),
      "each with two crossed revolute joints at its start");
  key("joints", joints, one_of({"crossed"}), "crossed: two angles, about x and y");
  key("joint_stiffness_nm_per_rad", joint_stiffness_nm_per_rad, from(0, 1e6),
      "of every joint about each axis; left out: k times links_per_segment");
  key("joint_damping_nms_per_rad", joint_damping_nms_per_rad, from(0, 1e6),
      "the same; left out: beta times links_per_segment");
}

std::unique_ptr<PlantSystem> LinkSettings::make(const PlantSettings& settings) const {
  if (settings.arm.extensible) return std::make_unique<LinkSystem<true>>(settings, *this);
  return std::make_unique<LinkSystem<false>>(settings, *this);
}

template <bool kStretches>
LinkSystem<kStretches>::LinkSystem(const PlantSettings& settings, const LinkSettings& links)
    : PlantSystem(settings, kStretches),
      per_segment_(links.links_per_segment),
      arm_(settings.arm),
      gravity_(arm_.base_rotation.transpose() * arm_.gravity_mps2) {
  if (per_segment_ < 1 || per_segment_ > kMaxLinksPerSegment) {
    throw std::invalid_argument("plant.links.links_per_segment: expected 1 to " +
                                std::to_string(kMaxLinksPerSegment) + ", got " +
                                std::to_string(per_segment_));
  }
  const double m = per_segment_;
  for (const SegmentParameters& segment : arm_.segments) {
    const double length = segment.length_m / m;
    const double mass = segment.mass_kg / m;
    const bool rod = arm_.mass == MassModel::distributed;
    const Link link = {
        .length_m = length,
        .mass_kg = mass,
        .inertia_kgm2 = rod ? mass * length * length / 12.0 : 0.0,
        .payload_kg = 0.0,
        .stiffness_nm_per_rad =
            links.joint_stiffness_nm_per_rad.value_or(m * segment.stiffness_nm_per_rad),
        .damping_nms_per_rad =
            links.joint_damping_nms_per_rad.value_or(m * segment.damping_nms_per_rad)};
    expect_not_negative(link.stiffness_nm_per_rad, "joint_stiffness_nm_per_rad");
    expect_not_negative(link.damping_nms_per_rad, "joint_damping_nms_per_rad");
    for (int j = 0; j < per_segment_; ++j) {
      links_.push_back(link);
      if (kStretches && segment.constant_length) held_.push_back(size() - 1);
    }
  }
  for (std::size_t i = 0; i < settings.payload_kg.size(); ++i) {
    links_[last_link(static_cast<int>(i))].payload_kg = settings.payload_kg[i];
  }
  const Eigen::Index n = size();
  turns_.resize(links_.size());
  force_.resize(links_.size());
  moment_.resize(links_.size());
  rotation_.resize(links_.size());
  origin_.resize(links_.size());
  motion_.setZero(6, n);
  momentum_.setZero(6, n);
  swing_.setZero(3, n);
  lever_.setZero(3, n);
  inertia_.setZero(n, n);
  for (Eigen::VectorXd* vector : {&stiffness_, &damping_, &scratch_}) vector->setZero(n);
  if (kStretches) axial_n_.resize(links_.size());
  for (std::size_t j = 0; j < links_.size(); ++j) {
    const Eigen::Index row = kWidth * static_cast<Eigen::Index>(j);
    stiffness_.segment<2>(row).setConstant(links_[j].stiffness_nm_per_rad);
    damping_.segment<2>(row).setConstant(links_[j].damping_nms_per_rad);
    if constexpr (kStretches) {
      const SegmentParameters& segment = arm_.segments[j / static_cast<std::size_t>(per_segment_)];
      stiffness_[row + 2] = m * segment.axial_stiffness_n_per_m;
      damping_[row + 2] = m * segment.axial_damping_ns_per_m;
    }
  }
}

template <bool kStretches>
double LinkSystem<kStretches>::unit(Eigen::Index i) const {
  return i % kWidth == 2 ? links_[static_cast<std::size_t>(i / kWidth)].length_m : 1.0;
}

// All vectors are those of the inertial motion, in the axes of the link at hand; gravity is an
// upward acceleration of the base.
template <bool kStretches>
void LinkSystem<kStretches>::residual(double t_s, ConstVector x, ConstVector v, ConstVector a,
                                      Vector out) {
  const std::size_t count = links_.size();
  Vec3 spin = Vec3::Zero();                        // angular velocity
  Vec3 spin_rate = Vec3::Zero();                   // and its derivative
  Vec3 start = base_acceleration(t_s) - gravity_;  // acceleration of the link's start
  for (std::size_t j = 0; j < count; ++j) {
    const Eigen::Index k = kWidth * static_cast<Eigen::Index>(j);
    const Turn t = turns_[j] = turn(x[k], x[k + 1]);
    const Link& link = links_[j];
    const double length = length_m(j, x);
    const double va = v[k], vb = v[k + 1];
    const Vec3 carried = into(t, spin);
    const Vec3 relative(t.cb * va, vb, t.sb * va);
    const Vec3 relative_rate(t.cb * a[k] - t.sb * va * vb, a[k + 1], t.sb * a[k] + t.cb * va * vb);
    spin_rate = into(t, spin_rate) + relative_rate + carried.cross(relative);
    spin = carried + relative;
    start = into(t, start);
    // (w' x + w x w x) e_z: the acceleration per metre along the link.
    const Vec3 along(spin_rate.y() + spin.x() * spin.z(), spin.y() * spin.z() - spin_rate.x(),
                     -spin.x() * spin.x() - spin.y() * spin.y());
    const double half = 0.5 * length;
    if constexpr (kStretches) {
      // Of the end against the start; of a grain between them, its part of that.
      const Vec3 apart =
          length * along + Vec3(2.0 * v[k + 2] * spin.y(), -2.0 * v[k + 2] * spin.x(), a[k + 2]);
      const Vec3 force = link.mass_kg * (start + 0.5 * apart);
      const Vec3 spread = spread_kg(j) * apart;
      force_[j] = force;
      moment_[j] = Vec3(-half * force.y() - length * spread.y(),
                        half * force.x() + length * spread.x(), 0.0);
      axial_n_[j] = 0.5 * force.z() + spread.z();
      start += apart;
    } else {
      const Vec3 force = link.mass_kg * (start + half * along);
      force_[j] = force;
      // A rod that spins about itself has no moment of momentum about itself.
      const double inertia = link.inertia_kgm2;
      moment_[j] = Vec3(inertia * (spin_rate.x() - spin.z() * spin.y()) - half * force.y(),
                        inertia * (spin_rate.y() + spin.z() * spin.x()) + half * force.x(), 0.0);
      start += length * along;
    }
    if (link.payload_kg > 0.0) {
      const Vec3 hung = link.payload_kg * start;
      force_[j] += hung;
      moment_[j] += length * Vec3(-hung.y(), hung.x(), 0.0);
      if constexpr (kStretches) axial_n_[j] += hung.z();
    }
  }
  if (external_loads_.any_load_on()) subtract_loads(t_s, x);
  Vec3 force = Vec3::Zero();
  Vec3 moment = Vec3::Zero();  // both that the link passes on, at its end
  for (std::size_t j = count; j-- > 0;) {
    const Eigen::Index k = kWidth * static_cast<Eigen::Index>(j);
    const Turn& t = turns_[j];
    moment += moment_[j] + length_m(j, x) * Vec3(-force.y(), force.x(), 0.0);
    if constexpr (kStretches) out[k + 2] = axial_n_[j] + force.z();
    force += force_[j];
    out[k] = t.cb * moment.x() + t.sb * moment.z();
    out[k + 1] = moment.y();
    force = out_of(t, force);
    moment = out_of(t, moment);
  }
  out += stiffness_.cwiseProduct(x) + damping_.cwiseProduct(v);
  const Eigen::VectorXd& actuation = input_.force_nm(t_s);
  for (Eigen::Index i = 0; i < arm_.size(); ++i) {
    const Eigen::Vector2d tau(-actuation[kWidth * i + 1], actuation[kWidth * i]);
    Vec3 local(tau.x(), tau.y(), 0.0);
    for (Eigen::Index j = i * per_segment_; j < (i + 1) * per_segment_; ++j) {
      if constexpr (kStretches) {
        out.segment<3>(3 * j) -= Vec3(tau.x(), tau.y(), actuation[3 * i + 2]);
        continue;
      }
      if (arm_.actuation == ActuationModel::couple) {
        const double about_x = local.x();
        local = into(turns_[static_cast<std::size_t>(j)], local);
        out[2 * j] -= about_x;
        out[2 * j + 1] -= local.y();
      } else {
        out.segment<2>(2 * j) -= tau;
      }
    }
  }
  if constexpr (kStretches) {
    for (const Eigen::Index s : held_) out[s] = a[s];
    for (std::size_t j = 0; j < count; ++j)
      if (!(length_m(j, x) > 0.0)) out.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
}

template <bool kStretches>
auto LinkSystem<kStretches>::base_acceleration(double t_s) const -> Vec3 {
  if (!external_loads_.base_moves()) return Vec3::Zero();
  return arm_.base_rotation.transpose() * external_loads_.base_acceleration_mps2(t_s);
}

template <bool kStretches>
void LinkSystem<kStretches>::subtract_loads(double t_s, ConstVector x) {
  for (const ExternalLoads::Load& load : external_loads_.loads()) {
    if (!load.on) continue;
    const double scale = ExternalLoads::scale(load, t_s);
    Vec3 force = scale * (arm_.base_rotation.transpose() * load.force_n);
    Vec3 moment = scale * (arm_.base_rotation.transpose() * load.moment_nm);
    const std::size_t end = last_link(load.segment);
    for (std::size_t j = 0; j <= end; ++j) {
      force = into(turns_[j], force);
      moment = into(turns_[j], moment);
    }
    force_[end] -= force;
    moment_[end] -= moment + length_m(end, x) * Vec3(-force.y(), force.x(), 0.0);
    if constexpr (kStretches) axial_n_[end] -= force.z();
  }
}

template <bool kStretches>
void LinkSystem<kStretches>::place(ConstVector x) {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Vec3 origin = Vec3::Zero();
  for (std::size_t j = 0; j < links_.size(); ++j) {
    const Eigen::Index k = kWidth * static_cast<Eigen::Index>(j);
    const Turn t = turn(x[k], x[k + 1]);
    Eigen::Matrix3d relative;
    relative << t.cb, 0.0, t.sb, t.sa * t.sb, t.ca, -t.sa * t.cb, -t.ca * t.sb, t.sa, t.ca * t.cb;
    motion_.col(k).head<3>() = rotation.col(0);
    rotation = rotation * relative;
    motion_.col(k + 1).head<3>() = rotation.col(1);
    for (const Eigen::Index angle : {k, k + 1}) {
      const Vec3 axis = motion_.col(angle).head<3>();
      motion_.col(angle).tail<3>() = origin.cross(axis);
    }
    if constexpr (kStretches) motion_.col(k + 2) << Vec3::Zero(), rotation.col(2);
    turns_[j] = t;
    rotation_[j] = rotation;
    origin_[j] = origin;
    origin += length_m(j, x) * rotation.col(2);
  }
}

// Composite rigid bodies, in the base frame: B_ab is the power that the momentum of all that
// angle b carries has on the motion of angle a, a being nearer the base.
template <bool kStretches>
void LinkSystem<kStretches>::inertia(ConstVector x, Matrix B) {
  double mass = 0.0;
  Vec3 first = Vec3::Zero();                         // sum of m r
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();  // of inertia about the base
  for (std::size_t j = links_.size(); j-- > 0;) {
    const Link& link = links_[j];
    const Vec3 along = rotation_[j].col(2);
    const Vec3 centre = origin_[j] + 0.5 * length_m(j, x) * along;
    const Eigen::Index k = kWidth * static_cast<Eigen::Index>(j);
    if constexpr (kStretches) {  // carries what is beyond, and half of the link
      const double carried_kg = mass + link.payload_kg + 0.5 * link.mass_kg;
      const Vec3 moment = first + (carried_kg - mass) * origin_[j];
      momentum_.col(k + 2) << moment.cross(along), carried_kg * along;
      lever_.col(k + 2) = carried_kg * along;
      B.col(k + 2).head(k + 3).noalias() =
          motion_.leftCols(k + 3).transpose() * momentum_.col(k + 2);
      B(k + 2, k + 2) = carried_kg - 0.25 * link.mass_kg + spread_kg(j);
    }
    mass += link.mass_kg;
    first += link.mass_kg * centre;
    if (link.payload_kg > 0.0) {
      const Vec3 end = origin_[j] + length_m(j, x) * along;
      mass += link.payload_kg;
      first += link.payload_kg * end;
      second += link.payload_kg *
                (end.squaredNorm() * Eigen::Matrix3d::Identity() - end * end.transpose());
    }
    const double inertia = inertia_kgm2(j, length_m(j, x));
    second += (link.mass_kg * centre.squaredNorm() + inertia) * Eigen::Matrix3d::Identity() -
              link.mass_kg * centre * centre.transpose() - inertia * along * along.transpose();
    for (Eigen::Index angle = k + 1; angle >= k; --angle) {
      const Vec3 axis = motion_.col(angle).head<3>();
      const Vec3 at_base = motion_.col(angle).tail<3>();  // velocity of what passes the base
      momentum_.col(angle).head<3>() = second * axis + first.cross(at_base);
      momentum_.col(angle).tail<3>() = axis.cross(first) + mass * at_base;
      lever_.col(angle) = axis.cross(first - mass * origin_[j]);
      B.col(angle).head(angle + 1).noalias() =
          motion_.leftCols(angle + 1).transpose() * momentum_.col(angle);
    }
  }
  B.template triangularView<Eigen::StrictlyLower>() = B.transpose();
}

template <bool kStretches>
bool LinkSystem<kStretches>::acceleration(double t_s, ConstVector x, ConstVector v, Vector a) {
  scratch_.setZero();
  residual(t_s, x, v, scratch_, a);
  place(x);
  inertia(x, inertia_);
  for (const Eigen::Index s : held_) {
    inertia_.row(s).setZero();
    inertia_.col(s).setZero();
    inertia_(s, s) = 1.0;
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(inertia_);
  if (cholesky.info() != Eigen::Success) {
    return false;
  }
  a = -a;
  cholesky.solveInPlace(a);
  return a.allFinite();
}

template <bool kStretches>
void LinkSystem<kStretches>::linearize(double t_s, ConstVector x, ConstVector, ConstVector,
                                       Matrix by_a, Matrix by_v, Matrix by_x) {
  place(x);
  inertia(x, by_a);
  by_v.setZero();
  by_v.diagonal() = damping_;
  const Vec3 gravity = gravity_ - base_acceleration(t_s);
  for (Eigen::Index angle = 0; angle < size(); ++angle) {  // and s, which turns nothing
    const Vec3 axis = motion_.col(angle).head<3>();
    swing_.col(angle) = axis.cross(gravity);
  }
  // Turning angle a turns what angle b carries, and b's axis with it, against gravity.
  by_x.template triangularView<Eigen::Upper>() = swing_.transpose() * lever_;
  by_x.template triangularView<Eigen::StrictlyLower>() = by_x.transpose();
  by_x.diagonal() += stiffness_;
  for (const Eigen::Index s : held_) {
    by_a.row(s) = Eigen::RowVectorXd::Unit(size(), s);
    by_v.row(s).setZero();
    by_x.row(s).setZero();
  }
}

template <bool kStretches>
void LinkSystem<kStretches>::add_input(double t_s, ConstVector x, Vector out) {
  place(x);
  for (Eigen::Index i = 0; i < arm_.size(); ++i) {
    const Eigen::Index first = i * per_segment_;
    if constexpr (kStretches) {
      const Eigen::VectorXd& force = input_.force_nm(t_s);
      for (Eigen::Index j = first; j < first + per_segment_; ++j)
        out.segment<3>(3 * j) += Vec3(-force[3 * i + 1], force[3 * i], force[3 * i + 2]);
      continue;
    }
    const Eigen::Vector2d tau = input_.tau_nm(t_s, i);
    Vec3 couple(tau.x(), tau.y(), 0.0);
    if (first > 0) couple = rotation_[static_cast<std::size_t>(first - 1)] * couple;
    for (Eigen::Index angle = 2 * first; angle < 2 * (first + per_segment_); ++angle) {
      out[angle] += arm_.actuation == ActuationModel::couple
                        ? motion_.col(angle).head<3>().dot(couple)
                        : tau[angle % 2];
    }
  }
  for (const ExternalLoads::Load& load : external_loads_.loads()) {
    if (!load.on) continue;
    const double scale = ExternalLoads::scale(load, t_s);
    const std::size_t last = last_link(load.segment);
    const Vec3 end = origin_[last] + length_m(last, x) * rotation_[last].col(2);
    const Vec3 force = scale * (arm_.base_rotation.transpose() * load.force_n);
    Eigen::Matrix<double, 6, 1> wrench;
    wrench << end.cross(force) + scale * (arm_.base_rotation.transpose() * load.moment_nm), force;
    const Eigen::Index moved = kWidth * static_cast<Eigen::Index>(last + 1);
    out.head(moved).noalias() += motion_.leftCols(moved).transpose() * wrench;
  }
}

template <bool kStretches>
SecondOrderSystem::Powers LinkSystem<kStretches>::powers(double t_s, ConstVector x, ConstVector v) {
  scratch_.setZero();
  add_input(t_s, x, scratch_);
  if (external_loads_.base_moves()) {
    inertia(x, inertia_);  // for the first moments that the angles carry
    scratch_.noalias() -= lever_.transpose() * base_acceleration(t_s);
  }
  return {.supplied_w = scratch_.dot(v), .dissipated_w = v.dot(damping_.cwiseProduct(v))};
}

template <bool kStretches>
double LinkSystem<kStretches>::kinetic_energy_j(ConstVector x, ConstVector v) {
  double energy = 0.0;
  Vec3 spin = Vec3::Zero();
  Vec3 start = Vec3::Zero();  // velocity of the link's start
  for (std::size_t j = 0; j < links_.size(); ++j) {
    const Eigen::Index k = kWidth * static_cast<Eigen::Index>(j);
    const Turn t = turn(x[k], x[k + 1]);
    const Link& link = links_[j];
    spin = into(t, spin) + Vec3(t.cb * v[k], v[k + 1], t.sb * v[k]);
    start = into(t, start);
    const Vec3 along(spin.y(), -spin.x(), 0.0);  // per metre
    if constexpr (kStretches) {
      const Vec3 apart = length_m(j, x) * along + Vec3(0.0, 0.0, v[k + 2]);
      energy += 0.5 * link.mass_kg * (start + 0.5 * apart).squaredNorm() +
                0.5 * spread_kg(j) * apart.squaredNorm();
      start += apart;
    } else {
      energy += 0.5 * link.mass_kg * (start + 0.5 * link.length_m * along).squaredNorm() +
                0.5 * link.inertia_kgm2 * along.squaredNorm();
      start += link.length_m * along;
    }
    energy += 0.5 * link.payload_kg * start.squaredNorm();
  }
  return energy;
}

template <bool kStretches>
double LinkSystem<kStretches>::potential_energy_j(ConstVector x) {
  place(x);
  double energy = 0.5 * x.dot(stiffness_.cwiseProduct(x));
  for (std::size_t j = 0; j < links_.size(); ++j) {
    const Link& link = links_[j];
    const Vec3 along = length_m(j, x) * rotation_[j].col(2);
    energy -= gravity_.dot((link.mass_kg + link.payload_kg) * origin_[j] +
                           (0.5 * link.mass_kg + link.payload_kg) * along) +
              (link.mass_kg + link.payload_kg) * arm_.gravity_mps2.dot(arm_.base_position_m);
  }
  return energy;
}

template <bool kStretches>
void LinkSystem<kStretches>::spread(ConstVector u, Vector x) const {
  const double share = 1.0 / per_segment_;
  if (kStretches) x.setZero();
  for (Eigen::Index j = 0; j < static_cast<Eigen::Index>(links_.size()); ++j) {
    const Eigen::Index i = j / per_segment_;
    x[kWidth * j] = -share * u[2 * i + 1];
    x[kWidth * j + 1] = share * u[2 * i];
  }
}

template <bool kStretches>
void LinkSystem<kStretches>::segment_ends(ConstVector x, std::span<Eigen::Isometry3d> ends) const {
  Eigen::Matrix3d rotation = arm_.base_rotation;
  Vec3 origin = arm_.base_position_m;
  for (std::size_t j = 0; j < links_.size(); ++j) {
    const Eigen::Index k = kWidth * static_cast<Eigen::Index>(j);
    const Turn t = turn(x[k], x[k + 1]);
    Eigen::Matrix3d relative;
    relative << t.cb, 0.0, t.sb, t.sa * t.sb, t.ca, -t.sa * t.cb, -t.ca * t.sb, t.sa, t.ca * t.cb;
    rotation = rotation * relative;
    origin += length_m(j, x) * rotation.col(2);
    const std::size_t m = static_cast<std::size_t>(per_segment_);
    if (j % m == m - 1) {
      ends[j / m] = Eigen::Isometry3d::Identity();
      ends[j / m].linear() = rotation;
      ends[j / m].translation() = origin;
    }
  }
}

template <bool kStretches>
PlantShape LinkSystem<kStretches>::shape(ConstVector x) const {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() = arm_.base_rotation;
  frame.translation() = arm_.base_position_m;
  PlantShape shape{.bend_rad = Eigen::VectorXd(2 * links_.size()),
                   .points_m = {frame.translation()}};
  for (std::size_t j = 0; j < links_.size(); ++j) {
    const Eigen::Index k = kWidth * static_cast<Eigen::Index>(j);
    shape.bend_rad.segment<2>(2 * static_cast<Eigen::Index>(j)) << x[k + 1], -x[k];
    frame.rotate(Eigen::AngleAxisd(x[k], Vec3::UnitX()));
    frame.rotate(Eigen::AngleAxisd(x[k + 1], Vec3::UnitY()));
    frame.translate(length_m(j, x) * Vec3::UnitZ());
    shape.points_m.emplace_back(frame.translation());
  }
  return shape;
}

template <bool kStretches>
void LinkSystem<kStretches>::curvature(ConstVector x, ConstVector v, Vector u, Vector rate) const {
  for (Eigen::Index i = 0; i < arm_.size(); ++i) {
    // From the segment's last link back to its start, everything in the frame of the link reached.
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Vec3 chord = Vec3::Zero();
    Vec3 angular = Vec3::Zero();
    for (Eigen::Index j = (i + 1) * per_segment_ - 1; j >= i * per_segment_; --j) {
      const Eigen::Index k = kWidth * j;
      const Turn t = turn(x[k], x[k + 1]);
      chord.z() += length_m(static_cast<std::size_t>(j), x);
      chord = out_of(t, chord);
      angular = out_of(t, angular + Vec3(t.cb * v[k], v[k + 1], t.sb * v[k]));
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        rotation.col(axis) = out_of(t, rotation.col(axis));
      }
    }
    Eigen::Vector2d bend, bend_rate;
    fit_segment(rotation, chord, angular, bend, bend_rate);
    u.segment<2>(2 * i) = bend;
    rate.segment<2>(2 * i) = bend_rate;
  }
}

template class LinkSystem<false>;
template class LinkSystem<true>;

}  // namespace softarm
