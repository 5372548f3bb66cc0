#include "softarm/control/evaluation.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "control/evaluated_motion.hpp"
#include "softarm/model/actuation_matrix.hpp"
#include "softarm/model/augmented_robot.hpp"
#include "softarm/model/dynamics.hpp"
#include "softarm/model/polar.hpp"

namespace softarm {
namespace {

/// At and below this |sin theta| the couple matrix counts as singular.
constexpr double kSingularSine = 1e-14;

using Shape = EvalTerm::Shape;

class Evaluation {
 public:
  Evaluation(const EvalCase& input, EvalMethod method)
      : case_(input),
        method_(method),
        arm_(input.arm),
        dof_(input.arm.dof()),
        workspace_(input.arm),
        u_(input.q),
        velocity_(input.qd),
        motion_(input.arm) {
    if (case_.polar) {
      polar_to_u(case_.q, u_);
      polar_velocity_to_u(case_.q, case_.qd, velocity_);
    }
  }

  std::vector<NamedTerm> run() {
    if (method_ == EvalMethod::augmented) {
      augmented();
    } else {
      motion_ = direct_motion(case_, workspace_, u_, velocity_);
    }
    motion();
    impedance();
    actuation();
    add("kinetic_energy", motion_.kinetic_energy);
    add("gravity_potential", motion_.gravity_potential);
    if (case_.control) control(*case_.control);
    if (case_.tau_actuation) forward(*case_.tau_actuation);
    if (case_.inverse_kinematics) inverse(*case_.inverse_kinematics);
    if (case_.chambers) chambers(*case_.chambers);
    return std::move(terms_);
  }

 private:
  void add(const char* name, Shape shape, std::vector<Eigen::MatrixXd> matrices) {
    terms_.push_back({name, {shape, std::move(matrices)}});
  }
  void add(const char* name, Shape shape, Eigen::MatrixXd matrix) {
    add(name, shape, std::vector<Eigen::MatrixXd>{std::move(matrix)});
  }
  void add(const char* name, double number) {
    add(name, Shape::number, Eigen::MatrixXd::Constant(1, 1, number));
  }
  void add_missing(const char* name) { add(name, Shape::matrix, std::vector<Eigen::MatrixXd>{}); }

  void augmented() {
    if (!case_.polar) {
      throw std::invalid_argument("case " + case_.id +
                                  ": the augmented robot is in polar coordinates, expected coords "
                                  "polar, got " +
                                  (arm_.extensible ? "cartesian_ue" : "cartesian_u"));
    }
    AugmentedRobot robot(arm_);
    motion_ = augmented_motion(case_, robot);
    add("xi", Shape::vector, robot.xi());
    add("xi_dot", Shape::vector, robot.xi_velocity());
    add("J_m", Shape::matrix, robot.map_jacobian());
  }

  void motion() {
    std::vector<Eigen::MatrixXd> world;
    for (const auto& end : motion_.ends) world.emplace_back(end.matrix());
    add("T_world", Shape::list, std::move(world));
    add("T_local", Shape::list, motion_.local);
    add("com_world", Shape::matrix, motion_.centres.transpose());
    add("J_tip", Shape::matrix, motion_.J);
    add("Jdot_tip", Shape::matrix, motion_.J_rate);
    add("Jw_tip", Shape::matrix, motion_.J_angular);
    add("B", Shape::matrix, motion_.B);
    add("C", Shape::matrix, motion_.C);
    add("Cqd", Shape::vector, motion_.C * case_.qd);
    add("G", Shape::vector, motion_.G);
  }

  void impedance() {
    K_ = Eigen::VectorXd::Zero(dof_);
    D_ = K_;
    const Eigen::VectorXd zero = K_, one = Eigen::VectorXd::Ones(dof_);
    add_impedance(arm_, one, zero, K_);
    add_impedance(arm_, zero, one, D_);
    for (int i = 0; case_.polar && i < dof_; i += 2) {
      const double theta = case_.q(i + 1);
      K_(i) = 0.0;
      D_(i) = D_(i) * theta * theta;
    }
    add("K", Shape::matrix, Eigen::MatrixXd(K_.asDiagonal()));
    add("D", Shape::matrix, Eigen::MatrixXd(D_.asDiagonal()));
  }

  /// Force on e for unit N; the couple of (15) has none.
  static double axial(ActuationModel model) {
    return model == ActuationModel::chamber ? 1.0 : std::numeric_limits<double>::quiet_NaN();
  }

  Eigen::MatrixXd input_matrix(ActuationModel model) const {
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(dof_, dof_);
    for (int i = 0; i < dof_; i += arm_.segment_dof()) {
      A.block<2, 2>(i, i) = case_.polar ? polar_actuation_matrix(model, case_.q.segment<2>(i))
                                        : actuation_matrix(model, u_.segment<2>(i));
      if (arm_.extensible) A(i + 2, i + 2) = axial(model);
    }
    return A;
  }

  void actuation() {
    add("A_couple", Shape::matrix, input_matrix(ActuationModel::couple));
    add("A_chamber", Shape::matrix, input_matrix(ActuationModel::chamber));
  }

