// What the recursions keep of every segment between their passes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/own_columns.hpp"
#include "model/segment_lanes.hpp"
#include "softarm/model/dynamics.hpp"

namespace softarm {

/// Inverse dynamics: what a segment's own mass does, in S_{i-1}.
struct SegmentForces {
  Vector3 force;
  Vector3 moment;             ///< about the segment's base p_{i-1}
  double torque_x, torque_y;  ///< on the segment's own u
};

/// Full matrices: a segment's columns, all in S_{i-1}. A dot is a time derivative in the world,
/// seen from S_{i-1}.
struct SegmentColumns {
  Turn turn;
  double mass;
  Vector3 tip;       ///< p_i - p_{i-1}
  Vector3 tip_rate;  ///< its rate
  Vector3 gravity;
  PairVector3 translation, translation_rate;  ///< v: motion of p_i for unit u_x', u_y'
  PairVector3 rotation, rotation_rate;        ///< w: angular velocity of S_i for the same
  OwnColumns own;
};

struct DynamicsWorkspace::Storage {
  explicit Storage(int segments);

  std::vector<SegmentLanes> lanes;  // four segments each
  std::vector<SegmentForces> forces;
  std::vector<SegmentColumns> columns;
  Eigen::VectorXd zeros, bias, scale, rhs, solution, residual;
  Eigen::MatrixXd B, factor;
};

}  // namespace softarm
