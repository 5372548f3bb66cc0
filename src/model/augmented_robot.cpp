#include "softarm/model/augmented_robot.hpp"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "model/augmented_chain.hpp"
#include "model/augmented_map.hpp"

namespace softarm {
namespace {

/// Joints before a segment's mass.
constexpr int kJointsToMass = 5;

/// Table I. The length of a segment is in m(q) alone.
std::vector<DhJoint> table_1(const ArmParameters& arm) {
  const DhJoint turn{}, turn_down{.cos_alpha = 0.0, .sin_alpha = -1.0},
      turn_up{.cos_alpha = 0.0, .sin_alpha = 1.0},
      slide{.prismatic = true, .cos_alpha = 0.0, .sin_alpha = -1.0};
  std::vector<DhJoint> joints;
  for (const SegmentParameters& segment : arm.segments) {
    DhJoint to_mass = turn;
    to_mass.mass_kg = segment.mass_kg;
    for (const DhJoint& joint : {turn_down, turn_up, slide, turn_up, to_mass,  //
                                 turn_down, turn_up, slide, turn_up, turn}) {
      joints.push_back(joint);
    }
  }
  return joints;
}

const ArmParameters& checked(const ArmParameters& arm) {
  if (arm.size() < 1) {
    throw std::invalid_argument("AugmentedRobot: expected at least one segment, got 0");
  }
  expect_constant_length(arm, "AugmentedRobot");
  if (arm.mass != MassModel::point) {
    throw std::invalid_argument(
        "AugmentedRobot: expected point masses, got distributed mass (Table I has one point mass a "
        "segment)");
  }
  return arm;
}

}  // namespace

AugmentedRobot::AugmentedRobot(const ArmParameters& arm)
    : arm_(checked(arm)),
      robot_(std::make_unique<SerialRobot>(table_1(arm))),
      gravity_(arm.base_rotation.transpose() * arm.gravity_mps2),
      G_(arm.dof()),
      B_(arm.dof(), arm.dof()),
      C_(arm.dof(), arm.dof()) {
  const int joints = robot_->joints(), dof = arm.dof();
  xi_.setZero(joints);
  xi_velocity_.setZero(joints);
  map_jacobian_.setZero(joints, dof);
  map_jacobian_rate_.setZero(joints, dof);
  for (auto* jacobian : {&J_xi_, &J_xi_rate_}) jacobian->setZero(3, joints);
  for (auto* jacobian : {&J_, &J_rate_}) jacobian->setZero(3, dof);
  update(Eigen::VectorXd::Zero(dof), Eigen::VectorXd::Zero(dof));
}

AugmentedRobot::~AugmentedRobot() = default;
AugmentedRobot::AugmentedRobot(AugmentedRobot&&) noexcept = default;
AugmentedRobot& AugmentedRobot::operator=(AugmentedRobot&&) noexcept = default;

void AugmentedRobot::update(ConstVectorRef q, ConstVectorRef velocity) noexcept {
  map(q, velocity);
  robot_->update(xi_, xi_velocity_);

  B_.setZero();
  C_.setZero();
  G_.setZero();
  for (int i = 0; i < arm_.size(); ++i) {
    const int frame = i * kJointsPerSegment + kJointsToMass, dof = 2 * (i + 1);
    const double mass = arm_.segments[static_cast<std::size_t>(i)].mass_kg;
    robot_->jacobians(frame, J_xi_.leftCols(frame), J_xi_rate_.leftCols(frame));
    // The joints behind the mass do not move it.
    J_xi_.middleCols<kJointsPerSegment - kJointsToMass>(frame).setZero();
    J_xi_rate_.middleCols<kJointsPerSegment - kJointsToMass>(frame).setZero();
    project(i + 1);
    const auto J_transposed = J_.leftCols(dof).transpose();
    B_.topLeftCorner(dof, dof) += mass * J_transposed.lazyProduct(J_.leftCols(dof));
    C_.topLeftCorner(dof, dof) += mass * J_transposed.lazyProduct(J_rate_.leftCols(dof));
    G_.head(dof) -= mass * J_transposed.lazyProduct(gravity_);
  }
}

/// xi, J_m and their rates. (6), (11)
void AugmentedRobot::map(ConstVectorRef q, ConstVectorRef velocity) noexcept {
  for (int i = 0; i < arm_.size(); ++i) {
    const int row = i * kJointsPerSegment, column = 2 * i;
    const Eigen::Vector2d v = velocity.segment<2>(column);
    const SegmentMap m =
        segment_map(arm_.segments[static_cast<std::size_t>(i)].length_m, q.segment<2>(column), v);
    xi_.segment<kJointsPerSegment>(row) = m.xi;
    xi_velocity_.segment<kJointsPerSegment>(row) = m.jacobian * v;
    map_jacobian_.block<kJointsPerSegment, 2>(row, column) = m.jacobian;
    map_jacobian_rate_.block<kJointsPerSegment, 2>(row, column) = m.jacobian_rate;
  }
}

/// J = J_xi J_m and J-dot = J_xi-dot J_m + J_xi J_m-dot of a point on one of the first `segments`.
void AugmentedRobot::project(int segments) noexcept {
  constexpr int k = kJointsPerSegment;
  for (int i = 0; i < segments; ++i) {
    const auto J_m = map_jacobian_.block<k, 2>(k * i, 2 * i);
    const auto J_m_rate = map_jacobian_rate_.block<k, 2>(k * i, 2 * i);
    const auto J_xi = J_xi_.middleCols<k>(k * i), J_xi_rate = J_xi_rate_.middleCols<k>(k * i);
    J_.middleCols<2>(2 * i) = J_xi.lazyProduct(J_m);
    J_rate_.middleCols<2>(2 * i) = J_xi_rate.lazyProduct(J_m) + J_xi.lazyProduct(J_m_rate);
  }
}

void AugmentedRobot::tip_jacobians(JacobianRef J, JacobianRef J_rate) noexcept {
  robot_->jacobians(robot_->joints(), J_xi_, J_xi_rate_);
  project(arm_.size());
  J = arm_.base_rotation.lazyProduct(J_);
  J_rate = arm_.base_rotation.lazyProduct(J_rate_);
}

void AugmentedRobot::tip_angular_jacobian(JacobianRef J) noexcept {
  robot_->angular_jacobian(robot_->joints(), J_xi_);
  project(arm_.size());
  J = arm_.base_rotation.lazyProduct(J_);
}

Eigen::Isometry3d AugmentedRobot::segment_end(int i) const noexcept {
  const int frame = i * kJointsPerSegment;
  Eigen::Isometry3d pose;
  pose.linear() = arm_.base_rotation * robot_->orientation(frame);
  pose.translation() = arm_.base_rotation * robot_->position(frame) + arm_.base_position_m;
  pose.makeAffine();
  return pose;
}

Eigen::Vector3d AugmentedRobot::mass_centre(int i) const noexcept {
  const int frame = (i - 1) * kJointsPerSegment + kJointsToMass;
  return arm_.base_rotation * robot_->position(frame) + arm_.base_position_m;
}

void AugmentedRobot::rigid_dynamics(Eigen::Ref<Eigen::MatrixXd> B_xi,
                                    Eigen::Ref<Eigen::MatrixXd> C_xi, VectorRef G_xi) noexcept {
  robot_->dynamics(gravity_, B_xi, C_xi, G_xi);
}

void AugmentedRobot::rigid_tip_jacobian(JacobianRef J_xi) noexcept {
  robot_->jacobians(robot_->joints(), J_xi_, J_xi_rate_);
  J_xi = arm_.base_rotation.lazyProduct(J_xi_);
}

}  // namespace softarm
