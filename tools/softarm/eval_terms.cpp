// Every term of the model for one state, in the state's own coordinates.
#include <cmath>
#include <utility>

#include "softarm/eval_case.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/kinematics.hpp"
#include "softarm/model/polar.hpp"
#include "softarm/model/segment.hpp"

namespace softarm {
namespace {

/// At and below this |sin theta| the couple matrix counts as singular.
constexpr double kSingularSine = 1e-14;

using Shape = EvalTerm::Shape;

class Evaluation {
 public:
  explicit Evaluation(const EvalCase& input)
      : case_(input),
        arm_(input.arm),
        dof_(input.arm.dof()),
        workspace_(input.arm),
        u_(input.q),
        velocity_(input.qd) {
    if (case_.polar) {
      polar_to_u(case_.q, u_);
      polar_velocity_to_u(case_.q, case_.qd, velocity_);
    }
  }

  std::vector<NamedTerm> run() {
    poses();
    jacobians();
    dynamics();
    impedance();
    actuation();
    energies();
    if (case_.control) control(*case_.control);
    if (case_.tau_actuation) forward(*case_.tau_actuation);
    if (case_.inverse_kinematics) inverse(*case_.inverse_kinematics);
    return std::move(terms_);
  }

 private:
  void add(const char* name, Shape shape, std::vector<Eigen::MatrixXd> matrices) {
    terms_.push_back({name, {shape, std::move(matrices)}});
  }
  void add(const char* name, Shape shape, Eigen::MatrixXd matrix) {
    add(name, shape, std::vector<Eigen::MatrixXd>{std::move(matrix)});
  }
  void add_missing(const char* name) { add(name, Shape::matrix, std::vector<Eigen::MatrixXd>{}); }

  void poses() {
    const auto n = static_cast<std::size_t>(arm_.size());
    std::vector<Eigen::Isometry3d> ends(n);
    forward_kinematics(arm_, u_, ends);
    std::vector<Eigen::MatrixXd> world(n), local(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector2d u = u_.segment<2>(2 * static_cast<Eigen::Index>(i));
      world[i] = ends[i].matrix();
      local[i] = Eigen::Matrix4d::Identity();
      local[i].topLeftCorner<3, 3>() = segment_rotation(u);
      local[i].topRightCorner<3, 1>() = segment_tip(arm_.segments[i].length_m, u);
    }
    tip_ = ends.back().translation();
    Eigen::Matrix3Xd centres(3, arm_.size());
    mass_centres(arm_, u_, centres);
    add("T_world", Shape::list, std::move(world));
    add("T_local", Shape::list, std::move(local));
    add("com_world", Shape::matrix, centres.transpose());
  }

  void jacobians() {
    J_.resize(3, dof_);
    J_rate_.resize(3, dof_);
    Eigen::Matrix3Xd J_angular(3, dof_);
    tip_jacobians(arm_, u_, velocity_, J_, J_rate_);
    tip_angular_jacobian(arm_, u_, J_angular);
    if (case_.polar) {
      const Eigen::MatrixXd in_u = J_;
      to_polar(J_);
      to_polar(J_angular);
      Eigen::MatrixXd rate = J_rate_;
      jacobian_rate_to_polar(case_.q, case_.qd, in_u, rate);
      J_rate_ = rate;
    }
    add("J_tip", Shape::matrix, J_);
    add("Jdot_tip", Shape::matrix, J_rate_);
    add("Jw_tip", Shape::matrix, J_angular);
  }

  void to_polar(Eigen::Matrix3Xd& jacobian) const {
    Eigen::MatrixXd copy = jacobian;
    jacobian_to_polar(case_.q, copy);
    jacobian = copy;
  }

  void dynamics() {
    B_.resize(dof_, dof_);
    C_.resize(dof_, dof_);
    G_.resize(dof_);
    dynamics_matrices(arm_, workspace_, u_, velocity_, B_, C_, G_);
    if (case_.polar) dynamics_to_polar(case_.q, case_.qd, B_, C_, G_);
    add("B", Shape::matrix, B_);
    add("C", Shape::matrix, C_);
    add("Cqd", Shape::vector, C_ * case_.qd);
    add("G", Shape::vector, G_);
  }

  void impedance() {
    K_.resize(dof_);
    D_.resize(dof_);
    for (int i = 0; i < arm_.size(); ++i) {
      const SegmentParameters& segment = arm_.segments[static_cast<std::size_t>(i)];
      const double k = segment.stiffness_nm_per_rad, beta = segment.damping_nms_per_rad;
      const double theta = case_.q(2 * i + 1);
      K_.segment<2>(2 * i) << (case_.polar ? 0.0 : k), k;
      D_.segment<2>(2 * i) << (case_.polar ? beta * theta * theta : beta), beta;
    }
    add("K", Shape::matrix, Eigen::MatrixXd(K_.asDiagonal()));
    add("D", Shape::matrix, Eigen::MatrixXd(D_.asDiagonal()));
  }

