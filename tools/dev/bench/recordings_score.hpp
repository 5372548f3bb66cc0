// How far a predicted motion is from a recorded one.
#pragma once

#include "dev/bench/recordings_bench.hpp"

namespace softarm {

/// Scores frames at `time_s`.
ArenaScore score(const Eigen::VectorXd& time_s, const Eigen::MatrixXd& measured_rad,
                 const Eigen::MatrixXd& predicted_rad, const Eigen::MatrixX3d& measured_tip_m,
                 const Eigen::MatrixX3d& predicted_tip_m, bool cycles);

}  // namespace softarm
