// What `softarm eval` reads and what it computes.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "softarm/control/inverse_kinematics.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// Inputs of (17), in the case's coordinates, 2n each; gains are diagonals.
struct EvalControl {
  Eigen::VectorXd reference, velocity, acceleration, kp, kd;
};

/// Inputs of (21).
struct EvalInverseKinematics {
  InverseKinematicsGains gains;
  TipReference reference;
};

/// One state of one arm. `q` and `qd` are in polar [phi, theta] or in u, 2n.
struct EvalCase {
  std::string id;
  bool polar = false;
  ArmParameters arm;
  Eigen::VectorXd q, qd;
  std::optional<EvalControl> control;
  std::optional<Eigen::VectorXd> tau_actuation;
  std::optional<EvalInverseKinematics> inverse_kinematics;
};

/// Reads `{cases: [...]}` from JSON or YAML. @throws ConfigError
std::vector<EvalCase> read_eval_cases(const std::string& file);

/// One term: a number, a vector, a matrix, or one matrix a segment; no matrices at all where the
/// quantity does not exist.
struct EvalTerm {
  enum class Shape { number, vector, matrix, list } shape = Shape::matrix;
  std::vector<Eigen::MatrixXd> matrices;
};

struct NamedTerm {
  std::string name;
  EvalTerm term;
};

/// The route of evaluation: `direct` is what runs in the loop, `augmented` the paper's own.
enum class EvalMethod { direct, augmented };

/// Every term that the case's inputs allow, in the order in which they are printed.
/// @throws std::invalid_argument if the augmented robot cannot stand for the case: it knows polar
/// coordinates and point masses.
std::vector<NamedTerm> evaluate(const EvalCase& eval_case, EvalMethod method);

}  // namespace softarm
