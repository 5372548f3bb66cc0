// Every term of the model for one state, in the state's own coordinates: for comparison with other
// programs (`softarm eval`).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "softarm/control/inverse_kinematics.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/model/chambers.hpp"

namespace softarm {

/// Inputs of (17), in the case's coordinates, 2n or 3n each; gains are diagonals.
struct EvalControl {
  Eigen::VectorXd reference, velocity, acceleration, kp, kd;
};

/// Inputs of (21).
struct EvalInverseKinematics {
  InverseKinematicsGains gains;
  TipReference reference;
};

/// Chambers of every segment and the pressure in each.
struct EvalChambers {
  std::vector<ChamberGeometry> geometry;
  std::vector<std::vector<double>> pressures_bar;
};

/// One state of one arm. `q` and `qd` are in polar [phi, theta] or in u, 2n, or in [u_x, u_y, e],
/// 3n, where the arm is extensible.
struct EvalCase {
  std::string id;
  bool polar = false;
  ArmParameters arm;
  Eigen::VectorXd q, qd;
  std::optional<EvalControl> control;
  std::optional<Eigen::VectorXd> tau_actuation;
  std::optional<Eigen::Vector3d> tip_force_n;  ///< beside tau_actuation, in the world
  std::optional<EvalChambers> chambers;
  std::optional<EvalInverseKinematics> inverse_kinematics;
};

/// One term: a number, a vector, a matrix, or one matrix per segment; no matrices at all where the
/// quantity does not exist.
struct EvalTerm {
  /// How `matrices` are to be read; `vectors`: one column per segment.
  enum class Shape { number, vector, matrix, list, vectors };
  Shape shape = Shape::matrix;
  std::vector<Eigen::MatrixXd> matrices;
};

/// A term with its name in the table of `evaluate`; a slash is a level of the output.
struct NamedTerm {
  std::string name;
  EvalTerm term;
};

/// The route of evaluation: `direct` is what runs in the loop, `augmented` the paper's own.
enum class EvalMethod { direct, augmented };

/// Every term that the case's inputs allow, in the order in which they are printed, in SI units; q
/// is the case's own coordinates, poses are in the world.
///
/// | name | shape | |
/// |---|---|---|
/// | xi, xi_dot, J_m | 10n, 10n, 10n x 2n | the rigid robot's joints (Table I), `augmented` only |
/// | T_world, T_local | n of 4 x 4 | pose of each segment's end, in the world and in its start |
/// | com_world | n x 3 | centres of mass |
/// | J_tip, Jdot_tip, Jw_tip | 3 x 2n | of the tip's position, its rate, of its angular velocity |
/// | B, C, Cqd, G, K, D | 2n x 2n; 2n, 2n; 2n x 2n | of (16) |
/// | A_couple, A_chamber | 2n x 2n | of (16), by either actuation model |
/// | kinetic_energy, gravity_potential | number | |
/// | tau, tau_A_couple, tau_A_chamber | 2n | (17) before A^-1 and after it, with `control` |
/// | qdd_couple, qdd_chamber | 2n | (16) solved, with `tau_actuation` |
/// | chambers/generalized_force, chambers/length | 3n, n of m | with `chambers` |
/// | qbar_dot, qbar_ddot | 2n | (21), with `inverse_kinematics` |
///
/// @throws std::invalid_argument if the augmented robot cannot stand for the case: it knows polar
/// coordinates and point masses.
std::vector<NamedTerm> evaluate(const EvalCase& eval_case, EvalMethod method);

}  // namespace softarm
