#include "softarm/model/kinematics.hpp"

#include "model/segment_geometry.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/segment.hpp"

namespace softarm {
namespace {

Eigen::Vector2d segment_of(ConstVectorRef v, int i) noexcept { return {v(2 * i), v(2 * i + 1)}; }
double length_of(const ArmParameters& arm, int i) noexcept {
  return arm.segments[static_cast<std::size_t>(i)].length_m;
}

/// Tip relative to the base's origin and its rate along v; world axes.
struct TipMotion {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
};

/// Walks from base to tip and gives `visit` every segment's columns, in the world: visit(i, R,
/// spin, curve and spin of i).
struct Walk {
  Eigen::Matrix3d R;                                 ///< S_{i-1} in the world
  Eigen::Vector3d p = Eigen::Vector3d::Zero();       ///< p_{i-1} relative to the base
  Eigen::Vector3d p_rate = Eigen::Vector3d::Zero();  ///< its rate
  Vector3 spin{0, 0, 0};                             ///< angular velocity of S_{i-1}, in S_{i-1}
};

struct Columns {
  PairVector3 translation, rotation, translation_rate, rotation_rate;
};

/// Columns of segment i in S_{i-1}, rates relative to the world where `v` is given; then on to S_i.
Columns step(Walk& walk, double length, const Eigen::Vector2d& u,
             const Eigen::Vector2d& v) noexcept {
  const double ux = u.x(), uy = u.y();
  const auto c = entire<8>(ux * ux + uy * uy);
  const Curve tip = tip_curve(length, c);
  const Spin turn_rate = spin(c);
  const Direction along = direction(ux, uy, v.x(), v.y());
  Columns out{columns(tip, ux, uy), columns(turn_rate, ux, uy), column_rates(tip, ux, uy, along),
              column_rates(turn_rate, ux, uy, along)};
  out.translation_rate += cross(walk.spin, out.translation);
  out.rotation_rate += cross(walk.spin, out.rotation);
  const Vector3 t = point(tip, ux, uy);
  walk.p += walk.R * to_eigen(t);
  walk.p_rate += walk.R * to_eigen(first(tip, ux, uy, along) + cross(walk.spin, t));
  walk.spin =
      rotate_back(Turn{ux, uy, c[0], c[1], c[2]}, walk.spin + first(turn_rate, ux, uy, along));
  walk.R = walk.R * segment_rotation(u);
  return out;
}

using WorldColumns = Eigen::Matrix<double, 3, 2>;
WorldColumns to_world(const Eigen::Matrix3d& R, const PairVector3& v) noexcept {
  WorldColumns local;
  local << v.x[0], v.x[1], v.y[0], v.y[1], v.z[0], v.z[1];
  return R * local;
}

TipMotion tip_motion(const ArmParameters& arm, ConstVectorRef u, const double* velocity) noexcept {
  Walk walk{arm.base_rotation};
  for (int i = 0; i < arm.size(); ++i) {
    const Eigen::Vector2d v = velocity != nullptr
                                  ? Eigen::Vector2d(velocity[2 * i], velocity[2 * i + 1])
                                  : Eigen::Vector2d::Zero();
    step(walk, length_of(arm, i), segment_of(u, i), v);
  }
  return {walk.p, walk.p_rate};
}

/// Two walks: the first finds the tip, the second the columns about it. `jacobian` may be null.
void fill_jacobians(const ArmParameters& arm, ConstVectorRef u, const double* velocity,
                    JacobianRef* jacobian, JacobianRef* rate) noexcept {
  const TipMotion tip = tip_motion(arm, u, velocity);
  Walk walk{arm.base_rotation};
  for (int i = 0; i < arm.size(); ++i) {
    const Eigen::Matrix3d R = walk.R;
    const Eigen::Vector2d v = velocity != nullptr
                                  ? Eigen::Vector2d(velocity[2 * i], velocity[2 * i + 1])
                                  : Eigen::Vector2d::Zero();
    const Columns c = step(walk, length_of(arm, i), segment_of(u, i), v);
    const Eigen::Vector3d lever = tip.position - walk.p;
    const Eigen::Vector3d lever_rate = tip.rate - walk.p_rate;
    const WorldColumns rotation = to_world(R, c.rotation);
    const WorldColumns translation = to_world(R, c.translation);
    for (int k = 0; k < 2; ++k) {
      if (jacobian != nullptr) {
        jacobian->col(2 * i + k) = translation.col(k) + rotation.col(k).cross(lever);
      }
    }
    if (rate == nullptr) continue;
    const WorldColumns rotation_rate = to_world(R, c.rotation_rate);
    const WorldColumns translation_rate = to_world(R, c.translation_rate);
    for (int k = 0; k < 2; ++k) {
      rate->col(2 * i + k) = translation_rate.col(k) + rotation_rate.col(k).cross(lever) +
                             rotation.col(k).cross(lever_rate);
    }
  }
}

}  // namespace

void forward_kinematics(const ArmParameters& arm, ConstVectorRef u,
                        std::span<Eigen::Isometry3d> segment_ends) noexcept {
  Eigen::Matrix3d R = arm.base_rotation;
  Eigen::Vector3d p = arm.base_position_m;
  for (int i = 0; i < arm.size(); ++i) {
    p += R * segment_tip(length_of(arm, i), segment_of(u, i));
    R = R * segment_rotation(segment_of(u, i));
    Eigen::Isometry3d& end = segment_ends[static_cast<std::size_t>(i)];
    end.setIdentity();
    end.linear() = R;
    end.translation() = p;
  }
}

void mass_centres(const ArmParameters& arm, ConstVectorRef u, JacobianRef centres) noexcept {
  Eigen::Matrix3d R = arm.base_rotation;
  Eigen::Vector3d p = arm.base_position_m;
  for (int i = 0; i < arm.size(); ++i) {
    centres.col(i) = p + R * segment_centre(length_of(arm, i), segment_of(u, i));
    p += R * segment_tip(length_of(arm, i), segment_of(u, i));
    R = R * segment_rotation(segment_of(u, i));
  }
}

Eigen::Isometry3d tip_pose(const ArmParameters& arm, ConstVectorRef u) noexcept {
  Eigen::Isometry3d tip = Eigen::Isometry3d::Identity();
  Eigen::Matrix3d R = arm.base_rotation;
  Eigen::Vector3d p = arm.base_position_m;
  for (int i = 0; i < arm.size(); ++i) {
    p += R * segment_tip(length_of(arm, i), segment_of(u, i));
    R = R * segment_rotation(segment_of(u, i));
  }
  tip.linear() = R;
  tip.translation() = p;
  return tip;
}

Eigen::Vector3d tip_position(const ArmParameters& arm, ConstVectorRef u) noexcept {
  return tip_pose(arm, u).translation();
}

void tip_jacobian(const ArmParameters& arm, ConstVectorRef u, JacobianRef jacobian) noexcept {
  fill_jacobians(arm, u, nullptr, &jacobian, nullptr);
}

void tip_jacobian_rate(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef velocity,
                       JacobianRef jacobian_rate) noexcept {
  fill_jacobians(arm, u, velocity.data(), nullptr, &jacobian_rate);
}

void tip_jacobians(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef velocity,
                   JacobianRef jacobian, JacobianRef jacobian_rate) noexcept {
  fill_jacobians(arm, u, velocity.data(), &jacobian, &jacobian_rate);
}

void tip_angular_jacobian(const ArmParameters& arm, ConstVectorRef u,
                          JacobianRef jacobian) noexcept {
  Eigen::Matrix3d R = arm.base_rotation;
  for (int i = 0; i < arm.size(); ++i) {
    jacobian.middleCols<2>(2 * i) = R * segment_angular_jacobian(segment_of(u, i));
    R = R * segment_rotation(segment_of(u, i));
  }
}

double gravity_potential(const ArmParameters& arm, ConstVectorRef u) noexcept {
  double energy = 0.0;
  Eigen::Matrix3d R = arm.base_rotation;
  Eigen::Vector3d p = arm.base_position_m;
  for (int i = 0; i < arm.size(); ++i) {
    const SegmentParameters& segment = arm.segments[static_cast<std::size_t>(i)];
    const Eigen::Vector3d centre = p + R * segment_centre(segment.length_m, segment_of(u, i));
    energy -= segment.mass_kg * arm.gravity_mps2.dot(centre);
    p += R * segment_tip(segment.length_m, segment_of(u, i));
    R = R * segment_rotation(segment_of(u, i));
  }
  return energy;
}

void add_tip_force(const ArmParameters& arm, ConstVectorRef u, const Eigen::Vector3d& force_n,
                   VectorRef generalized_force) noexcept {
  const TipMotion tip = tip_motion(arm, u, nullptr);
  Walk walk{arm.base_rotation};
  for (int i = 0; i < arm.size(); ++i) {
    const Eigen::Matrix3d R = walk.R;
    const Columns c = step(walk, length_of(arm, i), segment_of(u, i), Eigen::Vector2d::Zero());
    const Eigen::Vector3d moment = (tip.position - walk.p).cross(force_n);
    generalized_force.segment<2>(2 * i) += to_world(R, c.translation).transpose() * force_n +
                                           to_world(R, c.rotation).transpose() * moment;
  }
}

}  // namespace softarm