  /// (17) before A^-1, in the case's coordinates. Angles are not wrapped.
  void control(const EvalControl& in) {
    const Eigen::VectorXd tau =
        motion_.G + motion_.C * in.velocity + motion_.B * in.acceleration +
        K_.cwiseProduct(in.reference) + in.kp.cwiseProduct(in.reference - case_.q) +
        D_.cwiseProduct(in.velocity) + in.kd.cwiseProduct(in.velocity - case_.qd);
    add("tau", Shape::vector, tau);
    add_actuation_torque("tau_A_couple", ActuationModel::couple, tau);
    add_actuation_torque("tau_A_chamber", ActuationModel::chamber, tau);
  }

  /// A^-1 tau; no value where A of any segment is singular.
  void add_actuation_torque(const char* name, ActuationModel model, const Eigen::VectorXd& tau) {
    Eigen::VectorXd result(dof_);
    for (int i = 0; i < dof_; i += arm_.segment_dof()) {
      const Eigen::Vector2d q = case_.q.segment<2>(i), force = tau.segment<2>(i);
      if (singular(model, q)) return add_missing(name);
      if (arm_.extensible) result(i + 2) = axial(model) * tau(i + 2);
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

  /// (16) for the acceleration.
  void forward(const Eigen::VectorXd& tau_actuation) {
    bool at_zero = false;
    for (int i = 1; i < dof_; i += 2) at_zero = at_zero || (case_.polar && case_.q(i) == 0.0);
    for (const auto& [name, model] : {std::pair{"qdd_couple", ActuationModel::couple},
                                      std::pair{"qdd_chamber", ActuationModel::chamber}}) {
      Eigen::VectorXd result(dof_);
      const bool solved = method_ == EvalMethod::augmented
                              ? accelerate_in_polar(model, tau_actuation, result)
                              : accelerate_in_u(model, tau_actuation, result);
      if (solved && !at_zero) {
        add(name, Shape::vector, result);
      } else {
        add_missing(name);
      }
    }
  }

  /// Solved in u, where B is regular at theta = 0, then taken to the case's coordinates.
  bool accelerate_in_u(ActuationModel model, const Eigen::VectorXd& tau_actuation,
                       Eigen::VectorXd& result) {
    arm_.actuation = model;
    Eigen::VectorXd force(dof_), acceleration(dof_);
    apply_actuation(arm_, u_, tau_actuation, force);
    if (case_.tip_force_n) add_tip_force(arm_, u_, *case_.tip_force_n, force);
    const bool solved = forward_dynamics(arm_, workspace_, u_, velocity_, force, acceleration);
    result = acceleration;
    if (case_.polar) u_acceleration_to_polar(case_.q, case_.qd, acceleration, result);
    return solved;
  }

  bool accelerate_in_polar(ActuationModel model, const Eigen::VectorXd& tau_actuation,
                           Eigen::VectorXd& result) {
    Eigen::VectorXd force = input_matrix(model) * tau_actuation - motion_.C * case_.qd -
                            D_.cwiseProduct(case_.qd) - motion_.G - K_.cwiseProduct(case_.q);
    if (case_.tip_force_n) force += motion_.J.transpose() * *case_.tip_force_n;
    return solve_inertia(workspace_, motion_.B, force, result);
  }

  void inverse(const EvalInverseKinematics& in) {
    Eigen::VectorXd velocity(dof_), acceleration(dof_);
    if (inverse_kinematics(in.gains, motion_.J, motion_.J_rate, case_.qd,
                           motion_.ends.back().translation(), in.reference, velocity,
                           acceleration)) {
      add("qbar_dot", Shape::vector, velocity);
      add("qbar_ddot", Shape::vector, acceleration);
    } else {
      add_missing("qbar_dot");
      add_missing("qbar_ddot");
    }
  }

  void chambers(const EvalChambers& in) {
    Eigen::VectorXd force(dof_);
    std::vector<Eigen::MatrixXd> lengths;
    for (std::size_t i = 0; i < in.geometry.size(); ++i) {
      const ChamberGeometry& geometry = in.geometry[i];
      const Eigen::Vector3d q = u_.segment<3>(3 * static_cast<Eigen::Index>(i));
      const double length = arm_.segments[i].length_m + q.z();
      force.segment<3>(3 * static_cast<Eigen::Index>(i)) =
          chamber_force(geometry, in.pressures_bar[i]);
      Eigen::VectorXd fibres(static_cast<Eigen::Index>(geometry.angles_rad.size()));
      for (std::size_t j = 0; j < geometry.angles_rad.size(); ++j) {
        fibres(static_cast<Eigen::Index>(j)) =
            fibre_length(length, q.head<2>(), geometry.offset_m, geometry.angles_rad[j]);
      }
      lengths.emplace_back(fibres);
    }
    add("chambers/generalized_force", Shape::vector, force);
    add("chambers/length", Shape::vectors, std::move(lengths));
  }

  const EvalCase& case_;
  EvalMethod method_;
  ArmParameters arm_;
  int dof_;
  DynamicsWorkspace workspace_;
  Eigen::VectorXd u_, velocity_, K_, D_;
  EvaluatedMotion motion_;
  std::vector<NamedTerm> terms_;
};

}  // namespace

std::vector<NamedTerm> evaluate(const EvalCase& eval_case, EvalMethod method) {
  return Evaluation(eval_case, method).run();
}

}  // namespace softarm
