#include "model/augmented_chain.hpp"

#include <cmath>
#include <utility>

namespace softarm {
namespace {

using Eigen::Vector3d;

/// Rz Rx v: a vector of a joint's outer frame in its inner frame.
Vector3d inwards(const DhJoint& joint, double cosine, double sine, const Vector3d& v) noexcept {
  const double y = joint.cos_alpha * v.y() - joint.sin_alpha * v.z();
  const double z = joint.sin_alpha * v.y() + joint.cos_alpha * v.z();
  return {cosine * v.x() - sine * y, sine * v.x() + cosine * y, z};
}

/// (Rz Rx)' v.
Vector3d outwards(const DhJoint& joint, double cosine, double sine, const Vector3d& v) noexcept {
  const double y = cosine * v.y() - sine * v.x();
  return {cosine * v.x() + sine * v.y(), joint.cos_alpha * y + joint.sin_alpha * v.z(),
          joint.cos_alpha * v.z() - joint.sin_alpha * y};
}

/// z x v.
Vector3d turned(const Vector3d& v) noexcept { return {-v.y(), v.x(), 0.0}; }

}  // namespace

SerialRobot::SerialRobot(std::vector<DhJoint> joints)
    : joints_(std::move(joints)),
      frames_(joints_.size() + 1),
      J_(3, joints_.size()),
      J_rate_(3, joints_.size()) {
  frames_.front().orientation.setIdentity();
  frames_.front().position.setZero();
  frames_.front().angular_velocity.setZero();
}

void SerialRobot::update(ConstVectorRef xi, ConstVectorRef xi_velocity) noexcept {
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const DhJoint& joint = joints_[j];
    Frame& inner = frames_[j];
    Frame& outer = frames_[j + 1];
    const auto row = static_cast<Eigen::Index>(j);
    const double theta = joint.prismatic ? joint.fixed : xi(row);
    inner.shift = joint.prismatic ? xi(row) : joint.fixed;
    inner.cosine = std::cos(theta);
    inner.sine = std::sin(theta);
    inner.rate = xi_velocity(row);

    const Eigen::Matrix3d& R = inner.orientation;
    const Vector3d x = inner.cosine * R.col(0) + inner.sine * R.col(1);
    const Vector3d y = inner.cosine * R.col(1) - inner.sine * R.col(0);
    outer.orientation.col(0) = x;
    outer.orientation.col(1) = joint.cos_alpha * y + joint.sin_alpha * R.col(2);
    outer.orientation.col(2) = joint.cos_alpha * R.col(2) - joint.sin_alpha * y;
    outer.position = inner.position + inner.shift * R.col(2) + joint.a * x;

    Vector3d angular_velocity = inner.angular_velocity;
    if (!joint.prismatic) angular_velocity.z() += inner.rate;
    outer.angular_velocity = outwards(joint, inner.cosine, inner.sine, angular_velocity);
  }
}

void SerialRobot::jacobians(int frame, Eigen::Ref<Eigen::Matrix3Xd> J,
                            Eigen::Ref<Eigen::Matrix3Xd> J_rate) const noexcept {
  // The point and its velocity relative to each frame on the way in.
  Vector3d p = Vector3d::Zero(), v = Vector3d::Zero();
  for (int j = frame - 1; j >= 0; --j) {
    const DhJoint& joint = joints_[static_cast<std::size_t>(j)];
    const Frame& f = at(j);
    p = inwards(joint, f.cosine, f.sine, p + Vector3d(joint.a, 0.0, 0.0));
    p.z() += f.shift;
    v = inwards(joint, f.cosine, f.sine, v);
    const Vector3d column = joint.prismatic ? Vector3d::UnitZ() : turned(p);
    v += f.rate * column;
    // The column turns with its frame; a revolute joint's also follows the point.
    Vector3d column_rate = f.angular_velocity.cross(column);
    if (!joint.prismatic) column_rate += turned(v);
    J.col(j) = f.orientation * column;
    J_rate.col(j) = f.orientation * column_rate;
  }
}

void SerialRobot::angular_jacobian(int frame, Eigen::Ref<Eigen::Matrix3Xd> J) const noexcept {
  for (int j = 0; j < frame; ++j) {
    if (joints_[static_cast<std::size_t>(j)].prismatic) {
      J.col(j).setZero();
    } else {
      J.col(j) = at(j).orientation.col(2);
    }
  }
}

void SerialRobot::dynamics(const Vector3d& gravity, Eigen::Ref<Eigen::MatrixXd> B_xi,
                           Eigen::Ref<Eigen::MatrixXd> C_xi, VectorRef G_xi) noexcept {
  B_xi.setZero();
  C_xi.setZero();
  G_xi.setZero();
  for (int frame = 1; frame <= joints(); ++frame) {
    const double mass = joints_[static_cast<std::size_t>(frame - 1)].mass_kg;
    if (mass == 0.0) continue;
    jacobians(frame, J_.leftCols(frame), J_rate_.leftCols(frame));
    const auto J_transposed = J_.leftCols(frame).transpose();
    B_xi.topLeftCorner(frame, frame) += mass * J_transposed.lazyProduct(J_.leftCols(frame));
    C_xi.topLeftCorner(frame, frame) += mass * J_transposed.lazyProduct(J_rate_.leftCols(frame));
    G_xi.head(frame) -= mass * J_transposed.lazyProduct(gravity);
  }
}

}  // namespace softarm
