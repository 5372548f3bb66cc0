// The inputs that every method of the benchmark gets: one arm, many random states, in both
// coordinates.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "softarm/control/reference.hpp"
#include "softarm/model/arm.hpp"

namespace softarm {

/// One state and one reference, 2n numbers each; polar q = [phi, theta] and the same in u, or in (u,
/// e) with 3n.
struct BenchState {
  Eigen::VectorXd q, q_velocity, q_acceleration;
  Eigen::VectorXd u, velocity, acceleration;
  ReferenceWindow reference;  ///< without a valve lag; with its polar form
};

struct BenchInputs {
  ArmParameters arm;  ///< n of the paper's segments (section VII), hanging
  std::vector<BenchState> states;
};

/// theta from 0.1 to 1.5 rad, any phi, speeds to 2 rad/s, accelerations to 5 rad/s^2: inside what
/// every method, KDL's chain included, evaluates well. As many states as fit a first-level cache,
/// 8 to 64. Deterministic. Of an extensible arm the same bends with elongations to 30 mm, 0.1 m/s
/// and 1 m/s^2.
BenchInputs bench_inputs(int segments, bool extensible = false);

}  // namespace softarm