  void actuation() {
    for (const auto& [name, model] : {std::pair{"A_couple", ActuationModel::couple},
                                      std::pair{"A_chamber", ActuationModel::chamber}}) {
      Eigen::MatrixXd A = Eigen::MatrixXd::Zero(dof_, dof_);
      for (int i = 0; i < dof_; i += 2) {
        A.block<2, 2>(i, i) = case_.polar ? polar_actuation_matrix(model, case_.q.segment<2>(i))
                                          : actuation_matrix(model, u_.segment<2>(i));
      }
      add(name, Shape::matrix, A);
    }
  }

  void energies() {
    add("kinetic_energy", Shape::number,
        Eigen::MatrixXd::Constant(1, 1, kinetic_energy(arm_, workspace_, u_, velocity_)));
    add("gravity_potential", Shape::number,
        Eigen::MatrixXd::Constant(1, 1, gravity_potential(arm_, u_)));
  }

  /// (17) before A^-1, in the case's coordinates. Angles are not wrapped.
  void control(const EvalControl& in) {
    const Eigen::VectorXd tau =
        G_ + C_ * in.velocity + B_ * in.acceleration + K_.cwiseProduct(in.reference) +
        in.kp.cwiseProduct(in.reference - case_.q) + D_.cwiseProduct(in.velocity) +
        in.kd.cwiseProduct(in.velocity - case_.qd);
    add("tau", Shape::vector, tau);
    add_actuation_torque("tau_A_couple", ActuationModel::couple, tau);
    add_actuation_torque("tau_A_chamber", ActuationModel::chamber, tau);
  }

  /// A^-1 tau; no value where A of any segment is singular.
  void add_actuation_torque(const char* name, ActuationModel model, const Eigen::VectorXd& tau) {
    Eigen::VectorXd result(dof_);
    for (int i = 0; i < dof_; i += 2) {
      const Eigen::Vector2d q = case_.q.segment<2>(i), force = tau.segment<2>(i);
      if (singular(model, q)) return add_missing(name);
      if (case_.polar) {
        const double r = model == ActuationModel::couple ? std::sin(q.y()) : q.y();
        const double c = std::cos(q.x()), s = std::sin(q.x());
        result.segment<2>(i) << -c * force.x() / r - s * force.y(),
            -s * force.x() / r + c * force.y();
      } else {
        result.segment<2>(i) = solve_actuation(model, q, force, 0.0);
      }
    }
    add(name, Shape::vector, result);
  }

  bool singular(ActuationModel model, const Eigen::Vector2d& q) const {
    if (model == ActuationModel::chamber) return case_.polar && q.y() == 0.0;
    if (case_.polar) return std::abs(std::sin(q.y())) <= kSingularSine;
    const double theta = q.norm();
    return theta > 1.0 && std::abs(std::sin(theta)) <= kSingularSine;
  }

  /// u'' of (16), solved in u, where B is regular at theta = 0, then taken to the case's
  /// coordinates.
  void forward(const Eigen::VectorXd& tau_actuation) {
    bool at_zero = false;
    for (int i = 1; i < dof_; i += 2) at_zero = at_zero || (case_.polar && case_.q(i) == 0.0);
    for (const auto& [name, model] : {std::pair{"qdd_couple", ActuationModel::couple},
                                      std::pair{"qdd_chamber", ActuationModel::chamber}}) {
      arm_.actuation = model;
      Eigen::VectorXd force(dof_), acceleration(dof_), result(dof_);
      apply_actuation(arm_, u_, tau_actuation, force);
      const bool solved = forward_dynamics(arm_, workspace_, u_, velocity_, force, acceleration);
      result = acceleration;
      if (case_.polar) u_acceleration_to_polar(case_.q, case_.qd, acceleration, result);
      if (solved && !at_zero) {
        add(name, Shape::vector, result);
      } else {
        add_missing(name);
      }
    }
  }

  void inverse(const EvalInverseKinematics& in) {
    Eigen::VectorXd velocity(dof_), acceleration(dof_);
    if (inverse_kinematics(in.gains, J_, J_rate_, case_.qd, tip_, in.reference, velocity,
                           acceleration)) {
      add("qbar_dot", Shape::vector, velocity);
      add("qbar_ddot", Shape::vector, acceleration);
    } else {
      add_missing("qbar_dot");
      add_missing("qbar_ddot");
    }
  }

  const EvalCase& case_;
  ArmParameters arm_;
  int dof_;
  DynamicsWorkspace workspace_;
  Eigen::VectorXd u_, velocity_, G_, K_, D_;
  Eigen::MatrixXd B_, C_;
  Eigen::Matrix3Xd J_, J_rate_;
  Eigen::Vector3d tip_ = Eigen::Vector3d::Zero();
  std::vector<NamedTerm> terms_;
};

}  // namespace

std::vector<NamedTerm> evaluate(const EvalCase& eval_case) { return Evaluation(eval_case).run(); }

}  // namespace softarm
