#include "control/evaluated_motion.hpp"

#include "softarm/model/kinematics.hpp"
#include "softarm/model/polar.hpp"
#include "softarm/model/segment.hpp"

namespace softarm {
namespace {

void to_polar(const Eigen::VectorXd& q, Eigen::Matrix3Xd& jacobian) {
  Eigen::MatrixXd copy = jacobian;
  jacobian_to_polar(q, copy);
  jacobian = copy;
}

}  // namespace

EvaluatedMotion direct_motion(const EvalCase& in, DynamicsWorkspace& workspace,
                              const Eigen::VectorXd& u, const Eigen::VectorXd& velocity) {
  const ArmParameters& arm = in.arm;
  EvaluatedMotion m(arm);
  forward_kinematics(arm, u, m.ends);
  for (std::size_t i = 0; i < m.local.size(); ++i) {
    const Eigen::Index at = arm.segment_dof() * static_cast<Eigen::Index>(i);
    const Eigen::Vector2d one = u.segment<2>(at);
    const double elongation = arm.extensible ? u(at + 2) : 0.0;
    m.local[i].topLeftCorner<3, 3>() = segment_rotation(one);
    m.local[i].topRightCorner<3, 1>() = segment_tip(arm.segments[i].length_m + elongation, one);
  }
  mass_centres(arm, u, m.centres);
  tip_jacobians(arm, u, velocity, m.J, m.J_rate);
  tip_angular_jacobian(arm, u, m.J_angular);
  dynamics_matrices(arm, workspace, u, velocity, m.B, m.C, m.G);
  m.kinetic_energy = kinetic_energy(arm, workspace, u, velocity);
  m.gravity_potential = gravity_potential(arm, u);
  if (in.polar) {
    Eigen::MatrixXd rate = m.J_rate;
    jacobian_rate_to_polar(in.q, in.qd, m.J, rate);
    m.J_rate = rate;
    to_polar(in.q, m.J);
    to_polar(in.q, m.J_angular);
    dynamics_to_polar(in.q, in.qd, m.B, m.C, m.G);
  }
  return m;
}

EvaluatedMotion augmented_motion(const EvalCase& in, AugmentedRobot& robot) {
  EvaluatedMotion m(in.arm);
  robot.update(in.q, in.qd);
  for (int i = 0; i < in.arm.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    m.ends[at] = robot.segment_end(i + 1);
    m.local[at] = (robot.segment_end(i).inverse() * m.ends[at]).matrix();
    m.centres.col(i) = robot.mass_centre(i + 1);
    m.gravity_potential -= in.arm.segments[at].mass_kg * in.arm.gravity_mps2.dot(m.centres.col(i));
  }
  robot.tip_jacobians(m.J, m.J_rate);
  robot.tip_angular_jacobian(m.J_angular);
  m.B = robot.B();
  m.C = robot.C();
  m.G = robot.G();
  m.kinetic_energy = 0.5 * in.qd.dot(m.B * in.qd);
  return m;
}

}  // namespace softarm
