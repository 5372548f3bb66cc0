#include "softarm/model/kinematics.hpp"

#include "model/point_motion.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/segment.hpp"

namespace softarm {
namespace {

/// Bending and present length of segment i.
struct Shape {
  Eigen::Vector2d u;
  double length;

  Shape(const ArmParameters& arm, ConstVectorRef q, int i) noexcept
      : u(q(arm.segment_dof() * i), q(arm.segment_dof() * i + 1)),
        length(arm.segments[static_cast<std::size_t>(i)].length_m) {
    if (arm.extensible) length += q(3 * i + 2);
  }
};

/// Tip relative to the base's origin and its rate along v; world axes.
struct TipMotion {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
};

/// Walks from base to tip: where S_{i-1} is and how it moves.
struct Walk {
  Eigen::Matrix3d R;                                 ///< S_{i-1} in the world
  Eigen::Vector3d p = Eigen::Vector3d::Zero();       ///< p_{i-1} relative to the base
  Eigen::Vector3d p_rate = Eigen::Vector3d::Zero();  ///< its rate
  Vector3 spin{0, 0, 0};                             ///< angular velocity of S_{i-1}, in S_{i-1}
};

template <bool kExtensible>
struct StepColumns {
  Vec3<Columns<kExtensible>> translation, rotation, translation_rate, rotation_rate;
};

/// Columns of segment i in S_{i-1}, rates relative to the world where `velocity` is given; then on
/// to S_i.
template <bool kExtensible>
StepColumns<kExtensible> step(const ArmParameters& arm, ConstVectorRef q, const double* velocity,
                              int i, Walk& walk) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  const Shape shape(arm, q, i);
  const double ux = shape.u.x(), uy = shape.u.y();
  const double* v = velocity == nullptr ? nullptr : velocity + kWidth * i;
  const auto c = entire<8>(ux * ux + uy * uy);
  const Spin turn_rate = spin(c);
  SegmentState<kExtensible> state{
      ux, uy, v == nullptr ? Direction{0, 0, 0} : direction(ux, uy, v[0], v[1]), walk.spin, {}};
  if constexpr (kExtensible) {
    const double inverse = 1.0 / shape.length;
    state.stretch = {v == nullptr ? 0.0 : v[2] * inverse, inverse};
  }
  const PointMotion<kExtensible> tip = point_motion(tip_curve(shape.length, c), state);
  const PairVector3 rotation = columns(turn_rate, ux, uy);
  const PairVector3 rotation_rate =
      column_rates(turn_rate, ux, uy, state.v) + cross(walk.spin, rotation);
  walk.p += walk.R * to_eigen(tip.place);
  walk.p_rate += walk.R * to_eigen(tip.rate);
  walk.spin =
      rotate_back(Turn{ux, uy, c[0], c[1], c[2]}, walk.spin + first(turn_rate, ux, uy, state.v));
  walk.R = walk.R * segment_rotation(shape.u);
  return {tip.J, without_elongation<kExtensible>(rotation), tip.J_rate,
          without_elongation<kExtensible>(rotation_rate)};
}

template <class Column>
auto to_world(const Eigen::Matrix3d& R, const Vec3<Column>& v) noexcept {
  constexpr int kWidth = std::is_same_v<Column, Pair> ? 2 : 3;
  Eigen::Matrix<double, 3, kWidth> local;
  for (int k = 0; k < kWidth; ++k) local.col(k) = to_eigen(column(v, k));
  return (R * local).eval();
}

template <bool kExtensible>
TipMotion tip_motion(const ArmParameters& arm, ConstVectorRef q, const double* velocity) noexcept {
  Walk walk{arm.base_rotation};
  for (int i = 0; i < arm.size(); ++i) step<kExtensible>(arm, q, velocity, i, walk);
  return {walk.p, walk.p_rate};
}

/// Two walks: the first finds the tip, the second the columns about it. `jacobian` or `rate` may be
/// null.
template <bool kExtensible>
void fill_jacobians(const ArmParameters& arm, ConstVectorRef q, const double* velocity,
                    JacobianRef* jacobian, JacobianRef* rate) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  const TipMotion tip = tip_motion<kExtensible>(arm, q, velocity);
  Walk walk{arm.base_rotation};
  for (int i = 0; i < arm.size(); ++i) {
    const Eigen::Matrix3d R = walk.R;
    const auto c = step<kExtensible>(arm, q, velocity, i, walk);
    const Eigen::Vector3d lever = tip.position - walk.p;
    const Eigen::Vector3d lever_rate = tip.rate - walk.p_rate;
    const auto rotation = to_world(R, c.rotation);
    const auto translation = to_world(R, c.translation);
    for (int k = 0; k < kWidth; ++k) {
      if (jacobian != nullptr) {
        jacobian->col(kWidth * i + k) = translation.col(k) + rotation.col(k).cross(lever);
      }
    }
    if (rate == nullptr) continue;
    const auto rotation_rate = to_world(R, c.rotation_rate);
    const auto translation_rate = to_world(R, c.translation_rate);
    for (int k = 0; k < kWidth; ++k) {
      rate->col(kWidth * i + k) = translation_rate.col(k) + rotation_rate.col(k).cross(lever) +
                                  rotation.col(k).cross(lever_rate);
    }
  }
}

