// A rigid serial robot of any joints with point masses on its links: Jacobians, B_xi, C_xi, G_xi.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "softarm/model/arm.hpp"

namespace softarm {

/// One joint in the classic Denavit-Hartenberg convention, A = Rz(theta) Tz(d) Tx(a) Rx(alpha). The
/// joint's variable is theta (revolute) or d (prismatic); the other one is the constant `fixed`.
struct DhJoint {
  bool prismatic = false;
  double fixed = 0.0;                       ///< m, or rad of a prismatic joint
  double a = 0.0;                           ///< m
  double cos_alpha = 1.0, sin_alpha = 0.0;  ///< given so, a right angle is exact
  double mass_kg = 0.0;                     ///< a point at the origin of the joint's outer frame
};

/// Frame 0 is the base, frame j the outer frame of joint j - 1; joint j turns about or slides along
/// z of frame j. Vectors in and out are in the base frame, inside in the link frames: what a joint
/// near a point does to that point then keeps its relative accuracy wherever the chain before it
/// stands. N joints; no function below allocates.
class SerialRobot {
 public:
  explicit SerialRobot(std::vector<DhJoint> joints);

  /// Must precede the others. `xi` and `xi_velocity` of N, in rad or m and per s.
  void update(ConstVectorRef xi, ConstVectorRef xi_velocity) noexcept;

  int joints() const noexcept { return static_cast<int>(joints_.size()); }
  const Eigen::Matrix3d& orientation(int frame) const noexcept { return at(frame).orientation; }
  const Eigen::Vector3d& position(int frame) const noexcept { return at(frame).position; }

  /// The Jacobian of the origin of `frame` and its rate, 3 x frame: the joints before it.
  void jacobians(int frame, Eigen::Ref<Eigen::Matrix3Xd> J,
                 Eigen::Ref<Eigen::Matrix3Xd> J_rate) const noexcept;
  /// Angular velocity of `frame` for unit joint velocities, 3 x frame.
  void angular_jacobian(int frame, Eigen::Ref<Eigen::Matrix3Xd> J) const noexcept;

  /// B_xi = sum m J'J, C_xi = sum m J' J-dot (for point masses these are the Christoffel symbols),
  /// N x N, and G_xi = -sum m J' g, N. O(N^2) a mass.
  void dynamics(const Eigen::Vector3d& gravity, Eigen::Ref<Eigen::MatrixXd> B_xi,
                Eigen::Ref<Eigen::MatrixXd> C_xi, VectorRef G_xi) noexcept;

 private:
  struct Frame {
    Eigen::Matrix3d orientation;       ///< in the base
    Eigen::Vector3d position;          ///< in the base
    Eigen::Vector3d angular_velocity;  ///< in this frame
    double cosine, sine, shift;        ///< cos theta, sin theta and d of the joint that starts here
    double rate;                       ///< of that joint
  };
  const Frame& at(int frame) const noexcept { return frames_[static_cast<std::size_t>(frame)]; }

  std::vector<DhJoint> joints_;
  std::vector<Frame> frames_;  ///< N + 1
  Eigen::Matrix3Xd J_, J_rate_;
};

}  // namespace softarm