void jacobians(const ArmParameters& arm, ConstVectorRef q, const double* velocity,
               JacobianRef* jacobian, JacobianRef* rate) noexcept {
  const auto fill = arm.extensible ? fill_jacobians<true> : fill_jacobians<false>;
  fill(arm, q, velocity, jacobian, rate);
}

template <bool kExtensible>
void add_to_columns(const ArmParameters& arm, ConstVectorRef q, const Eigen::Vector3d& force_n,
                    VectorRef& generalized_force) noexcept {
  constexpr int kWidth = kCoordinates<kExtensible>;
  const TipMotion tip = tip_motion<kExtensible>(arm, q, nullptr);
  Walk walk{arm.base_rotation};
  for (int i = 0; i < arm.size(); ++i) {
    const Eigen::Matrix3d R = walk.R;
    const auto c = step<kExtensible>(arm, q, nullptr, i, walk);
    const Eigen::Vector3d moment = (tip.position - walk.p).cross(force_n);
    generalized_force.segment<kWidth>(kWidth * i) +=
        to_world(R, c.translation).transpose() * force_n +
        to_world(R, c.rotation).transpose() * moment;
  }
}

/// S_{i-1} in the world, from the base on.
struct Frame {
  Eigen::Matrix3d R;
  Eigen::Vector3d p;

  explicit Frame(const ArmParameters& arm) noexcept
      : R(arm.base_rotation), p(arm.base_position_m) {}

  void advance(const Shape& shape) noexcept {
    p += R * segment_tip(shape.length, shape.u);
    R = R * segment_rotation(shape.u);
  }
  Eigen::Vector3d centre(const Shape& shape) const noexcept {
    return p + R * segment_centre(shape.length, shape.u);
  }
  Eigen::Isometry3d pose() const noexcept {
    Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
    result.linear() = R;
    result.translation() = p;
    return result;
  }
};

}  // namespace

void forward_kinematics(const ArmParameters& arm, ConstVectorRef u,
                        std::span<Eigen::Isometry3d> segment_ends) noexcept {
  Frame frame(arm);
  for (int i = 0; i < arm.size(); ++i) {
    frame.advance(Shape(arm, u, i));
    segment_ends[static_cast<std::size_t>(i)] = frame.pose();
  }
}

void mass_centres(const ArmParameters& arm, ConstVectorRef u, JacobianRef centres) noexcept {
  Frame frame(arm);
  for (int i = 0; i < arm.size(); ++i) {
    const Shape shape(arm, u, i);
    centres.col(i) = frame.centre(shape);
    frame.advance(shape);
  }
}

Eigen::Isometry3d tip_pose(const ArmParameters& arm, ConstVectorRef u) noexcept {
  Frame frame(arm);
  for (int i = 0; i < arm.size(); ++i) frame.advance(Shape(arm, u, i));
  return frame.pose();
}

Eigen::Vector3d tip_position(const ArmParameters& arm, ConstVectorRef u) noexcept {
  return tip_pose(arm, u).translation();
}

void tip_jacobian(const ArmParameters& arm, ConstVectorRef u, JacobianRef jacobian) noexcept {
  jacobians(arm, u, nullptr, &jacobian, nullptr);
}

void tip_jacobian_rate(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef velocity,
                       JacobianRef jacobian_rate) noexcept {
  jacobians(arm, u, velocity.data(), nullptr, &jacobian_rate);
}

void tip_jacobians(const ArmParameters& arm, ConstVectorRef u, ConstVectorRef velocity,
                   JacobianRef jacobian, JacobianRef jacobian_rate) noexcept {
  jacobians(arm, u, velocity.data(), &jacobian, &jacobian_rate);
}

void tip_angular_jacobian(const ArmParameters& arm, ConstVectorRef u,
                          JacobianRef jacobian) noexcept {
  Eigen::Matrix3d R = arm.base_rotation;
  for (int i = 0; i < arm.size(); ++i) {
    const Shape shape(arm, u, i);
    jacobian.middleCols<2>(arm.segment_dof() * i) = R * segment_angular_jacobian(shape.u);
    if (arm.extensible) jacobian.col(3 * i + 2).setZero();
    R = R * segment_rotation(shape.u);
  }
}

double gravity_potential(const ArmParameters& arm, ConstVectorRef u) noexcept {
  double energy = 0.0;
  Frame frame(arm);
  for (int i = 0; i < arm.size(); ++i) {
    const Shape shape(arm, u, i);
    const double mass = arm.segments[static_cast<std::size_t>(i)].mass_kg;
    energy -= mass * arm.gravity_mps2.dot(frame.centre(shape));
    frame.advance(shape);
  }
  return energy;
}

void add_tip_force(const ArmParameters& arm, ConstVectorRef u, const Eigen::Vector3d& force_n,
                   VectorRef generalized_force) noexcept {
  const auto add = arm.extensible ? add_to_columns<true> : add_to_columns<false>;
  add(arm, u, force_n, generalized_force);
}

}  // namespace softarm
